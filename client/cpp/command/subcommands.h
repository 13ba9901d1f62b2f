// The table of `pneuma`'s subcommands: their names, flags and help, and what each of them does.
#pragma once

#include <functional>

#include <CLI/CLI.hpp>

#include "base/status.h"
#include "command/commands.h"

namespace pneuma::client {

/// What the command line asks for: one of the two.
struct Task {
  std::function<base::Status(Session&)> with_server;
  std::function<base::Status(FileSession&)> alone;
};

/// Parsing `app` then sets `task`.
void add_subcommands(CLI::App& app, Task& task);

// The larger ones, each in a file with others of its kind.
void add_watch(CLI::App& app, Task& task);
void add_wait(CLI::App& app, Task& task);
void add_record(CLI::App& app, Task& task);
void add_play(CLI::App& app, Task& task);
void add_seek(CLI::App& app, Task& task);
void add_export(CLI::App& app, Task& task);
void add_impulse(CLI::App& app, Task& task);
void add_grab(CLI::App& app, Task& task);

}  // namespace pneuma::client
