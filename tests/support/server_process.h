// A real pneuma-server on free loopback ports, for the tests that need one.
#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "base/status.h"
#include "support/program.h"

namespace pneuma::support {

/// Whether a server with a data directory is waited for until all of its kept worlds are up.
enum class KeptWorlds { awaited, on_their_way };

/// A running pneuma-server; killed with this object. It gives slow clients ten minutes, and all of them as many
/// commands as they like, unless told otherwise.
class ServerProcess {
 public:
  /// Starts `pneuma-server --listen 127.0.0.1:0 --http 127.0.0.1:0 arguments...` (a --listen or --http among the
  /// arguments counts instead) and waits for its ready line. On an error, `where` is what it wrote on standard error.
  [[nodiscard]] static base::Result<ServerProcess> start(const std::vector<std::string>& arguments = {},
                                                         std::chrono::milliseconds timeout = std::chrono::seconds(60),
                                                         ErrorOutput error_output = ErrorOutput::kept,
                                                         KeptWorlds kept_worlds = KeptWorlds::awaited);
  /// The line that says so; an error when it does not come in time.
  [[nodiscard]] base::Result<std::string> await_kept_worlds(std::chrono::milliseconds timeout) {
    return program_.next_line(timeout);
  }

  [[nodiscard]] const std::string& tcp_address() const { return tcp_address_; }    // HOST:PORT
  [[nodiscard]] const std::string& http_address() const { return http_address_; }  // HOST:PORT, or "off"
  [[nodiscard]] pid_t pid() const { return program_.pid(); }
  [[nodiscard]] bool is_running() { return program_.is_running(); }

  /// SIGTERM, and its exit status (128 + signal where one ended it); an error when it still runs after `timeout`.
  [[nodiscard]] base::Result<int> stop(std::chrono::milliseconds timeout = std::chrono::seconds(60));
  /// SIGKILL, as a crash would.
  void kill();
  /// Waits for an end that something else brings about.
  [[nodiscard]] base::Result<int> wait(std::chrono::milliseconds timeout) { return program_.wait(timeout); }
  void send_signal(int number) { program_.send_signal(number); }
  /// What it has written on standard error (its log) so far.
  [[nodiscard]] std::string error_output() const { return program_.error_output(); }

 private:
  explicit ServerProcess(Program program) : program_(std::move(program)) {}

  Program program_;
  std::string tcp_address_;
  std::string http_address_;
};

}  // namespace pneuma::support
