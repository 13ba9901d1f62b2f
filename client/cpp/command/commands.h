// The subcommands of `pneuma`, one function each: what is asked, and where what comes back is written.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "command/output.h"
#include "command/terminal.h"
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
  std::string server;  // HOST:PORT
  bool tls = false;
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
  std::string http;  // HOST:PORT or "off"; empty: beside `options.listen`
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

struct WaitArguments {
  std::string world;
  std::string until;  // as parse_awaited takes it
  double timeout_s = 60.0;
};

/// One of the two.
struct Awaited {
  std::optional<std::uint64_t> tick;
  std::optional<v1::Event::Kind> event;
};
/// A tick, or an event by its name on the wire in either case, with - for _; nothing where the text is neither.
[[nodiscard]] std::optional<Awaited> parse_awaited(const std::string& text);

struct GrabArguments {
  v1::Grab request;          // without its target
  std::vector<v1::Vec3> to;  // one point or more
  double seconds = 1.0;      // for the way along all of them
  double hold_s = 0.0;       // at the last
};

struct OpenArguments {
  std::string world;  // empty: the page as it opens
  std::string http;   // HOST:PORT; empty: the port after the server's
};

[[nodiscard]] base::Status list_worlds(Session& session);
/// Waits until a world has done as many ticks, or an event of the kind comes. Fails when the time is over before that.
[[nodiscard]] base::Status wait(Session& session, const WaitArguments& arguments);
/// Holds a vertex, moves it along straight lines from where it is, and lets go, then or when the user interrupts.
[[nodiscard]] base::Status grab(Session& session, const GrabArguments& arguments);
/// Prints the worlds with what they take: on a terminal once a second over the last, until the user interrupts.
[[nodiscard]] base::Status top(Session& session, bool once);
/// Shows the page in a browser, and prints its address.
[[nodiscard]] base::Status open_page(Session& session, const OpenArguments& arguments);
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
/// As in "running", "running at 0.25", "paused, 2 frozen", "damaged", "restoring".
[[nodiscard]] std::string world_state(const v1::WorldList::World& world);
/// How a world that needs somebody's eye stands out in a table.
[[nodiscard]] Style world_style(const v1::WorldList::World& world);
/// Says what a change came to: `deed`, for people, as in "paused".
[[nodiscard]] base::Status report(Session& session, const std::string& deed, const base::Result<v1::Done>& done);

}  // namespace pneuma::client
