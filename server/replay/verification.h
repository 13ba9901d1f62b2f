// Checks a world file by its own history.
#pragma once

#include <cstdint>
#include <string>

#include "base/status.h"

namespace pneuma::replay {

struct Verification {
  std::string world;
  std::uint64_t tick = 0;
  std::uint64_t state_hash = 0;
  bool has_history = false;
  std::uint64_t ticks_replayed = 0;
  std::uint64_t commands_replayed = 0;
};

/// Brings the world of a file back, and takes the state that its history begins with through all changes since. Fails
/// where either does not have the hash that the file tells. Errors name the file.
[[nodiscard]] base::Result<Verification> verify_world_file(const std::string& path);

/// The bytes of a file that may be a world file; larger ones are refused unread.
[[nodiscard]] base::Result<std::string> read_world_bytes(const std::string& path);

}  // namespace pneuma::replay
