// A progress bar with the time left on a terminal; a line a part elsewhere. On standard error.
#pragma once

#include <chrono>
#include <string>

namespace pneuma::report {

class Progress {
 public:
  /// `expected_s`: what all parts are thought to take.
  explicit Progress(double expected_s);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void begin(const std::string& title, double expected_s);
  /// `share` of the part under way is done, from 0 to 1.
  void advance(double share);
  void end();

 private:
  void draw();

  using Clock = std::chrono::steady_clock;
  bool terminal_;
  double expected_s_;
  double done_s_ = 0.0;  // of what was expected, by the parts that ended
  double part_s_ = 0.0;
  double share_ = 0.0;
  std::string title_;
  Clock::time_point begun_ = Clock::now();
  Clock::time_point part_begun_ = begun_;
  Clock::time_point drawn_{};
};

}  // namespace pneuma::report
