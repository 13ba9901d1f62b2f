// A server's process and its frames as they are seen from outside.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include <sys/types.h>

#include "base/status.h"

namespace pneuma::bench {

/// 0 of none.
[[nodiscard]] double percentile(std::vector<double> values, double share);
[[nodiscard]] double count_within(const std::vector<double>& values, double bound);
[[nodiscard]] double share_within(const std::vector<double>& values, double bound);

[[nodiscard]] double resident_mib(pid_t pid);
/// That all its threads have had so far.
[[nodiscard]] double processor_s(pid_t pid);

struct CrowdRun {
  std::vector<double> ages_ms;  // of the prompt clients' frames: from when the tick was due, which is before its end
  double encode_us = 0.0;       // median
  double tick_late_ms = 0.0;    // p99 of a tick's end after it was due
  double slipped_s = 0.0;
};

/// Five balls on a server of one core. They are watched from another one by a client that asks for stats and `prompt`
/// others at 30 Hz, and where `slow` is set by one that reads a byte a second and one that reads nothing.
[[nodiscard]] base::Result<CrowdRun> watch_five_balls(std::size_t prompt, bool slow, std::chrono::seconds watched);

/// That many worlds of five balls on a server of all cores, each watched by one client at 60 Hz within 1 mm. How late
/// each frame came against a clock that ticks at its world's rate from the world's promptest frame on.
[[nodiscard]] base::Result<std::vector<double>> watch_worlds_late_ms(std::size_t worlds, std::chrono::seconds watched);

}  // namespace pneuma::bench
