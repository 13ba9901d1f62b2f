// Shows the pool's promises: a task runs on one thread at a time, in order of due times, rests until it is woken, and
// is not lost where it is woken while it runs. Tests wait for what happens, never for a time.
#include "app/scheduler.h"

#include <atomic>
#include <future>
#include <latch>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using std::chrono::milliseconds;

constexpr std::chrono::seconds patience{60};

TEST(Scheduler, ATaskAtRestRunsWhenItIsWoken) {
  std::promise<void> ran;
  Scheduler scheduler(1);
  const auto task = scheduler.add([&]() -> std::optional<Scheduler::TimePoint> {
    ran.set_value();
    return std::nullopt;
  });
  scheduler.wake(task);
  EXPECT_EQ(ran.get_future().wait_for(patience), std::future_status::ready);
}

TEST(Scheduler, WokenWhileItRunsItRunsOnceMore) {
  std::promise<void> second;
  std::atomic<int> runs = 0;
  std::shared_ptr<Scheduler::Task> task;
  Scheduler scheduler(1);
  task = scheduler.add([&]() -> std::optional<Scheduler::TimePoint> {
    if (++runs == 1) {
      scheduler.wake(task);
      scheduler.wake(task);
    } else {
      second.set_value();
    }
    return std::nullopt;
  });
  scheduler.wake(task);
  EXPECT_EQ(second.get_future().wait_for(patience), std::future_status::ready);
  scheduler.stop();
  EXPECT_EQ(runs, 2);
}

TEST(Scheduler, NoTaskRunsOnTwoThreadsAtOnce) {
  constexpr int runs_wanted = 2000;
  std::latch done(4);
  std::atomic<bool> overlapped = false;
  struct Counter {
    std::atomic<int> inside = 0;
    int runs = 0;
  };
  std::vector<Counter> counters(4);
  Scheduler scheduler(3);
  for (Counter& counter : counters) {
    scheduler.wake(scheduler.add([&]() -> std::optional<Scheduler::TimePoint> {
      if (++counter.inside != 1) overlapped = true;
      ++counter.runs;
      --counter.inside;
      if (counter.runs < runs_wanted) return Scheduler::Clock::now();
      done.count_down();
      return std::nullopt;
    }));
  }
  done.wait();
  EXPECT_FALSE(overlapped);
}

// A heavy task comes back as due now; a light one whose time has come goes before its next slice.
TEST(Scheduler, ATaskThatIsDueGoesBeforeOneThatGaveWay) {
  std::promise<void> light_ran;
  std::atomic<bool> light_done = false;
  std::atomic<int> heavy_slices_after_due = 0;
  Scheduler scheduler(1);
  const auto light = scheduler.add([&]() -> std::optional<Scheduler::TimePoint> {
    light_done = true;
    light_ran.set_value();
    return std::nullopt;
  });
  bool woken = false;
  const auto heavy = scheduler.add([&]() -> std::optional<Scheduler::TimePoint> {
    if (light_done) return std::nullopt;
    if (woken) ++heavy_slices_after_due;
    if (!woken) {
      scheduler.wake(light);
      woken = true;
      EXPECT_TRUE(scheduler.other_due(Scheduler::Clock::now()));
    }
    return Scheduler::Clock::now();
  });
  scheduler.wake(heavy);
  ASSERT_EQ(light_ran.get_future().wait_for(patience), std::future_status::ready);
  scheduler.stop();
  EXPECT_EQ(heavy_slices_after_due, 0);
}

TEST(Scheduler, TasksRunInOrderOfTheirTimes) {
  std::promise<void> all;
  std::vector<int> order;
  Scheduler scheduler(1);
  // Holds the only thread until all are woken: their first runs are due before any of the times that they ask for.
  std::promise<Scheduler::TimePoint> all_woken;
  Scheduler::TimePoint at;
  scheduler.wake(scheduler.add([&]() -> std::optional<Scheduler::TimePoint> {
    at = all_woken.get_future().get();
    return std::nullopt;
  }));
  for (int i = 0; i < 3; ++i) {
    scheduler.wake(scheduler.add([&, i, waited = false]() mutable -> std::optional<Scheduler::TimePoint> {
      if (!waited) {
        waited = true;
        return at + milliseconds(10 * (3 - i));
      }
      order.push_back(i);
      if (order.size() == 3) all.set_value();
      return std::nullopt;
    }));
  }
  all_woken.set_value(Scheduler::Clock::now());
  ASSERT_EQ(all.get_future().wait_for(patience), std::future_status::ready);
  EXPECT_EQ(order, (std::vector<int>{2, 1, 0}));
}

TEST(Scheduler, StopEndsWhileTasksWait) {
  Scheduler scheduler(2);
  const auto task = scheduler.add(
      []() -> std::optional<Scheduler::TimePoint> { return Scheduler::Clock::now() + std::chrono::hours(1); });
  scheduler.wake(task);
  scheduler.stop();
  SUCCEED();
}

}  // namespace
}  // namespace pneuma::app
