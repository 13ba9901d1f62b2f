// The pages that anyone who reaches the HTTP address may read.
#pragma once

#include <chrono>
#include <vector>

#include "app/hosted_world.h"
#include "app/metric_families.h"
#include "app/metrics.h"
#include "net/server.h"

namespace pneuma::app {

/// What this is, and which worlds there are.
[[nodiscard]] net::HttpReply start_page(const std::vector<WorldStatus>& worlds);
/// 200 where every unpaused world ticked lately and the disk takes what is to be kept of each; otherwise 503 and of
/// which not. Damaged worlds, which no restart mends, are named either way.
[[nodiscard]] net::HttpReply health_page(const std::vector<WorldStatus>& worlds,
                                         std::chrono::steady_clock::time_point now);
/// 200: the server answers.
[[nodiscard]] net::HttpReply live_page();
/// 200 where every kept world is up, or found damaged; otherwise 503, and how many are.
[[nodiscard]] net::HttpReply ready_page(const std::vector<WorldStatus>& worlds);
/// With the names of worlds as labels where that is asked for.
[[nodiscard]] net::HttpReply metrics_page(const Metrics& metrics, const std::vector<WorldStatus>& worlds,
                                          std::chrono::steady_clock::time_point now, WorldNames names);

}  // namespace pneuma::app
