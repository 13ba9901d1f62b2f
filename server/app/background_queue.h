// One thread that does what must not delay a tick or the network: building worlds, writing checkpoints, parsing large
// messages. The jobs of one taker are done in order; takers have their turns one after the other, so that nobody waits
// for all that somebody else has asked for.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <set>
#include <string>
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

  /// For `taker`; empty: the server itself.
  void post(std::function<void()> job, const std::string& taker = {});
  /// What may wait, in all. One taker's jobs may hold half of it, unless there is only one.
  struct Room {
    std::size_t jobs_max = std::numeric_limits<std::size_t>::max();
    std::size_t bytes_max = std::numeric_limits<std::size_t>::max();
  };
  /// False, and the job is not taken, where the queue is finishing, or the job would have no room among those that
  /// wait. `bytes` is what it holds.
  [[nodiscard]] bool try_post(std::function<void()> job, std::size_t bytes, const Room& room,
                              const std::string& taker = {});
  /// Returns when what is queued now is done.
  void flush();
  /// Does what is queued and ends; jobs posted later are dropped.
  void finish();

 private:
  struct Job {
    std::function<void()> work;
    std::size_t bytes = 0;
    std::uint64_t number = 0;
  };
  /// What waits of one taker.
  struct Line {
    std::deque<Job> jobs;
    std::size_t bytes = 0;
  };
  [[nodiscard]] bool has_room(const std::string& taker, std::size_t bytes, const Room& room) const;
  [[nodiscard]] Job take();
  void run(Priority priority);
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Line> lines_;  // by taker; none is empty
  std::deque<std::string> turns_;      // whose turn comes next
  std::set<std::uint64_t> unfinished_;
  std::uint64_t last_number_ = 0;
  std::size_t jobs_ = 0;   // that wait
  std::size_t bytes_ = 0;  // of them
  bool finishing_ = false;
  std::thread thread_;  // last: it starts when the rest is there
};

}  // namespace pneuma::app
