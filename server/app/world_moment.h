// A world between two of its ticks, as what looks back on it needs to know.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "app/inbox.h"
#include "app/saved_world.h"
#include "base/status.h"
#include "persist/command_log.h"

namespace pneuma::app {

struct WorldMoment {
  SavedWorld world;
  std::uint64_t state_hash = 0;
  /// Where its log stands; none where nothing is kept of it.
  std::optional<persist::LogEnd> log_end;
  /// The first of its checkpoints that leads here.
  std::uint64_t first_checkpoint = 0;
};

/// Takes a request (TakeSnapshot, BranchWorld, RewindWorld) to be answered later; refuses one that it has no room for.
/// `moment` is called before it returns, or not at all.
using LookBackOn = std::function<base::Status(const Request& request, const std::function<WorldMoment()>& moment)>;

}  // namespace pneuma::app
