#include "command/subcommands.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "command/checks.h"

namespace pneuma::client {

namespace {

void add_worlds(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("worlds", "List the server's worlds");
  command->callback([&task] { task.with_server = list_worlds; });
}

void add_top(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("top", "Show what the worlds take, once a second until Ctrl-C");
  auto once = std::make_shared<bool>(false);
  command->add_flag("--once", *once, "Show it once and end, as where standard output is no terminal");
  command->callback([&task, once] { task.with_server = [once](Session& session) { return top(session, *once); }; });
}

void add_open(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("open", "Open the server's page in a browser: that of BROWSER, or by xdg-open");
  auto arguments = std::make_shared<OpenArguments>();
  command->add_option("WORLD", arguments->world, "Show this world");
  command->add_option("--http", arguments->http, "HOST:PORT of the page; otherwise the port after the server's")
      ->check(address_check());
  command->callback([&task, arguments] {
    task.with_server = [arguments](Session& session) { return open_page(session, *arguments); };
  });
}

void add_create(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("create", "Create a world from a built-in scene or a scene file");
  auto arguments = std::make_shared<CreateArguments>();
  command->add_option("SCENE", arguments->source, "A scene file, - for standard input, or the name of a built-in scene")
      ->required();
  command->add_option("--name", arguments->name, "The world's name; otherwise the scene's");
  command->add_flag("--paused", arguments->paused, "Create it paused");
  command->callback(
      [&task, arguments] { task.with_server = [arguments](Session& session) { return create(session, *arguments); }; });
}

void add_edit(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("edit", "Change a running world");
  auto world = std::make_shared<std::string>();
  auto file = std::make_shared<std::string>();
  command->add_option("WORLD", *world)->required();
  command->add_option("FILE", *file, "A SceneEdit as JSON, - for standard input")->required();
  command->callback([&task, world, file] {
    task.with_server = [world, file](Session& session) { return edit(session, *world, *file); };
  });
}

void add_resume(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("resume", "Let a paused world go on, or any in slow motion");
  auto world = std::make_shared<std::string>();
  auto time_scale = std::make_shared<std::optional<double>>();
  command->add_option("WORLD", *world)->required();
  command->add_option("--time-scale", *time_scale, "Simulated seconds a second from now on, 0.125 to 1")
      ->check(positive_check());
  command->callback([&task, world, time_scale] {
    task.with_server = [world, time_scale](Session& session) {
      return report(session, "resumed", session.client.resume(*world, *time_scale));
    };
  });
}

void add_step(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("step", "Step a paused world");
  auto world = std::make_shared<std::string>();
  auto ticks = std::make_shared<std::uint32_t>(1);
  command->add_option("WORLD", *world)->required();
  command->add_option("N", *ticks, "Ticks")->check(positive_check())->capture_default_str();
  command->callback([&task, world, ticks] {
    task.with_server = [world, ticks](Session& session) {
      return report(session, "stepped", session.client.step(*world, *ticks));
    };
  });
}

/// A subcommand that names nothing but a world.
void add_of_world(CLI::App& app, Task& task, const std::string& name, const std::string& description,
                  std::function<base::Status(Session&, const std::string&)> act) {
  auto* command = app.add_subcommand(name, description);
  auto world = std::make_shared<std::string>();
  command->add_option("WORLD", *world)->required();
  command->callback([&task, world, act = std::move(act)] {
    task.with_server = [world, act](Session& session) { return act(session, *world); };
  });
}

/// A change of a world as a whole; `deed` is what is said of it.
auto change(const std::string& deed, base::Result<v1::Done> (Client::*request)(const std::string&)) {
  return [deed, request](Session& session, const std::string& world) {
    return report(session, deed, (session.client.*request)(world));
  };
}

void add_snapshot(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("snapshot", "Write a world into a file: its state, and how it came to it");
  auto arguments = std::make_shared<SnapshotArguments>();
  command->add_option("WORLD", arguments->world)->required();
  command->add_option("FILE", arguments->file)->required();
  command->add_flag("--force", arguments->force, "Replace a file that is there");
  command->callback([&task, arguments] {
    task.with_server = [arguments](Session& session) { return snapshot(session, *arguments); };
  });
}

void add_restore(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("restore", "Make a world of a file that snapshot wrote");
  auto arguments = std::make_shared<RestoreArguments>();
  command->add_option("FILE", arguments->file)->required();
  command->add_option("--name", arguments->name, "The world's name; otherwise as it was");
  command->add_flag("--paused", arguments->paused, "Pause it; otherwise it is paused if it was");
  command->callback([&task, arguments] {
    task.with_server = [arguments](Session& session) { return restore(session, *arguments); };
  });
}

void add_branch(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("branch", "Make a second world of one, as it is or as it was");
  auto request = std::make_shared<v1::BranchWorld>();
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
  command->callback([&task, request] {
    task.with_server = [request](Session& session) {
      return report(session, "branched off", session.client.branch_world(*request));
    };
  });
}

void add_rewind(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("rewind", "Put a world back to what it was at a tick");
  auto world = std::make_shared<std::string>();
  auto tick = std::make_shared<std::uint64_t>(0);
  command->add_option("WORLD", *world)->required();
  command->add_option("TICK", *tick, "When it had done so many ticks, before what was asked for then")
      ->required()
      ->check(not_negative_check());
  command->callback([&task, world, tick] {
    task.with_server = [world, tick](Session& session) {
      return report(session, "rewound", session.client.rewind_world(*world, *tick));
    };
  });
}

void add_verify(CLI::App& app, Task& task) {
  auto* command = app.add_subcommand("verify", "Replay what a file of snapshot holds, and compare the hash");
  auto file = std::make_shared<std::string>();
  command->add_option("FILE", *file)->required();
  command->callback([&task, file] { task.alone = [file](FileSession& session) { return verify(session, *file); }; });
}

}  // namespace

void add_subcommands(CLI::App& app, Task& task) {
  add_worlds(app, task);
  add_top(app, task);
  add_open(app, task);
  add_create(app, task);
  add_of_world(app, task, "destroy", "Destroy a world", change("destroyed", &Client::destroy_world));
  add_watch(app, task);
  add_wait(app, task);
  add_record(app, task);
  add_play(app, task);
  add_seek(app, task);
  add_export(app, task);
  add_impulse(app, task);
  add_grab(app, task);
  add_edit(app, task);
  add_of_world(app, task, "pause", "Pause a world", change("paused", &Client::pause));
  add_resume(app, task);
  add_step(app, task);
  add_snapshot(app, task);
  add_restore(app, task);
  add_branch(app, task);
  add_rewind(app, task);
  add_verify(app, task);
  add_of_world(app, task, "reset", "Put a world back to its scene", change("reset", &Client::reset));
  add_of_world(app, task, "stats", "A world's numbers", stats);
  add_of_world(app, task, "scene",
               "A world's scene with its edits, as create takes it: rigid bodies, colliders and gas as they are now, "
               "soft bodies where the scene puts them",
               scene);
}

}  // namespace pneuma::client
