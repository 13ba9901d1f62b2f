// What another process takes in memory, as the system counts it.
#pragma once

#include <cstddef>
#include <fstream>
#include <optional>
#include <string>

#include <sys/types.h>

namespace pneuma::support {

/// A line of /proc/PID/status in bytes: "VmRSS:", what it holds now, or "VmHWM:", the most it held so far.
inline std::optional<std::size_t> memory_bytes(pid_t pid, const std::string& line) {
  std::ifstream status("/proc/" + std::to_string(pid) + "/status");
  std::string word;
  while (status >> word && word != line) {
  }
  std::size_t kibibytes = 0;
  if (!(status >> kibibytes)) return std::nullopt;
  return kibibytes * 1024;
}

}  // namespace pneuma::support
