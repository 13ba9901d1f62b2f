// When a world's next tick is due. Pure; the time is passed in.
#pragma once

#include <algorithm>
#include <chrono>

namespace pneuma::app {

class WorldClock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// The next tick is due at `now`: the world begins, or goes on after a pause.
  void start(TimePoint now) { due_ = now; }

  [[nodiscard]] TimePoint due() const { return due_; }

  /// Simulated over real time. Below, a world of 1 Hz would seem not to tick at all (/healthz); above, it would have to
  /// be quicker than its rate, by which streams and their readers are measured.
  static constexpr double time_scale_min = 0.125;
  static constexpr double time_scale_max = 1.0;

  /// A stall of the machine that a world makes good, so that its due times stay; longer ones would show as a jump.
  static constexpr Duration catch_up_max = std::chrono::milliseconds(100);

  /// The due tick has ended at `now`; the next is due a period later. A world that is then late by more than
  /// catch_up_max, and a period, slips: it goes on from `now` as if it had been on time. Returns the time slipped, or
  /// 0.
  [[nodiscard]] Duration tick_ended(TimePoint now, Duration period) {
    due_ += period;
    if (now <= due_ + std::max(period, catch_up_max)) return Duration::zero();
    const Duration slipped = now - due_;
    due_ = now;
    return slipped;
  }

 private:
  TimePoint due_{};
};

}  // namespace pneuma::app
