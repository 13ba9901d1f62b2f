// One thread that does in order what must not delay a tick or the network: building worlds, writing checkpoints.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace pneuma::app {

class BackgroundQueue {
 public:
  BackgroundQueue() : thread_([this] { work(); }) {}
  ~BackgroundQueue() { finish(); }
  BackgroundQueue(const BackgroundQueue&) = delete;
  BackgroundQueue& operator=(const BackgroundQueue&) = delete;

  void post(std::function<void()> job);
  /// False, and the job is not taken, where `waiting_max` jobs wait already.
  [[nodiscard]] bool try_post(std::function<void()> job, std::size_t waiting_max);
  /// Returns when what is queued now is done.
  void flush();
  /// Does what is queued and ends; jobs posted later are dropped.
  void finish();

 private:
  void work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  bool finishing_ = false;
  std::thread thread_;  // last: it starts when the rest is there
};

}  // namespace pneuma::app
