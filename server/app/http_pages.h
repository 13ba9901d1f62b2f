// The pages at the HTTP address. Where the server asks for tokens, only who has one reads of the worlds.
#pragma once

#include <chrono>
#include <vector>

#include "app/hosted_world.h"
#include "app/metric_families.h"
#include "app/metrics.h"
#include "net/server.h"

namespace pneuma::app {

/// What this is, and which worlds there are of those that may be named.
[[nodiscard]] net::HttpReply start_page(const std::vector<WorldStatus>& worlds, const MayName& may_name);
/// 200 where every unpaused world ticked lately and the disk takes what is to be kept of each; otherwise 503 and of
/// which not. Damaged worlds, which no restart mends, are told of either way. Worlds that may not be named are "a
/// world", and no more is said of them.
[[nodiscard]] net::HttpReply health_page(const std::vector<WorldStatus>& worlds,
                                         std::chrono::steady_clock::time_point now, const MayName& may_name);
/// 200: the server answers.
[[nodiscard]] net::HttpReply live_page();
/// 200 where every kept world is up, or found damaged; otherwise 503, and how many are.
[[nodiscard]] net::HttpReply ready_page(const std::vector<WorldStatus>& worlds);
/// With the names of worlds that may be named as labels.
[[nodiscard]] net::HttpReply metrics_page(const Metrics& metrics, const std::vector<WorldStatus>& worlds,
                                          std::chrono::steady_clock::time_point now, const MayName& may_name);
/// Of a page that is for those with a token.
[[nodiscard]] net::HttpReply token_wanted_page();

}  // namespace pneuma::app
