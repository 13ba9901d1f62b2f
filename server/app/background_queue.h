// One thread that does in order what must not delay a tick or the network: building worlds, writing checkpoints,
// parsing large messages.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <limits>
#include <mutex>
#include <thread>

namespace pneuma::app {

class BackgroundQueue {
 public:
  /// What takes the processor for long runs at a low priority: worlds and the network go first.
  enum class Priority { normal, low };
  explicit BackgroundQueue(Priority priority = Priority::normal) : thread_([this, priority] { run(priority); }) {}
  ~BackgroundQueue() { finish(); }
  BackgroundQueue(const BackgroundQueue&) = delete;
  BackgroundQueue& operator=(const BackgroundQueue&) = delete;

  void post(std::function<void()> job);
  /// What may wait, in all.
  struct Room {
    std::size_t jobs_max = std::numeric_limits<std::size_t>::max();
    std::size_t bytes_max = std::numeric_limits<std::size_t>::max();
  };
  /// False, and the job is not taken, where the queue is finishing, or the job would have no room among those that
  /// wait. `bytes` is what it holds.
  [[nodiscard]] bool try_post(std::function<void()> job, std::size_t bytes, const Room& room);
  /// Returns when what is queued now is done.
  void flush();
  /// Does what is queued and ends; jobs posted later are dropped.
  void finish();

 private:
  struct Job {
    std::function<void()> work;
    std::size_t bytes = 0;
  };
  void run(Priority priority);
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  std::size_t bytes_ = 0;  // of the jobs that wait
  bool finishing_ = false;
  std::thread thread_;  // last: it starts when the rest is there
};

}  // namespace pneuma::app
