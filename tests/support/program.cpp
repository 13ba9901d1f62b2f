#include "support/program.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

extern "C" {
#include <sys/pidfd.h>  // glibc 2.36 declares its functions without language linkage
}

namespace pneuma::support {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

base::Status failed(const std::string& call) {
  return {base::StatusCode::internal, call + ": " + std::strerror(errno)};
}

milliseconds remaining(Clock::time_point deadline) {
  return std::max(std::chrono::duration_cast<milliseconds>(deadline - Clock::now()), milliseconds(0));
}

bool wait_readable(int fd, milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    pollfd entry{.fd = fd, .events = POLLIN, .revents = 0};
    const int count = poll(&entry, 1, static_cast<int>(remaining(deadline).count()));
    if (count >= 0 || errno != EINTR) return count > 0;
  }
}

void close_file(int& fd) {
  if (fd >= 0) close(fd);
  fd = -1;
}

int memory_file(const std::string& content) {
  const int fd = memfd_create("pneuma-test", MFD_CLOEXEC);
  if (fd < 0) return fd;
  for (std::size_t done = 0; done < content.size();) {
    const ssize_t count = write(fd, content.data() + done, content.size() - done);
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  lseek(fd, 0, SEEK_SET);
  return fd;
}

/// The ends of a pipe that has no room for another byte.
std::array<int, 2> full_pipe() {
  std::array<int, 2> ends{-1, -1};
  if (pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) return ends;
  const std::array<char, 4096> bytes{};  // smaller than that is written whole or not at all
  while (write(ends[1], bytes.data(), bytes.size()) > 0) {
  }
  while (write(ends[1], bytes.data(), 1) > 0) {
  }
  fcntl(ends[1], F_SETFL, 0);  // whoever writes there waits
  return ends;
}

}  // namespace

std::string program_path(const std::string& name) {
  return std::string(PNEUMA_PROGRAM_DIR) + "/" + name;
}

base::Result<Program> Program::start(const std::string& path, const std::vector<std::string>& arguments,
                                     const std::string& input, ErrorOutput error_output) {
  std::vector<char*> argv;
  argv.push_back(const_cast<char*>(path.c_str()));
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  Program program;
  int input_fd = memory_file(input);
  int error_fd = -1;  // the child's, where it is not ours too
  if (error_output == ErrorOutput::full) {
    const auto [ours, its] = full_pipe();
    program.error_ = ours;
    error_fd = its;
  } else {
    program.error_ = memory_file({});
  }
  std::array<int, 2> ends{};
  if (input_fd < 0 || program.error_ < 0 || pipe2(ends.data(), O_CLOEXEC) != 0) return failed("pipe");
  program.output_ = ends[0];

  program.pid_ = fork();
  if (program.pid_ == 0) {  // only calls that are safe after fork in a program with threads
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(input_fd, STDIN_FILENO);
    dup2(ends[1], STDOUT_FILENO);
    dup2(error_fd >= 0 ? error_fd : program.error_, STDERR_FILENO);
    execv(path.c_str(), argv.data());
    _exit(127);
  }
  close_file(input_fd);
  close_file(error_fd);
  close_file(ends[1]);
  if (program.pid_ < 0) return failed("fork");
  program.pidfd_ = pidfd_open(program.pid_, 0);
  if (program.pidfd_ < 0) return failed("pidfd_open");
  return program;
}

Program::Program(Program&& other) noexcept {
  *this = std::move(other);
}

Program& Program::operator=(Program&& other) noexcept {
  if (this == &other) return *this;
  finish();
  pid_ = std::exchange(other.pid_, -1);
  pidfd_ = std::exchange(other.pidfd_, -1);
  output_ = std::exchange(other.output_, -1);
  error_ = std::exchange(other.error_, -1);
  output_text_ = std::move(other.output_text_);
  exit_status_ = std::exchange(other.exit_status_, std::nullopt);
  return *this;
}

Program::~Program() {
  finish();
}

void Program::finish() noexcept {
  if (pid_ > 0 && !exit_status_) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  pid_ = -1;
  close_file(pidfd_);
  close_file(output_);
  close_file(error_);
}

void Program::take_output(milliseconds timeout) {
  if (output_ < 0 || !wait_readable(output_, timeout)) return;
  std::array<char, 65536> buffer{};
  const ssize_t count = read(output_, buffer.data(), buffer.size());
  if (count > 0) {
    output_text_.append(buffer.data(), static_cast<std::size_t>(count));
  } else {
    close_file(output_);
  }
}

base::Result<std::string> Program::next_line(milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    const std::size_t end = output_text_.find('\n');
    if (end != std::string::npos) {
      std::string line = output_text_.substr(0, end);
      output_text_.erase(0, end + 1);
      return line;
    }
    if (output_ < 0) return base::Status(base::StatusCode::unavailable, "no further line of output", error_output());
    if (Clock::now() >= deadline) return base::Status(base::StatusCode::unavailable, "no line in time", error_output());
    take_output(remaining(deadline));
  }
}

base::Result<int> Program::wait(milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  // Its output is read meanwhile: a full pipe would keep it from ending.
  while (output_ >= 0 && Clock::now() < deadline) take_output(remaining(deadline));
  if (!exit_status_) {
    if (!wait_readable(pidfd_, remaining(deadline))) {
      return base::Status(base::StatusCode::unavailable, "still running", error_output());
    }
    int status = 0;
    if (waitpid(pid_, &status, 0) != pid_) return failed("waitpid");
    exit_status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return *exit_status_;
}

bool Program::is_running() {
  return pid_ > 0 && !exit_status_ && !wait_readable(pidfd_, milliseconds(0));
}

void Program::send_signal(int number) {
  if (pid_ > 0 && !exit_status_) kill(pid_, number);
}

void Program::close_output() {
  close_file(output_);
}

std::string Program::output() {
  return output_text_;
}

std::string Program::error_output() const {
  std::string text;
  std::array<char, 65536> buffer{};
  ssize_t count = 0;
  while ((count = pread(error_, buffer.data(), buffer.size(), static_cast<off_t>(text.size()))) > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(count));
  }
  return text;
}

Finished run_program(const std::string& name, const std::vector<std::string>& arguments, const std::string& input,
                     milliseconds timeout) {
  auto program = Program::start(program_path(name), arguments, input);
  if (!program.ok()) return {-1, {}, program.status().message()};
  const auto exit_status = program->wait(timeout);
  if (!exit_status.ok()) return {-1, program->output(), exit_status.status().message()};
  return {*exit_status, program->output(), program->error_output()};
}

}  // namespace pneuma::support
