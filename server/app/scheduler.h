// A pool of threads that tasks share. A task runs in slices, on one thread at a time.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

#include "app/share_queue.h"

namespace pneuma::app {

/// Tasks that are due go in the order of what they have had (app/share_queue.h), on so many threads. A slice that goes
/// on for long does not hold up tasks whose slices are brief: spare threads run them beside it, as many at a time.
/// After a second it holds up nobody.
class Scheduler {
 public:
  using Clock = std::chrono::steady_clock;
  using TimePoint = Clock::time_point;
  class Task;

  /// How much later than a task is due its thread may wake, so that it finds more of them. A task that is woken does
  /// not wait for others.
  static constexpr Clock::duration slack = std::chrono::microseconds(200);

  /// When a task wants to run next: at a time, or when it is woken, or at whichever comes first.
  struct Next {
    std::optional<TimePoint> due;
    bool rests = false;  // until it is woken
    static Next at(TimePoint time) { return {time, false}; }
    static Next when_woken(std::optional<TimePoint> at_latest = std::nullopt) { return {at_latest, true}; }
  };
  /// A slice under way, as its task sees it.
  class Turn {
   public:
    /// A task waits that was due by `now` and has had no more than this one: this one should give up its thread.
    [[nodiscard]] bool other_due(TimePoint now) const;
    /// The processor time that the slice has taken so far.
    [[nodiscard]] Clock::duration used() const;

   private:
    friend class Scheduler;
    Turn(Scheduler& scheduler, const Task& task, std::chrono::nanoseconds began)
        : scheduler_(scheduler), task_(task), began_(began) {}

    Scheduler& scheduler_;
    const Task& task_;
    std::chrono::nanoseconds began_;
  };
  /// Runs a part of the task.
  using Slice = std::function<Next(const Turn& turn)>;

  explicit Scheduler(std::size_t threads);
  ~Scheduler();
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;

  /// A task at rest.
  [[nodiscard]] std::shared_ptr<Task> add(Slice slice);
  /// A resting task becomes due now; one under way runs once more where it would rest; one that waits for its time
  /// keeps it.
  void wake(const std::shared_ptr<Task>& task);

  /// Begins no more slices; returns when those under way have ended. Tasks keep their state.
  void stop();

 private:
  using Lock = std::unique_lock<std::mutex>;

  // Whom to call when the mutex is free again: it would meet it locked.
  enum class Called : std::uint8_t { nobody, watcher, waiter };

  void work();
  void run_slice(Lock& lock, TimePoint now, std::chrono::nanoseconds& spent);
  void watch(Lock& lock, std::optional<TimePoint> turn_at);
  /// `patience`: for how long this thread may be busy before another has to look at the time.
  [[nodiscard]] Called see_to_next_turn(Clock::duration patience);
  void call(Called whom);
  void enqueue(const std::shared_ptr<Task>& task, TimePoint due, bool rests);
  [[nodiscard]] std::optional<TimePoint> next_turn(TimePoint now);
  [[nodiscard]] bool is_free(TimePoint now) const;

  const std::size_t slices_max_;  // at once, but for those that go on for long
  const std::size_t threads_max_;
  std::mutex mutex_;
  // Of the threads without a slice one or two watch the time; the others wait until they are called.
  std::condition_variable watch_changed_, called_;
  std::multiset<TimePoint> watched_;  // until when each of them sleeps at most
  std::size_t waiting_ = 0;           // until they are called
  bool stopping_ = false;
  ShareQueue queue_;
  std::deque<TimePoint> began_;  // the slices under way, the last one first
  std::vector<std::thread> threads_;
};

}  // namespace pneuma::app
