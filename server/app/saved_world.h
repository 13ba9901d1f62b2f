// A world as bytes: what persist keeps of it.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>

#include "app/live_world.h"
#include "base/status.h"

namespace pneuma::app {

struct SavedWorld {
  LiveWorld::Saved live;
  bool paused = false;
};

[[nodiscard]] std::string to_bytes(const SavedWorld& world);
/// Refuses bytes of another version, cut off, or with something left over, and a scene that would take more than
/// `scene_bytes_max` of memory.
[[nodiscard]] base::Result<SavedWorld> from_bytes(
    std::string_view bytes, std::size_t scene_bytes_max = std::numeric_limits<std::size_t>::max());

}  // namespace pneuma::app
