// A world in one file: its state, and how it came to it. The format is WIRE.md's "World files".
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/live_world.h"
#include "app/world_moment.h"
#include "base/status.h"
#include "persist/history.h"
#include "pneuma/v1/world_file.pb.h"

namespace pneuma::app {

/// Without `history`, or where it would make the file larger than world_file_bytes_max, the state alone.
[[nodiscard]] v1::WorldFile make_world_file(const std::string& world, const WorldMoment& moment,
                                            const std::optional<persist::History>& history);

/// LIMIT_EXCEEDED where it would be larger than world_file_bytes_max.
[[nodiscard]] base::Result<std::string> to_bytes(const v1::WorldFile& file);
/// Refuses what is no world file, of a version to come, damaged, or would be too large in memory.
[[nodiscard]] base::Result<v1::WorldFile> read_world_file(std::string_view bytes);

struct OpenedWorld {
  LiveWorld live;
  bool paused = false;
};

/// The world as it was saved. Whoever made the file is not trusted: what no server saves is refused, and so is a state
/// that does not have the hash that the file tells.
[[nodiscard]] base::Result<OpenedWorld> open_world(const v1::WorldFile& file, const LiveWorld::Admit& admit);
/// The world as its history begins; the file has one.
[[nodiscard]] base::Result<OpenedWorld> open_history(const v1::WorldFile& file);

}  // namespace pneuma::app
