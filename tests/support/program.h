// A program run by a test: bounded in time, its output captured, killed when the test is done with it.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "base/status.h"

namespace pneuma::support {

/// The folder of the programs that the build has made.
[[nodiscard]] std::string program_path(const std::string& name);

/// What a child has as its standard error: a file that is kept, or a pipe that is full and that nobody reads.
enum class ErrorOutput { kept, full };

/// A running child. Its standard error, and its output past the lines taken, are kept. It dies with this object, and
/// with the thread that started it.
class Program {
 public:
  /// `path` as program_path gives it; `input` becomes its standard input.
  [[nodiscard]] static base::Result<Program> start(const std::string& path, const std::vector<std::string>& arguments,
                                                   const std::string& input = {},
                                                   ErrorOutput error_output = ErrorOutput::kept);
  Program(Program&& other) noexcept;
  Program& operator=(Program&& other) noexcept;
  ~Program();

  /// The next line of standard output, without its newline; an error when the program ends or `timeout` passes before
  /// it.
  [[nodiscard]] base::Result<std::string> next_line(std::chrono::milliseconds timeout);
  /// Waits for the end. The exit status, or 128 + the signal that ended it; an error when it still runs after
  /// `timeout`.
  [[nodiscard]] base::Result<int> wait(std::chrono::milliseconds timeout);
  [[nodiscard]] bool is_running();
  void send_signal(int number);
  void close_output();  // as a reader that goes away

  [[nodiscard]] pid_t pid() const { return pid_; }
  /// All of standard output that next_line has not taken; complete once wait() has succeeded.
  [[nodiscard]] std::string output();
  [[nodiscard]] std::string error_output() const;

 private:
  Program() = default;
  void take_output(std::chrono::milliseconds timeout);
  void finish() noexcept;

  pid_t pid_ = -1;
  int pidfd_ = -1;
  int output_ = -1;  // our end of its standard output
  int error_ = -1;   // of its standard error: a memory file, or our end of the pipe
  std::string output_text_;
  std::optional<int> exit_status_;
};

struct Finished {
  int exit_status = 0;
  std::string output;
  std::string error_output;
};

/// Runs a program to its end. An exit status of -1 with the reason in error_output where it did not end in time (it is
/// killed).
[[nodiscard]] Finished run_program(const std::string& name, const std::vector<std::string>& arguments,
                                   const std::string& input = {},
                                   std::chrono::milliseconds timeout = std::chrono::seconds(60));

}  // namespace pneuma::support
