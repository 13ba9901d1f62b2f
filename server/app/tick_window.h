// What the ticks of the last seconds took, and at any rate the last one. Pure; the time is passed in.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>

namespace pneuma::app {

struct TickSample {
  double step_ms = 0.0;
  double encode_ms = 0.0;
  double due_error_ms = 0.0;  // the tick's end after its due time
  double period_s = 0.0;      // from its due time to the next tick's
  double slipped_s = 0.0;
};

struct TickSummary {
  double time_ratio = 1.0;  // periods over real time; 1 where nothing slipped
  double step_ms_median = 0.0;
  double step_ms_max = 0.0;
  double encode_ms_median = 0.0;
  double due_error_ms_p99 = 0.0;  // over the whole window, the others over its last second
};

class TickWindow {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::seconds length{5};

  void add(TimePoint now, const TickSample& sample);
  [[nodiscard]] TickSummary summary(TimePoint now) const;

 private:
  struct Entry {
    TimePoint at;
    TickSample sample;
  };
  std::deque<Entry> entries_;
};

}  // namespace pneuma::app
