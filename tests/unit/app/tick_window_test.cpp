// Shows medians, maxima and the 99th percentile of made-up ticks, that old ticks leave the window, and the ratio of
// times.
#include "app/tick_window.h"

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using std::chrono::milliseconds;

const TickWindow::TimePoint window_start = TickWindow::TimePoint() + std::chrono::hours(1);

TEST(TickWindow, EmptyIsOnTime) {
  const TickSummary summary = TickWindow().summary(window_start);
  EXPECT_EQ(summary.time_ratio, 1.0);
  EXPECT_EQ(summary.step_ms_median, 0.0);
}

TEST(TickWindow, MedianMaximumAndPercentileOfOneToAHundred) {
  TickWindow window;
  for (int i = 1; i <= 101; ++i) {
    TickSample sample;
    sample.step_ms = i;
    sample.due_error_ms = i;
    sample.encode_ms = 2 * i;
    sample.period_s = 0.01;
    window.add(window_start + milliseconds(i), sample);
  }
  const TickSummary summary = window.summary(window_start + milliseconds(101));
  EXPECT_EQ(summary.step_ms_median, 51.0);
  EXPECT_EQ(summary.step_ms_max, 101.0);
  EXPECT_EQ(summary.encode_ms_median, 102.0);
  EXPECT_EQ(summary.due_error_ms_p99, 100.0);
  EXPECT_EQ(summary.time_ratio, 1.0);
}

TEST(TickWindow, OldTicksLeave) {
  TickWindow window;
  TickSample slow;
  slow.step_ms = 500.0;
  slow.period_s = 0.1;
  slow.slipped_s = 0.4;
  window.add(window_start, slow);
  TickSample quick;
  quick.step_ms = 1.0;
  quick.period_s = 0.1;
  window.add(window_start + milliseconds(2000), quick);
  EXPECT_EQ(window.summary(window_start + milliseconds(2000)).step_ms_max, 1.0);
  EXPECT_EQ(window.summary(window_start + milliseconds(2000)).time_ratio, 1.0);
}

TEST(TickWindow, TheLastTickCountsUntilTheNext) {
  TickWindow window;
  TickSample slow;
  slow.step_ms = 30'000.0;
  slow.period_s = 0.1;
  slow.slipped_s = 29.9;
  slow.due_error_ms = 29'900.0;
  window.add(window_start, slow);
  const TickSummary summary = window.summary(window_start + std::chrono::seconds(20));
  EXPECT_NEAR(summary.time_ratio, 0.1 / 30.0, 1e-12);
  EXPECT_EQ(summary.step_ms_max, 30'000.0);
  EXPECT_EQ(summary.due_error_ms_p99, 29'900.0);
}

TEST(TickWindow, ATickThatSlippedLowersTheRatio) {
  TickWindow window;
  TickSample sample;
  sample.period_s = 0.1;
  sample.slipped_s = 0.1;
  window.add(window_start, sample);
  EXPECT_DOUBLE_EQ(window.summary(window_start).time_ratio, 0.5);
}

}  // namespace
}  // namespace pneuma::app
