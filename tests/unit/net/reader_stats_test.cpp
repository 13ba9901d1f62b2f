// Shows the sums that readers' stats rest on: bytes of the last second as it goes by, and waits under their bounds.
#include "net/reader_stats.h"

#include <numeric>

#include <gtest/gtest.h>

namespace pneuma::net {
namespace {

using namespace std::chrono_literals;

// A whole second since the clock's start, so that parts of a second begin with it.
constexpr TimePoint start{100s};

TEST(DrainMeter, CountsTheLastSecondAlone) {
  DrainMeter meter;
  EXPECT_EQ(meter.bytes_s(start), 0.0);
  meter.add(start, 1000);
  meter.add(start + 950ms, 200);
  EXPECT_EQ(meter.bytes_s(start + 950ms), 1200.0);
  EXPECT_EQ(meter.bytes_s(start + 1000ms), 200.0) << "the first has gone by";
  EXPECT_EQ(meter.bytes_s(start + 1899ms), 200.0);
  EXPECT_EQ(meter.bytes_s(start + 2s), 0.0);
}

TEST(DrainMeter, AnySteadyRateIsTold) {
  for (const auto step : {7ms, 33ms, 100ms}) {
    DrainMeter meter;
    TimePoint now = start;
    for (; now < start + 5s; now += step) meter.add(now, 100);
    const double exact = 100.0 / std::chrono::duration<double>(step).count();
    EXPECT_NEAR(meter.bytes_s(now - step), exact, 0.11 * exact);
  }
}

TEST(DrainMeter, APauseOfAnyLengthLeavesNothing) {
  DrainMeter meter;
  for (const auto pause : {1s, 2s, 1000s, 123'456s}) {
    meter.add(start + pause, 10);
    EXPECT_EQ(meter.bytes_s(start + pause), 10.0);
  }
}

TEST(QueueAges, EachWaitIsUnderItsBound) {
  QueueAges ages;
  ages.add(100us);  // a bound belongs to what is below it
  ages.add(101us);
  ages.add(1h);
  EXPECT_EQ(ages.counts.front(), 1U);
  EXPECT_EQ(ages.counts[1], 1U);
  EXPECT_EQ(ages.counts.back(), 1U);
  EXPECT_EQ(std::accumulate(ages.counts.begin(), ages.counts.end(), std::uint64_t{0}), 3U);
  EXPECT_NEAR(ages.sum_s, 3600.000201, 1e-9);
}

}  // namespace
}  // namespace pneuma::net
