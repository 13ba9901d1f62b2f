// Shows the pool's promises: a task runs on one thread at a time, in order of due times, rests until it is woken, and
// is not lost where it is woken while it runs. Tests wait for what happens, never for a time.
#include "app/scheduler.h"

#include <atomic>
#include <future>
#include <latch>
#include <thread>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using std::chrono::milliseconds;

constexpr std::chrono::seconds patience{60};

TEST(Scheduler, ATaskAtRestRunsWhenItIsWoken) {
  std::promise<void> ran;
  Scheduler scheduler(1);
  const auto task = scheduler.add([&]() -> Scheduler::Next {
    ran.set_value();
    return Scheduler::Next::when_woken();
  });
  scheduler.wake(task);
  EXPECT_EQ(ran.get_future().wait_for(patience), std::future_status::ready);
}

TEST(Scheduler, WokenWhileItRunsItRunsOnceMore) {
  std::promise<void> second;
  std::atomic<int> runs = 0;
  std::shared_ptr<Scheduler::Task> task;
  Scheduler scheduler(1);
  task = scheduler.add([&]() -> Scheduler::Next {
    if (++runs == 1) {
      scheduler.wake(task);
      scheduler.wake(task);
    } else {
      second.set_value();
    }
    return Scheduler::Next::when_woken();
  });
  scheduler.wake(task);
  EXPECT_EQ(second.get_future().wait_for(patience), std::future_status::ready);
  scheduler.stop();
  EXPECT_EQ(runs, 2);
}

TEST(Scheduler, ARestThatEndsOfItselfIsEndedByAWakeTooAndATimeIsNot) {
  std::promise<void> rested;
  std::atomic<int> rests = 0;
  std::atomic<int> waits = 0;
  Scheduler scheduler(1);
  const auto in_an_hour = Scheduler::Clock::now() + std::chrono::hours(1);
  const auto rests_on = scheduler.add([&] {
    if (++rests == 2) rested.set_value();
    return Scheduler::Next::when_woken(in_an_hour);
  });
  const auto waits_on = scheduler.add([&] {
    ++waits;
    return Scheduler::Next::at(in_an_hour);
  });
  scheduler.wake(waits_on);
  scheduler.wake(rests_on);
  while (rests == 0) std::this_thread::yield();
  scheduler.wake(waits_on);
  scheduler.wake(rests_on);
  EXPECT_EQ(rested.get_future().wait_for(patience), std::future_status::ready);
  scheduler.stop();
  EXPECT_EQ(waits, 1);

  std::promise<void> ended;
  std::atomic<int> runs = 0;
  Scheduler another(1);
  another.wake(another.add([&] {
    if (++runs == 2) ended.set_value();
    return Scheduler::Next::when_woken(Scheduler::Clock::now());
  }));
  EXPECT_EQ(ended.get_future().wait_for(patience), std::future_status::ready);
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
    scheduler.wake(scheduler.add([&]() -> Scheduler::Next {
      if (++counter.inside != 1) overlapped = true;
      ++counter.runs;
      --counter.inside;
      if (counter.runs < runs_wanted) return Scheduler::Next::at(Scheduler::Clock::now());
      done.count_down();
      return Scheduler::Next::when_woken();
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
  const auto light = scheduler.add([&]() -> Scheduler::Next {
    light_done = true;
    light_ran.set_value();
    return Scheduler::Next::when_woken();
  });
  bool woken = false;
  const auto heavy = scheduler.add([&]() -> Scheduler::Next {
    if (light_done) return Scheduler::Next::when_woken();
    if (woken) ++heavy_slices_after_due;
    if (!woken) {
      scheduler.wake(light);
      woken = true;
      EXPECT_TRUE(scheduler.other_due(Scheduler::Clock::now()));
    }
    return Scheduler::Next::at(Scheduler::Clock::now());
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
  scheduler.wake(scheduler.add([&]() -> Scheduler::Next {
    at = all_woken.get_future().get();
    return Scheduler::Next::when_woken();
  }));
  for (int i = 0; i < 3; ++i) {
    scheduler.wake(scheduler.add([&, i, waited = false]() mutable -> Scheduler::Next {
      if (!waited) {
        waited = true;
        return Scheduler::Next::at(at + milliseconds(10 * (3 - i)));
      }
      order.push_back(i);
      if (order.size() == 3) all.set_value();
      return Scheduler::Next::when_woken();
    }));
  }
  all_woken.set_value(Scheduler::Clock::now());
  ASSERT_EQ(all.get_future().wait_for(patience), std::future_status::ready);
  EXPECT_EQ(order, (std::vector<int>{2, 1, 0}));
}

TEST(Scheduler, StopEndsWhileTasksWait) {
  Scheduler scheduler(2);
  const auto task = scheduler.add(
      []() -> Scheduler::Next { return Scheduler::Next::at(Scheduler::Clock::now() + std::chrono::hours(1)); });
  scheduler.wake(task);
  scheduler.stop();
  SUCCEED();
}

}  // namespace
}  // namespace pneuma::app
