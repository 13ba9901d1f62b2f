// The pages that anyone who reaches the HTTP address may read.
#pragma once

#include <chrono>
#include <vector>

#include "app/hosted_world.h"
#include "app/metrics.h"
#include "net/server.h"

namespace pneuma::app {

/// What this is, and which worlds there are.
[[nodiscard]] net::HttpReply start_page(const std::vector<WorldStatus>& worlds);
/// 200 where every unpaused world ticked lately and the disk takes what is to be kept of each; otherwise 503 and of
/// which not. Damaged worlds, which no restart mends, are named either way.
[[nodiscard]] net::HttpReply health_page(const std::vector<WorldStatus>& worlds,
                                         std::chrono::steady_clock::time_point now);
[[nodiscard]] net::HttpReply metrics_page(const Metrics& metrics);

}  // namespace pneuma::app
