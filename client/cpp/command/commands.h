// The subcommands of `pneuma`, one function each: what is asked, and where what comes back is written.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/status.h"
#include "command/output.h"
#include "formats/sampler.h"
#include "pneuma_client/client.h"
#include "pneuma_client/playback.h"
#include "replay/player.h"

namespace pneuma::client {

/// What every subcommand works with.
struct Session {
  Client& client;
  Output& output;
  bool json = false;
};

/// What the subcommands work with that need no server.
struct FileSession {
  Output& output;
  bool json = false;
  std::string token;  // that those must know who are served; empty: none
};

struct CreateArguments {
  std::string source;  // a scene file, "-", or the name of a built-in scene
  std::string name;    // empty: the scene's
  bool paused = false;
};

struct WatchArguments {
  std::string world;
  std::optional<std::uint64_t> frames;
  std::optional<double> seconds;
  SubscribeOptions stream;
  std::string obj_folder;  // empty: none
  bool stats = false;      // how the server sees this reader, once a second
};

struct RecordArguments {
  std::string world;
  std::string file;
  std::optional<std::uint64_t> frames;
  std::optional<double> seconds;
  SubscribeOptions stream{.commands = true, .key_interval_s = 1.0};
  bool force = false;
};

struct PlayArguments {
  std::string file;
  replay::PlayerOptions options;
};

struct ExportArguments {
  std::string file;
  std::string format;  // obj, gltf, pc2 or usda
  std::string out;
  bool force = false;  // replaces what is there
  SampleRange range;
};

struct SnapshotArguments {
  std::string world;
  std::string file;
  bool force = false;  // replaces what is there
};

struct RestoreArguments {
  std::string file;
  std::string name;  // empty: that of the world in the file
  bool paused = false;
};

[[nodiscard]] base::Status list_worlds(Session& session);
[[nodiscard]] base::Status create(Session& session, const CreateArguments& arguments);
/// Prints frames, gaps and events until enough of them have come or the user interrupts, then a summary. Fails when the
/// world or the connection ends before that.
[[nodiscard]] base::Status watch(Session& session, const WatchArguments& arguments);
/// Writes the world's stream and the changes made to it into a file, until enough of it has come or the user
/// interrupts. Fails when the world or the connection ends before that, or the disk is full; what came until then is in
/// the file.
[[nodiscard]] base::Status record(Session& session, const RecordArguments& arguments);
/// Serves a recording until the user interrupts.
[[nodiscard]] base::Status play(FileSession& session, const PlayArguments& arguments);
/// Writes a recording's soft bodies in another format.
[[nodiscard]] base::Status export_recording(FileSession& session, const ExportArguments& arguments);
/// Writes a world into a file, whole or not at all.
[[nodiscard]] base::Status snapshot(Session& session, const SnapshotArguments& arguments);
/// Makes a world of such a file.
[[nodiscard]] base::Status restore(Session& session, const RestoreArguments& arguments);
/// Replays such a file's history, and compares the hash that comes out.
[[nodiscard]] base::Status verify(FileSession& session, const std::string& file);
/// On standard error, where a recording ends before its end.
void tell_damage(const Playback& playback);
/// `file`: a SceneEdit as JSON, "-" for standard input.
[[nodiscard]] base::Status edit(Session& session, const std::string& world, const std::string& file);
[[nodiscard]] base::Status stats(Session& session, const std::string& world);
/// The scene in its file form, which `create` takes; with --json in one line.
[[nodiscard]] base::Status scene(Session& session, const std::string& world);
/// Says what a change came to: `deed`, for people, as in "paused".
[[nodiscard]] base::Status report(Session& session, const std::string& deed, const base::Result<v1::Done>& done);

}  // namespace pneuma::client
