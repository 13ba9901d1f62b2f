// A pool of threads over tasks ordered by when they are due. A task runs in slices, on one thread at a time.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>
#include <vector>

namespace pneuma::app {

class Scheduler {
 public:
  using Clock = std::chrono::steady_clock;
  using TimePoint = Clock::time_point;
  /// When a task wants to run next: at a time, or when it is woken, or at whichever comes first.
  struct Next {
    std::optional<TimePoint> due;
    bool rests = false;  // until it is woken
    static Next at(TimePoint time) { return {time, false}; }
    static Next when_woken(std::optional<TimePoint> at_latest = std::nullopt) { return {at_latest, true}; }
  };
  /// Runs a part of the task.
  using Slice = std::function<Next()>;
  class Task;

  explicit Scheduler(std::size_t threads);
  ~Scheduler();
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;

  /// A task at rest.
  [[nodiscard]] std::shared_ptr<Task> add(Slice slice);
  /// A resting task becomes due now; one under way runs once more where it would rest; one that waits for its time
  /// keeps it.
  void wake(const std::shared_ptr<Task>& task);
  /// A task waits that was due by `now`: the one under way should give up its thread.
  [[nodiscard]] bool other_due(TimePoint now) const;

  /// Begins no more slices; returns when those under way have ended. Tasks keep their state.
  void stop();

 private:
  void work();
  void enqueue(const std::shared_ptr<Task>& task, TimePoint due, bool rests);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false;
  std::uint64_t sequence_ = 0;
  struct Earlier {
    bool operator()(const std::shared_ptr<Task>& a, const std::shared_ptr<Task>& b) const;
  };
  std::set<std::shared_ptr<Task>, Earlier> waiting_;
  std::vector<std::thread> threads_;
};

}  // namespace pneuma::app
