// Shows that a world keeps its own time: on time it keeps the due times exactly, a stall it makes good, and what
// is too much for it it lets slip. Times are made up.
#include "app/world_clock.h"

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const WorldClock::TimePoint clock_start = WorldClock::TimePoint() + std::chrono::hours(1);

TEST(WorldClock, OnTimeTheDueTimesDoNotDrift) {
  WorldClock clock;
  clock.start(clock_start);
  for (int tick = 0; tick < 1000; ++tick) {
    EXPECT_EQ(clock.due(), clock_start + tick * milliseconds(16));
    EXPECT_EQ(clock.tick_ended(clock.due() + milliseconds(5), milliseconds(16)), WorldClock::Duration::zero());
  }
}

TEST(WorldClock, AStallIsMadeGood) {
  WorldClock clock;
  clock.start(clock_start);
  EXPECT_EQ(clock.tick_ended(clock_start + milliseconds(116), milliseconds(16)), WorldClock::Duration::zero());
  EXPECT_EQ(clock.due(), clock_start + milliseconds(16));
}

TEST(WorldClock, LaterItSlipsByWhatItIsLate) {
  WorldClock clock;
  clock.start(clock_start);
  EXPECT_EQ(clock.tick_ended(clock_start + milliseconds(300), milliseconds(16)), milliseconds(284));
  EXPECT_EQ(clock.due(), clock_start + milliseconds(300));
}

TEST(WorldClock, ASlowWorldMayBeLateByItsPeriod) {
  WorldClock clock;
  clock.start(clock_start);
  EXPECT_EQ(clock.tick_ended(clock_start + milliseconds(1900), seconds(1)), WorldClock::Duration::zero());
  EXPECT_EQ(clock.due(), clock_start + seconds(1));
}

TEST(WorldClock, AWorldTwiceTooHeavySlipsHalfTheTimeAndDoesNotSpiral) {
  WorldClock clock;
  clock.start(clock_start);
  auto now = clock_start;
  WorldClock::Duration slipped{};
  int ticks = 0;
  while (now < clock_start + seconds(10)) {
    now = std::max(now, clock.due()) + milliseconds(20);  // each tick takes 20 ms of a 10 ms period
    slipped += clock.tick_ended(now, milliseconds(10));
    ++ticks;
  }
  EXPECT_EQ(ticks, 500);
  EXPECT_NEAR(std::chrono::duration<double>(slipped).count(), 5.0, 0.15);  // the last catch_up_max is owed
  EXPECT_LE(now - clock.due(), WorldClock::catch_up_max);
}

}  // namespace
}  // namespace pneuma::app
