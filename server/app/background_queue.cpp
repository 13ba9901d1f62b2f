#include "app/background_queue.h"

#include <exception>
#include <future>
#include <limits>
#include <utility>

#include <spdlog/spdlog.h>

namespace pneuma::app {

void BackgroundQueue::post(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    if (finishing_) return;
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
}

bool BackgroundQueue::try_post(std::function<void()> job, std::size_t waiting_max) {
  {
    const std::lock_guard lock(mutex_);
    if (finishing_ || jobs_.size() >= waiting_max) return false;
    jobs_.push_back(std::move(job));
  }
  changed_.notify_one();
  return true;
}

void BackgroundQueue::flush() {
  std::promise<void> reached;
  if (try_post([&] { reached.set_value(); }, std::numeric_limits<std::size_t>::max())) reached.get_future().wait();
}

void BackgroundQueue::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void BackgroundQueue::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return finishing_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    const std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    try {
      job();
    } catch (const std::exception& error) {
      spdlog::error("a background job threw: {}", error.what());
    }
    lock.lock();
  }
}

}  // namespace pneuma::app
