// The `pneuma` command: flags to a request, a reply to lines. Exit codes: 0 done, 1 the work failed, 2 bad usage.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <unistd.h>

#include "base/version.h"
#include "command/arguments.h"
#include "command/checks.h"
#include "command/commands.h"
#include "command/json.h"
#include "command/output.h"
#include "command/subcommands.h"
#include "command/telling.h"
#include "command/terminal.h"
#include "pneuma_client/client.h"
#include "usage/usage.h"

namespace {

using pneuma::base::Status;
using pneuma::base::StatusCode;
using pneuma::client::address_check;
using pneuma::client::Client;
using pneuma::client::FileSession;
using pneuma::client::Session;
using pneuma::client::Task;

constexpr int exit_done = 0;
constexpr int exit_failed = 1;
constexpr int exit_usage = 2;

struct Flags {
  std::string server = "127.0.0.1:7420";
  std::string token_file;
  pneuma::client::ConnectOptions connect;
  bool json = false;
};

int fail(const Status& status, bool json, int exit_code) {
  using pneuma::client::Style;
  const Style style = pneuma::client::takes_colour(STDERR_FILENO) ? Style::red : Style::plain;
  using pneuma::client::shown;
  const std::string text = json ? shown(pneuma::client::error_json(status))
                                : pneuma::client::styled("pneuma: ", style) + shown(pneuma::client::told(status));
  std::fprintf(stderr, "%s\n", text.c_str());
  return exit_code;
}

/// Of the environment, where --server gives none. What is wrong there stops no --help, and nothing that asks no server.
Status find_server(const CLI::App& app, std::string& server) {
  const char* variable = std::getenv("PNEUMA_SERVER");
  if (variable == nullptr || *variable == '\0' || app.count("--server") > 0) return {};
  server = variable;
  const std::string wrong = address_check()(server);
  return wrong.empty() ? Status() : pneuma::base::invalid(wrong, "PNEUMA_SERVER");
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

/// A world that is not there is told with those that are. `world` is the name that was asked for.
Status suggest_world(const Status& status, const std::string& world, Client& client) {
  if (status.code() != StatusCode::not_found || !status.where().ends_with(".world")) return status;
  const auto list = client.list_worlds();
  if (!list.ok()) return status;
  std::vector<std::string> names;
  for (const auto& one : list->worlds()) names.push_back(one.name());
  return pneuma::client::with_suggestion(status, world, names);
}

Status run_with_server(Flags& flags, const CLI::App& command, const Task& task, pneuma::client::Output& output) {
  auto client = connect(flags);
  if (!client.ok()) return client.status();
  Session session{*client, output, flags.json, flags.server, flags.connect.tls};
  const Status status = task.with_server(session);
  const CLI::Option* world = command.get_option_no_throw("WORLD");
  return world == nullptr || flags.json ? status : suggest_world(status, world->as<std::string>(), *client);
}

Status run_alone(Flags& flags, const Task& task, pneuma::client::Output& output) {
  std::string& token = flags.connect.token;
  if (Status found = find_token(flags, token); !found.ok()) return found;
  FileSession session{output, flags.json, token};
  return task.alone(session);
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader that goes away is seen where it is written to
  Flags flags;
  flags.connect.client_name = "pneuma";
  Task task;
  CLI::App app("The client of pneuma-server.", "pneuma");
  app.set_version_flag("--version", "pneuma " + std::string(pneuma::base::version));
  app.fallthrough();
  app.require_subcommand(0, 1);
  app.add_option("--server", flags.server, "HOST:PORT; otherwise PNEUMA_SERVER's value")
      ->capture_default_str()
      ->check(address_check());
  auto* token =
      app.add_option("--token", flags.connect.token, "What the server asks for; otherwise PNEUMA_TOKEN's value");
  app.add_option("--token-file", flags.token_file, "The token is its first line")->excludes(token);
  app.add_flag("--json", flags.json, "One JSON object a line, for scripts; errors too");
  auto* tls = app.add_flag("--tls", flags.connect.tls, "Speak TLS");
  app.add_option("--ca", flags.connect.ca_file, "Trust these certificates (PEM) instead of the system's")->needs(tls);
  add_subcommands(app, task);
  pneuma::usage::add_generators(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {  // --help, --version
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    const bool json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
    return fail(pneuma::base::invalid(pneuma::usage::usage_error(app, error)), json, exit_usage);
  }
  if (!task.with_server && !task.alone) {
    return fail(pneuma::base::invalid("a subcommand is needed; pneuma --help lists them"), flags.json, exit_usage);
  }
  if (const Status wrong = find_server(app, flags.server); task.with_server && !wrong.ok()) {
    return fail(wrong, flags.json, exit_usage);
  }
  pneuma::client::Output output;
  const Status status = task.alone ? run_alone(flags, task, output)
                                   : run_with_server(flags, *app.get_subcommands().front(), task, output);
  if (status.ok() || output.is_closed()) return exit_done;
  return fail(status, flags.json, exit_failed);
}
