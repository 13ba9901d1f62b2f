// Subcommands that take in a world's stream, and those for recordings of one.
#include <memory>
#include <string>

#include "command/checks.h"
#include "command/subcommands.h"

namespace pneuma::client {

namespace {

/// Of commands that take in a world's stream.
template <class Arguments>
void add_stream_options(CLI::App& command, Arguments& arguments) {
  command.add_option("--frames", arguments.frames, "End after so many frames")->check(positive_check());
  command.add_option("--seconds", arguments.seconds, "End after so long")->check(positive_check());
  auto& stream = arguments.stream;
  command.add_option("--rate", stream.rate_hz, "Frames a second; otherwise the world's rate")->check(positive_check());
  command.add_option("--max-error", stream.max_error_m, "No vertex is further off than this, in metres")
      ->check(positive_check());
  command.add_option("--body", stream.bodies, "Only this soft body; may be given for several")->allow_extra_args(false);
  command.add_option("--level", stream.level_of_detail, "Coarser meshes: a quarter of the vertices each level");
  command.add_flag("--velocities", stream.velocities, "The vertices' velocities, too");
  command.add_flag("--scalars", stream.scalars, "Each body's volume, pressure and energies, and whether it sleeps");
  command.add_flag("--simulated", stream.simulated, "Fewer bytes, for simulating the bodies here, too");
}

}  // namespace

void add_watch(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("watch", "Print a world's frames as they come");
  auto arguments = std::make_shared<WatchArguments>();
  command->add_option("WORLD", arguments->world)->required();
  add_stream_options(*command, *arguments);
  command->add_option("--obj", arguments->obj_folder, "Write each frame into this folder as a Wavefront file");
  command->add_flag("--contacts", arguments->stream.contacts, "Where bodies touch, too");
  command->add_flag("--adaptive", arguments->stream.adaptive,
                    "Where this reader is too slow, a larger error or a lower rate, and back when it is not");
  command->add_flag("--layers", arguments->stream.time_layers,
                    "In time layers: where this reader is too slow, fewer frames instead of gaps");
  command->add_flag("--stats", arguments->stats, "Once a second, how the server sees this reader");
  command->callback(
      [&task, arguments] { task.with_server = [arguments](Session& session) { return watch(session, *arguments); }; });
}

void add_wait(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("wait", "Wait until a world is at a tick, or something happens in it");
  auto arguments = std::make_shared<WaitArguments>();
  command->add_option("WORLD", arguments->world)->required();
  command->add_option("--until", arguments->until, "The tick, or an event such as BODY_BURST")
      ->required()
      ->check(awaited_check());
  command->add_option("--timeout", arguments->timeout_s, "Fail after so many seconds")
      ->check(seconds_check())
      ->capture_default_str();
  command->callback(
      [&task, arguments] { task.with_server = [arguments](Session& session) { return wait(session, *arguments); }; });
}

void add_record(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("record", "Write a world's frames, and the changes made to it, into a file");
  auto arguments = std::make_shared<RecordArguments>();
  command->add_option("WORLD", arguments->world)->required();
  command->add_option("FILE", arguments->file)->required();
  add_stream_options(*command, *arguments);
  command
      ->add_option("--key-every", arguments->stream.key_interval_s,
                   "Seconds between key frames: a seek decodes no more than this")
      ->check(positive_check())
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "Replace a file that is there");
  command->callback(
      [&task, arguments] { task.with_server = [arguments](Session& session) { return record(session, *arguments); }; });
}

void add_play(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("play",
                                     "Serve a recording as if it were the world: to watch, pause, step, reset and "
                                     "seek; --token is what clients must know");
  auto arguments = std::make_shared<PlayArguments>();
  replay::PlayerOptions& options = arguments->options;
  command->add_option("FILE", arguments->file)->required();
  command->add_option("--listen", options.listen, "HOST:PORT for the protocol; port 0 picks one")
      ->capture_default_str();
  command->add_option("--http", arguments->http,
                      "HOST:PORT for the page and /ws, or off; otherwise the port after that of --listen");
  command
      ->add_option("--allow-host", options.allow_hosts,
                   "A name by which the HTTP address is asked, beside its addresses and localhost; * for any")
      ->take_all();
  command->add_flag("--insecure", options.insecure, "Serve others than this machine without asking for a token");
  command->add_option("--web-dir", options.web_dir, "The page for browsers at the HTTP address, or off")
      ->default_str("../share/pneuma/web beside this program, if there is one");
  command->add_option("--speed", options.play.speed, "Recorded seconds a second")
      ->check(positive_check())
      ->capture_default_str();
  command->add_flag("--loop", options.play.loop, "Begin again at the end");
  command->add_option("--at", options.play.start_s, "Begin so many seconds into it")->check(not_negative_check());
  command->add_flag("--paused", options.play.paused, "Begin paused");
  command->callback(
      [&task, arguments] { task.alone = [arguments](FileSession& session) { return play(session, *arguments); }; });
}

void add_export(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("export", "Write a recording's soft bodies in another file format");
  auto arguments = std::make_shared<ExportArguments>();
  SampleRange& range = arguments->range;
  command->add_option("FILE", arguments->file)->required();
  command
      ->add_option(
          "--format", arguments->format,
          "obj: a folder of Wavefront files; pc2: a folder of point caches and meshes; gltf: a .glb with morph "
          "targets; usda: USD with time samples")
      ->required()
      ->check(CLI::IsMember({"obj", "gltf", "pc2", "usda"}));
  command->add_option("--out", arguments->out, "The folder, or the file: .glb for gltf, .usda for usda")->required();
  command->add_flag("--force", arguments->force, "Replace what is there");
  command->add_option("--body", range.body, "This soft body alone");
  command->add_option("--from", range.from_s, "Seconds into the recording")->check(not_negative_check());
  command->add_option("--to", range.to_s, "Seconds into the recording")->check(not_negative_check());
  command->add_option("--rate", range.rate_hz, "Frames a second; otherwise the recording's")->check(positive_check());
  command->callback([&task, arguments] {
    task.alone = [arguments](FileSession& session) { return export_recording(session, *arguments); };
  });
}

void add_seek(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("seek", "Go to a time of a recording that is played");
  auto world = std::make_shared<std::string>();
  auto time_s = std::make_shared<double>(0.0);
  command->add_option("WORLD", *world)->required();
  command->add_option("T", *time_s, "Seconds from the recording's first frame")
      ->required()
      ->check(not_negative_check());
  command->callback([&task, world, time_s] {
    task.with_server = [world, time_s](Session& session) {
      return report(session, "went to", session.client.seek(*world, *time_s));
    };
  });
}

}  // namespace pneuma::client
