// Shows what a budget of processor time promises: no more than its share in the long run, a short burst at once, no
// endless wait after one large bill, and one bill for all the worlds of a client.
#include "app/step_budget.h"

#include <memory>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using TimePoint = TimeBudget::TimePoint;
using std::chrono::milliseconds;

constexpr TimePoint start{std::chrono::hours(1)};

double seconds_of(TimeBudget::Duration duration) {
  return std::chrono::duration<double>(duration).count();
}

TEST(TimeBudget, GivesItsShareInTheLongRun) {
  for (const double processors : {0.05, 0.5, 1.0, 2.5}) {
    TimeBudget budget(processors);
    TimePoint now = start;
    double used_s = 0.0;
    while (now < start + std::chrono::seconds(60)) {
      EXPECT_EQ(budget.ready_at(now), now);
      budget.spend(now, milliseconds(7));
      used_s += 7e-3;
      now = budget.ready_at(now);
    }
    EXPECT_NEAR(used_s / seconds_of(now - start), processors, 0.01 * processors);
  }
}

TEST(TimeBudget, LeavesWhoKeepsWithinItAlone) {
  TimeBudget budget(0.5);
  for (TimePoint now = start; now < start + std::chrono::seconds(10); now += milliseconds(16)) {
    EXPECT_EQ(budget.ready_at(now), now);
    budget.spend(now, milliseconds(7));
  }
  EXPECT_TRUE(budget.is_full(start + std::chrono::seconds(20)));
}

TEST(TimeBudget, OneLargeBillIsWaitedForButNotForEver) {
  TimeBudget budget(0.1);
  EXPECT_TRUE(budget.is_full(start));
  budget.spend(start, milliseconds(225));
  EXPECT_FALSE(budget.is_full(start));
  EXPECT_NEAR(seconds_of(budget.ready_at(start) - start), 2.0, 1e-6);
  budget.spend(start, std::chrono::hours(1));
  EXPECT_NEAR(seconds_of(budget.ready_at(start) - start), TimeBudget::wait_max_s, 1e-6);
}

TEST(TimeBudget, WithoutALimitIsAlwaysReady) {
  TimeBudget budget(TimeBudget::unlimited);
  budget.spend(start, std::chrono::hours(1));
  EXPECT_EQ(budget.ready_at(start), start);
  EXPECT_TRUE(budget.is_full(start));
}

TEST(StepBudget, AClientsWorldsShareOneBill) {
  const auto client = std::make_shared<TimeBudget>(0.5);
  StepBudget first(1.0, client);
  StepBudget second(1.0, client);
  StepBudget anothers(1.0);
  first.spend(start, milliseconds(325));
  EXPECT_NEAR(seconds_of(second.ready_at(start) - start), 0.4, 1e-6);
  EXPECT_EQ(second.describe(start), "all worlds of whoever made it may take 0.5 processor seconds a second");
  EXPECT_EQ(anothers.ready_at(start), start);
  anothers.spend(start, milliseconds(350));
  EXPECT_NEAR(seconds_of(anothers.ready_at(start) - start), 0.1, 1e-6);
  EXPECT_EQ(anothers.describe(start), "it may take 1 processor seconds a second");
}

}  // namespace
}  // namespace pneuma::app
