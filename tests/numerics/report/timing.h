// Times that can be compared: a warm-up, then rounds in which the contenders take turns, and the median of each.
#pragma once

#include <functional>
#include <vector>

namespace pneuma::report {

/// Of this process, all threads.
[[nodiscard]] double cpu_time_s();

/// CPU seconds of one run of each contender: the median over `rounds` rounds after one that is not counted. What a
/// contender's first run shows to take over `once_s` is run no more than that. `between` is called
/// between runs, untimed.
[[nodiscard]] std::vector<double> race_s(const std::vector<std::function<void()>>& contenders, int rounds,
                                         double once_s = 1e9, const std::function<void()>& between = {});

}  // namespace pneuma::report
