// The `pneuma` command: flags to a request, a reply to lines. Exit codes: 0 done, 1 the work failed, 2 bad usage.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <CLI/CLI.hpp>

#include "base/version.h"
#include "command/arguments.h"
#include "command/checks.h"
#include "command/commands.h"
#include "command/json.h"
#include "pneuma_client/client.h"

namespace {

using pneuma::base::Status;
using pneuma::base::StatusCode;
using pneuma::client::address_check;
using pneuma::client::Client;
using pneuma::client::FileSession;
using pneuma::client::not_negative_check;
using pneuma::client::numbers_check;
using pneuma::client::parse_numbers;
using pneuma::client::positive_check;
using pneuma::client::Session;
using pneuma::client::to_vec3;

constexpr int exit_done = 0;
constexpr int exit_failed = 1;
constexpr int exit_usage = 2;

struct Flags {
  std::string server = "127.0.0.1:7420";
  std::string token_file;
  pneuma::client::ConnectOptions connect;
  bool json = false;
};

using Work = std::function<Status(Session&)>;
using FileWork = std::function<Status(FileSession&)>;  // that needs no server

pneuma::v1::Vec3 vector_of(const std::string& text) {
  const auto numbers = parse_numbers<3>(text).value();
  return to_vec3(numbers[0], numbers[1], numbers[2]);
}

void add_worlds(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("worlds", "List the server's worlds");
  command->callback([&work] { work = pneuma::client::list_worlds; });
}

void add_create(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("create", "Create a world from a built-in scene or a scene file");
  auto arguments = std::make_shared<pneuma::client::CreateArguments>();
  command->add_option("SCENE", arguments->source, "A scene file, - for standard input, or the name of a built-in scene")
      ->required();
  command->add_option("--name", arguments->name, "The world's name; otherwise the scene's");
  command->add_flag("--paused", arguments->paused, "Create it paused");
  command->callback([&work, arguments] {
    work = [arguments](Session& session) { return pneuma::client::create(session, *arguments); };
  });
}

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

void add_watch(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("watch", "Print a world's frames as they come");
  auto arguments = std::make_shared<pneuma::client::WatchArguments>();
  command->add_option("WORLD", arguments->world)->required();
  add_stream_options(*command, *arguments);
  command->add_option("--obj", arguments->obj_folder, "Write each frame into this folder as a Wavefront file");
  command->add_flag("--contacts", arguments->stream.contacts, "Where bodies touch, too");
  command->add_flag("--adaptive", arguments->stream.adaptive,
                    "Where this reader is too slow, a larger error or a lower rate, and back when it is not");
  command->add_flag("--layers", arguments->stream.time_layers,
                    "In time layers: where this reader is too slow, fewer frames instead of gaps");
  command->add_flag("--stats", arguments->stats, "Once a second, how the server sees this reader");
  command->callback([&work, arguments] {
    work = [arguments](Session& session) { return pneuma::client::watch(session, *arguments); };
  });
}

void add_record(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("record", "Write a world's frames, and the changes made to it, into a file");
  auto arguments = std::make_shared<pneuma::client::RecordArguments>();
  command->add_option("WORLD", arguments->world)->required();
  command->add_option("FILE", arguments->file)->required();
  add_stream_options(*command, *arguments);
  command
      ->add_option("--key-every", arguments->stream.key_interval_s,
                   "Seconds between key frames: a seek decodes no more than this")
      ->check(positive_check())
      ->capture_default_str();
  command->add_flag("--force", arguments->force, "Replace a file that is there");
  command->callback([&work, arguments] {
    work = [arguments](Session& session) { return pneuma::client::record(session, *arguments); };
  });
}

void add_play(CLI::App& app, FileWork& work) {
  auto* command = app.add_subcommand("play",
                                     "Serve a recording as if it were the world: to watch, pause, step, reset and "
                                     "seek; --token is what clients must know");
  auto arguments = std::make_shared<pneuma::client::PlayArguments>();
  pneuma::replay::PlayerOptions& options = arguments->options;
  command->add_option("FILE", arguments->file)->required();
  command->add_option("--listen", options.listen, "HOST:PORT for the protocol; port 0 picks one")
      ->capture_default_str();
  command->add_option("--http", options.http, "HOST:PORT for the page and /ws, or off; port 0 picks one")
      ->capture_default_str();
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
  command->callback([&work, arguments] {
    work = [arguments](FileSession& session) { return pneuma::client::play(session, *arguments); };
  });
}

void add_export(CLI::App& app, FileWork& work) {
  auto* command = app.add_subcommand("export", "Write a recording's soft bodies in another file format");
  auto arguments = std::make_shared<pneuma::client::ExportArguments>();
  pneuma::client::SampleRange& range = arguments->range;
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
  command->callback([&work, arguments] {
    work = [arguments](FileSession& session) { return pneuma::client::export_recording(session, *arguments); };
  });
}

void add_seek(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("seek", "Go to a time of a recording that is played");
  auto world = std::make_shared<std::string>();
  auto time_s = std::make_shared<double>(0.0);
  command->add_option("WORLD", *world)->required();
  command->add_option("T", *time_s, "Seconds from the recording's first frame")
      ->required()
      ->check(not_negative_check());
  command->callback([&work, world, time_s] {
    work = [world, time_s](Session& session) {
      return pneuma::client::report(session, "went to", session.client.seek(*world, *time_s));
    };
  });
}

struct ImpulseArguments {
  pneuma::v1::Impulse request;
  std::uint32_t vertex = 0;
  std::string at;
  std::string ray;
  std::string impulse;
  double radius_m = 0.0;
};

Status send_impulse(Session& session, ImpulseArguments arguments) {
  pneuma::v1::Impulse& request = arguments.request;
  *request.mutable_impulse() = vector_of(arguments.impulse);
  if (!arguments.at.empty()) {
    *request.mutable_near()->mutable_position() = vector_of(arguments.at);
    request.mutable_near()->set_radius_m(arguments.radius_m);
  } else if (!arguments.ray.empty()) {
    const auto ray = parse_numbers<6>(arguments.ray).value();
    *request.mutable_ray()->mutable_origin() = to_vec3(ray[0], ray[1], ray[2]);
    *request.mutable_ray()->mutable_direction() = to_vec3(ray[3], ray[4], ray[5]);
    request.mutable_ray()->set_radius_m(arguments.radius_m);
  }
  return pneuma::client::report(session, "hit", session.client.impulse(request));
}

void add_impulse(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("impulse", "Hit a body: at a vertex, at a point, along a ray, or as a whole");
  auto arguments = std::make_shared<ImpulseArguments>();
  command
      ->add_option_function<std::string>("WORLD",
                                         [arguments](const std::string& name) { arguments->request.set_world(name); })
      ->required();
  auto* body = command->add_option_function<std::string>(
      "BODY", [arguments](const std::string& name) { arguments->request.set_body(name); },
      "A soft or rigid body; with --ray, the first one hit where none is named");
  auto* vertex = command->add_option("--vertex", arguments->vertex, "The vertex of this index");
  auto* at = command->add_option("--at", arguments->at, "X,Y,Z: the surface near this point, in metres");
  auto* ray = command->add_option("--ray", arguments->ray, "OX,OY,OZ,DX,DY,DZ: where a ray first meets a surface");
  auto* radius = command->add_option("--radius", arguments->radius_m, "Share it with the vertices within, in metres");
  command->add_option("--impulse", arguments->impulse, "X,Y,Z in newton seconds")
      ->required()
      ->check(numbers_check<3>());
  at->check(numbers_check<3>())->excludes(vertex);
  ray->check(numbers_check<6>())->excludes(vertex)->excludes(at);
  radius->check(not_negative_check())->excludes(vertex);
  command->callback([&work, arguments, body, vertex, at, ray, radius] {
    if (body->empty() && ray->empty()) throw CLI::RequiredError("BODY");
    if (!radius->empty() && at->empty() && ray->empty()) throw CLI::RequiresError("--radius", "--at or --ray");
    if (!vertex->empty()) arguments->request.set_vertex(arguments->vertex);
    work = [arguments](Session& session) { return send_impulse(session, *arguments); };
  });
}

void add_edit(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("edit", "Change a running world");
  auto world = std::make_shared<std::string>();
  auto file = std::make_shared<std::string>();
  command->add_option("WORLD", *world)->required();
  command->add_option("FILE", *file, "A SceneEdit as JSON, - for standard input")->required();
  command->callback([&work, world, file] {
    work = [world, file](Session& session) { return pneuma::client::edit(session, *world, *file); };
  });
}

void add_resume(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("resume", "Let a paused world go on, or any in slow motion");
  auto world = std::make_shared<std::string>();
  auto time_scale = std::make_shared<std::optional<double>>();
  command->add_option("WORLD", *world)->required();
  command->add_option("--time-scale", *time_scale, "Simulated seconds a second from now on, 0.125 to 1")
      ->check(positive_check());
  command->callback([&work, world, time_scale] {
    work = [world, time_scale](Session& session) {
      return pneuma::client::report(session, "resumed", session.client.resume(*world, *time_scale));
    };
  });
}

void add_step(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("step", "Step a paused world");
  auto world = std::make_shared<std::string>();
  auto ticks = std::make_shared<std::uint32_t>(1);
  command->add_option("WORLD", *world)->required();
  command->add_option("N", *ticks, "Ticks")->check(positive_check())->capture_default_str();
  command->callback([&work, world, ticks] {
    work = [world, ticks](Session& session) {
      return pneuma::client::report(session, "stepped", session.client.step(*world, *ticks));
    };
  });
}

/// A subcommand that names nothing but a world.
void add_of_world(CLI::App& app, Work& work, const std::string& name, const std::string& description,
                  std::function<Status(Session&, const std::string&)> act) {
  auto* command = app.add_subcommand(name, description);
  auto world = std::make_shared<std::string>();
  command->add_option("WORLD", *world)->required();
  command->callback(
      [&work, world, act = std::move(act)] { work = [world, act](Session& session) { return act(session, *world); }; });
}

/// A change of a world as a whole; `deed` is what is said of it.
auto change(const std::string& deed,
            pneuma::base::Result<pneuma::v1::Done> (pneuma::client::Client::*request)(const std::string&)) {
  return [deed, request](Session& session, const std::string& world) {
    return pneuma::client::report(session, deed, (session.client.*request)(world));
  };
}

void add_snapshot(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("snapshot", "Write a world into a file: its state, and how it came to it");
  auto arguments = std::make_shared<pneuma::client::SnapshotArguments>();
  command->add_option("WORLD", arguments->world)->required();
  command->add_option("FILE", arguments->file)->required();
  command->add_flag("--force", arguments->force, "Replace a file that is there");
  command->callback([&work, arguments] {
    work = [arguments](Session& session) { return pneuma::client::snapshot(session, *arguments); };
  });
}

void add_restore(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("restore", "Make a world of a file that snapshot wrote");
  auto arguments = std::make_shared<pneuma::client::RestoreArguments>();
  command->add_option("FILE", arguments->file)->required();
  command->add_option("--name", arguments->name, "The world's name; otherwise as it was");
  command->add_flag("--paused", arguments->paused, "Pause it; otherwise it is paused if it was");
  command->callback([&work, arguments] {
    work = [arguments](Session& session) { return pneuma::client::restore(session, *arguments); };
  });
}

void add_branch(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("branch", "Make a second world of one, as it is or as it was");
  auto request = std::make_shared<pneuma::v1::BranchWorld>();
  command->add_option_function<std::string>("WORLD", [request](const std::string& name) { request->set_world(name); })
      ->required();
  command
      ->add_option_function<std::uint64_t>(
          "--at", [request](std::uint64_t tick) { request->set_tick(tick); },
          "As it was when it had done so many ticks, before what was asked for then")
      ->check(not_negative_check());
  command->add_option_function<std::string>(
      "--name", [request](const std::string& name) { request->set_name(name); },
      "The new world's name; otherwise the world's, with -2, -3...");
  command->add_flag_callback(
      "--paused", [request] { request->set_paused(true); }, "Pause it; otherwise it is paused if the world was");
  command->callback([&work, request] {
    work = [request](Session& session) {
      return pneuma::client::report(session, "branched off", session.client.branch_world(*request));
    };
  });
}

void add_rewind(CLI::App& app, Work& work) {
  auto* command = app.add_subcommand("rewind", "Put a world back to what it was at a tick");
  auto world = std::make_shared<std::string>();
  auto tick = std::make_shared<std::uint64_t>(0);
  command->add_option("WORLD", *world)->required();
  command->add_option("TICK", *tick, "When it had done so many ticks, before what was asked for then")
      ->required()
      ->check(not_negative_check());
  command->callback([&work, world, tick] {
    work = [world, tick](Session& session) {
      return pneuma::client::report(session, "rewound", session.client.rewind_world(*world, *tick));
    };
  });
}

void add_verify(CLI::App& app, FileWork& work) {
  auto* command = app.add_subcommand("verify", "Replay what a file of snapshot holds, and compare the hash");
  auto file = std::make_shared<std::string>();
  command->add_option("FILE", *file)->required();
  command->callback(
      [&work, file] { work = [file](FileSession& session) { return pneuma::client::verify(session, *file); }; });
}

void add_subcommands(CLI::App& app, Work& work, FileWork& file_work) {
  add_worlds(app, work);
  add_create(app, work);
  add_of_world(app, work, "destroy", "Destroy a world", change("destroyed", &Client::destroy_world));
  add_watch(app, work);
  add_record(app, work);
  add_play(app, file_work);
  add_seek(app, work);
  add_export(app, file_work);
  add_impulse(app, work);
  add_edit(app, work);
  add_of_world(app, work, "pause", "Pause a world", change("paused", &Client::pause));
  add_resume(app, work);
  add_step(app, work);
  add_snapshot(app, work);
  add_restore(app, work);
  add_branch(app, work);
  add_rewind(app, work);
  add_verify(app, file_work);
  add_of_world(app, work, "reset", "Put a world back to its scene", change("reset", &Client::reset));
  add_of_world(app, work, "stats", "A world's numbers", pneuma::client::stats);
  add_of_world(app, work, "scene",
               "A world's scene with its edits, as create takes it: rigid bodies, colliders and gas as they are now, "
               "soft bodies where the scene puts them",
               pneuma::client::scene);
}

int fail(const Status& status, bool json, int exit_code) {
  const std::string text = json ? pneuma::client::error_json(status) : "pneuma: " + status.message();
  std::fprintf(stderr, "%s\n", text.c_str());
  return exit_code;
}

/// From the file or the environment where --token gives none.
Status find_token(const Flags& flags, std::string& token) {
  if (!flags.token_file.empty()) {
    auto read = pneuma::client::read_token(flags.token_file);
    if (!read.ok()) return read.status();
    token = std::move(*read);
  } else if (const char* variable = std::getenv("PNEUMA_TOKEN"); token.empty() && variable != nullptr) {
    token = variable;
  }
  return {};
}

pneuma::base::Result<Client> connect(Flags& flags) {
  std::string& token = flags.connect.token;
  if (Status found = find_token(flags, token); !found.ok()) return found;
  auto client = Client::connect(flags.server, flags.connect);
  const Status& status = client.status();
  if (status.code() != StatusCode::unauthenticated || !token.empty()) return client;
  return Status(status.code(), status.what() + "; give it by --token-file, --token or PNEUMA_TOKEN", status.where());
}

int run(Flags& flags, const Work& work) {
  auto client = connect(flags);
  pneuma::client::Output output;
  Status status = client.status();
  if (client.ok()) {
    Session session{*client, output, flags.json};
    status = work(session);
  }
  if (status.ok() || output.is_closed()) return exit_done;
  return fail(status, flags.json, exit_failed);
}

int run(Flags& flags, const FileWork& work) {
  std::string& token = flags.connect.token;
  pneuma::client::Output output;
  Status status = find_token(flags, token);
  if (status.ok()) {
    FileSession session{output, flags.json, token};
    status = work(session);
  }
  if (status.ok() || output.is_closed()) return exit_done;
  return fail(status, flags.json, exit_failed);
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader that goes away is seen where it is written to
  Flags flags;
  flags.connect.client_name = "pneuma";
  Work work;
  FileWork file_work;
  CLI::App app("The client of pneuma-server.", "pneuma");
  app.set_version_flag("--version", "pneuma " + std::string(pneuma::base::version));
  app.fallthrough();
  app.require_subcommand(0, 1);
  app.add_option("--server", flags.server, "HOST:PORT")->capture_default_str()->check(address_check());
  auto* token =
      app.add_option("--token", flags.connect.token, "What the server asks for; otherwise PNEUMA_TOKEN's value");
  app.add_option("--token-file", flags.token_file, "The token is its first line")->excludes(token);
  app.add_flag("--json", flags.json, "One JSON object a line, for scripts; errors too");
  auto* tls = app.add_flag("--tls", flags.connect.tls, "Speak TLS");
  app.add_option("--ca", flags.connect.ca_file, "Trust these certificates (PEM) instead of the system's")->needs(tls);
  add_subcommands(app, work, file_work);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    const bool json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
    return fail(pneuma::base::invalid(error.what()), json, exit_usage);
  }
  if (file_work) return run(flags, file_work);
  if (!work)
    return fail(pneuma::base::invalid("a subcommand is needed; pneuma --help lists them"), flags.json, exit_usage);
  return run(flags, work);
}
