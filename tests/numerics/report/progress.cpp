#include "numerics/report/progress.h"

#include <algorithm>
#include <cstdio>

#include <unistd.h>

namespace pneuma::report {
namespace {

double since_s(std::chrono::steady_clock::time_point begun) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

}  // namespace

Progress::Progress(double expected_s) : terminal_(isatty(STDERR_FILENO) != 0), expected_s_(expected_s) {}

Progress::~Progress() {
  if (terminal_) std::fputs("\r\033[K", stderr);
}

void Progress::begin(const std::string& title, double expected_s) {
  title_ = title;
  part_s_ = expected_s;
  share_ = 0.0;
  part_begun_ = Clock::now();
  drawn_ = {};
  draw();
}

void Progress::advance(double share) {
  share_ = std::clamp(share, share_, 1.0);
  draw();
}

void Progress::end() {
  done_s_ += part_s_;
  share_ = 0.0;
  part_s_ = 0.0;
  if (terminal_) std::fputs("\r\033[K", stderr);
  std::fprintf(stderr, "%-40s %6.1f s\n", title_.c_str(), since_s(part_begun_));
}

void Progress::draw() {
  if (!terminal_ || (drawn_ != Clock::time_point{} && since_s(drawn_) < 0.1)) return;
  drawn_ = Clock::now();
  constexpr int width = 30;
  const double done = std::clamp((done_s_ + share_ * part_s_) / expected_s_, 0.0, 1.0);
  const int filled = static_cast<int>(done * width);
  // Until enough is done to go by the clock, by what was expected.
  const double elapsed_s = since_s(begun_);
  const double left_s = done > 0.05 ? elapsed_s * (1.0 - done) / done : expected_s_ * (1.0 - done);
  const long left = static_cast<long>(left_s + 0.5);
  std::fprintf(stderr, "\r\033[K[%s%s] %3.0f %%  %ld:%02ld left  %s",
               std::string(static_cast<std::size_t>(filled), '#').c_str(),
               std::string(static_cast<std::size_t>(width - filled), '.').c_str(), 100.0 * done, left / 60, left % 60,
               title_.c_str());
  std::fflush(stderr);
}

}  // namespace pneuma::report
