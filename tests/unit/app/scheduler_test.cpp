// Shows the pool's promises: a task runs on one thread at a time, not before its time, rests until it is woken, is not
// lost where it is woken while it runs, and is not held up by slices that go on and on. Tests wait for what happens,
// never for a time. In which order tasks go, share_queue_test.cpp shows.
#include "app/scheduler.h"

#include <atomic>
#include <future>
#include <latch>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::app {
namespace {

using std::chrono::milliseconds;

constexpr std::chrono::seconds patience{60};

TEST(Scheduler, ATaskAtRestRunsWhenItIsWoken) {
  std::promise<void> ran;
  Scheduler scheduler(1);
  const auto task = scheduler.add([&](const auto&) -> Scheduler::Next {
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
  task = scheduler.add([&](const auto&) -> Scheduler::Next {
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
  const auto rests_on = scheduler.add([&](const auto&) {
    if (++rests == 2) rested.set_value();
    return Scheduler::Next::when_woken(in_an_hour);
  });
  const auto waits_on = scheduler.add([&](const auto&) {
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
  another.wake(another.add([&](const auto&) {
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
    scheduler.wake(scheduler.add([&](const auto&) -> Scheduler::Next {
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

TEST(Scheduler, ASliceIsToldOfWhoIsDue) {
  std::promise<void> told;
  Scheduler scheduler(1);
  const auto light = scheduler.add([](const auto&) { return Scheduler::Next::when_woken(); });
  scheduler.wake(scheduler.add([&](const Scheduler::Turn& turn) {
    EXPECT_FALSE(turn.other_due(Scheduler::Clock::now()));
    // Where the machine stops this slice for long, a spare thread has run the other one.
    const auto deadline = Scheduler::Clock::now() + patience;
    bool is_told = false;
    while (!is_told && Scheduler::Clock::now() < deadline) {
      scheduler.wake(light);
      is_told = turn.other_due(Scheduler::Clock::now());
    }
    EXPECT_TRUE(is_told);
    told.set_value();
    return Scheduler::Next::when_woken();
  }));
  EXPECT_EQ(told.get_future().wait_for(patience), std::future_status::ready);
}

// The one that all wait for would never end if only as many ran at once as there are threads.
TEST(Scheduler, SlicesWithoutAnEndHoldUpNobodyElse) {
  std::promise<void> light_ran;
  const std::shared_future<void> light_has_run = light_ran.get_future().share();
  std::latch stuck(3);
  Scheduler scheduler(2);
  for (int i = 0; i < 3; ++i) {
    scheduler.wake(scheduler.add([&](const auto&) {
      stuck.count_down();
      EXPECT_EQ(light_has_run.wait_for(patience), std::future_status::ready);
      return Scheduler::Next::when_woken();
    }));
  }
  stuck.wait();
  scheduler.wake(scheduler.add([&](const auto&) {
    light_ran.set_value();
    return Scheduler::Next::when_woken();
  }));
  EXPECT_EQ(light_has_run.wait_for(patience), std::future_status::ready);
}

// Each was brief until now, so each gets a thread.
TEST(Scheduler, ManySlicesWithoutAnEndAtOnceHoldUpNobodyElse) {
  constexpr int many = 30;
  std::promise<void> light_ran;
  const std::shared_future<void> light_has_run = light_ran.get_future().share();
  std::latch brief(many);
  Scheduler scheduler(1);
  std::vector<std::shared_ptr<Scheduler::Task>> tasks;
  for (int i = 0; i < many; ++i) {
    tasks.push_back(scheduler.add([&, was_brief = false](const auto&) mutable {
      if (!std::exchange(was_brief, true)) {
        brief.count_down();
      } else {
        EXPECT_EQ(light_has_run.wait_for(patience), std::future_status::ready);
      }
      return Scheduler::Next::when_woken();
    }));
    scheduler.wake(tasks.back());
  }
  brief.wait();
  for (const auto& task : tasks) scheduler.wake(task);
  scheduler.wake(scheduler.add([&](const auto&) {
    light_ran.set_value();
    return Scheduler::Next::when_woken();
  }));
  EXPECT_EQ(light_has_run.wait_for(patience), std::future_status::ready);
}

TEST(Scheduler, SlicesWithoutAnEndHoldUpLongOnesForAWhileOnly) {
  std::promise<void> known_as_long;
  std::promise<void> long_ran;
  const std::shared_future<void> long_has_run = long_ran.get_future().share();
  std::promise<void> endless_began;
  Scheduler scheduler(1);
  const auto lengthy = scheduler.add([&, is_known = false](const Scheduler::Turn& turn) mutable {
    if (std::exchange(is_known, true)) {
      long_ran.set_value();
    } else {
      while (turn.used() <= ShareQueue::brief_max) {
      }
      known_as_long.set_value();
    }
    return Scheduler::Next::when_woken();
  });
  scheduler.wake(lengthy);
  known_as_long.get_future().wait();
  scheduler.wake(scheduler.add([&](const auto&) {
    endless_began.set_value();
    long_has_run.wait_for(patience);
    return Scheduler::Next::when_woken();
  }));
  endless_began.get_future().wait();
  scheduler.wake(lengthy);
  EXPECT_EQ(long_has_run.wait_for(patience / 2), std::future_status::ready);
}

// No thread is called at once for what a short slice will leave time for; this one was short until now.
TEST(Scheduler, ASliceThatIsLongForTheFirstTimeHoldsUpNobodyElse) {
  std::promise<void> light_ran;
  const std::shared_future<void> light_has_run = light_ran.get_future().share();
  Scheduler scheduler(2);
  const auto due = Scheduler::Clock::now() + milliseconds(20);
  scheduler.wake(scheduler.add([&, has_been_short = false](const auto&) mutable {
    if (!std::exchange(has_been_short, true)) return Scheduler::Next::at(due);
    light_has_run.wait();
    return Scheduler::Next::when_woken();
  }));
  scheduler.wake(scheduler.add([&, has_waited = false](const auto&) mutable {
    if (!std::exchange(has_waited, true)) return Scheduler::Next::at(due + 2 * Scheduler::slack);
    light_ran.set_value();
    return Scheduler::Next::when_woken();
  }));
  EXPECT_EQ(light_has_run.wait_for(patience), std::future_status::ready);
}

TEST(Scheduler, NobodyRunsBeforeItsTime) {
  std::promise<Scheduler::TimePoint> ran;
  Scheduler scheduler(2);
  const auto due = Scheduler::Clock::now() + milliseconds(20);
  scheduler.wake(scheduler.add([&, has_waited = false](const auto&) mutable {
    if (!std::exchange(has_waited, true)) return Scheduler::Next::at(due);
    ran.set_value(Scheduler::Clock::now());
    return Scheduler::Next::when_woken();
  }));
  auto when = ran.get_future();
  ASSERT_EQ(when.wait_for(patience), std::future_status::ready);
  EXPECT_GE(when.get(), due);
}

TEST(Scheduler, StopEndsWhileTasksWait) {
  Scheduler scheduler(2);
  const auto task =
      scheduler.add([](const auto&) { return Scheduler::Next::at(Scheduler::Clock::now() + std::chrono::hours(1)); });
  scheduler.wake(task);
  scheduler.stop();
  SUCCEED();
}

}  // namespace
}  // namespace pneuma::app
