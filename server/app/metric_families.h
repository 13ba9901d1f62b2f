// What is told to Prometheus as it stands when it is asked for: worlds, the process, the build.
#pragma once

#include <chrono>
#include <cstddef>
#include <vector>

#include <prometheus/metric_family.h>

#include "app/grant.h"
#include "app/world_status.h"

namespace pneuma::app {

/// Each world is a label of three series; those past this, by name, are in the worst of all alone.
inline constexpr std::size_t labelled_worlds_max = 100;

/// Lateness, time ratio and checkpoint age: the worst of all worlds, and those of each that may be named.
[[nodiscard]] std::vector<prometheus::MetricFamily> world_families(const std::vector<WorldStatus>& worlds,
                                                                   std::chrono::steady_clock::time_point now,
                                                                   const MayName& may_name);
/// Under the names that Prometheus' own client libraries give them.
[[nodiscard]] std::vector<prometheus::MetricFamily> process_families();
[[nodiscard]] prometheus::MetricFamily build_family();

}  // namespace pneuma::app
