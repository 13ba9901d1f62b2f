#include "support/server_process.h"

#include <algorithm>
#include <csignal>
#include <sstream>
#include <string_view>

namespace pneuma::support {

namespace {

std::string value_of(const std::string& line, std::string_view key) {
  std::istringstream words(line);
  for (std::string word; words >> word;) {
    if (word.starts_with(key)) return word.substr(key.size());
  }
  return {};
}

}  // namespace

base::Result<ServerProcess> ServerProcess::start(const std::vector<std::string>& arguments,
                                                 std::chrono::milliseconds timeout, ErrorOutput error_output,
                                                 KeptWorlds kept_worlds) {
  // On a busy machine anyone may be slow; a test that is about a time-out gives its own, and the last one counts.
  std::vector<std::string> all{"--hello-timeout-ms",           "600000", "--ping-interval-ms",       "600000",
                               "--partial-message-timeout-ms", "600000", "--write-stall-timeout-ms", "600000"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  for (const char* flag : {"--listen", "--http"}) {
    if (std::ranges::find(arguments, flag) != arguments.end()) continue;
    all.insert(all.end(), {flag, "127.0.0.1:0"});
  }
  auto program = Program::start(program_path("pneuma-server"), all, {}, error_output);
  if (!program.ok()) return program.status();
  const auto line = program->next_line(timeout);
  if (!line.ok()) return line.status();

  ServerProcess server(std::move(*program));
  server.tcp_address_ = value_of(*line, "tcp=");
  server.http_address_ = value_of(*line, "http=");
  if (!line->starts_with("ready ") || server.tcp_address_.empty()) {
    return base::Status(base::StatusCode::internal, "not a ready line: " + *line, server.error_output());
  }
  if (kept_worlds == KeptWorlds::awaited && std::ranges::find(arguments, "--data-dir") != arguments.end()) {
    if (const auto up = server.await_kept_worlds(timeout); !up.ok()) return up.status();
  }
  return server;
}

base::Result<int> ServerProcess::stop(std::chrono::milliseconds timeout) {
  program_.send_signal(SIGTERM);
  return program_.wait(timeout);
}

void ServerProcess::kill() {
  program_.send_signal(SIGKILL);
  (void)program_.wait(std::chrono::seconds(10));  // SIGKILL cannot be held off
}

}  // namespace pneuma::support
