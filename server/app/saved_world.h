// A world as bytes: what persist keeps of it.
#pragma once

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
/// Refuses bytes of another version, cut off, or with something left over.
[[nodiscard]] base::Result<SavedWorld> from_bytes(std::string_view bytes);

}  // namespace pneuma::app
