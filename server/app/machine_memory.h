// How much memory there is for this process.
#pragma once

#include <cstddef>
#include <string>

namespace pneuma::app {

/// The machine's, or less where a control group that the process is in, or one around it, allows less. `root` is where
/// /proc and /sys are looked for.
[[nodiscard]] std::size_t machine_memory_bytes(const std::string& root = {});

}  // namespace pneuma::app
