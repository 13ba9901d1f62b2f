#include "app/background_queue.h"

#include <algorithm>
#include <exception>
#include <future>
#include <utility>

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

namespace pneuma::app {

namespace {

// A tenth of the processor where others want it too.
constexpr int low_priority_niceness = 10;

}  // namespace

void BackgroundQueue::post(std::function<void()> job) {
  (void)try_post(std::move(job), 0, {});
}

bool BackgroundQueue::try_post(std::function<void()> job, std::size_t bytes, const Room& room) {
  {
    const std::lock_guard lock(mutex_);
    if (finishing_ || jobs_.size() >= room.jobs_max || bytes > room.bytes_max - std::min(bytes_, room.bytes_max)) {
      return false;
    }
    jobs_.push_back({std::move(job), bytes});
    bytes_ += bytes;
  }
  changed_.notify_one();
  return true;
}

void BackgroundQueue::flush() {
  std::promise<void> reached;
  if (try_post([&] { reached.set_value(); }, 0, {})) reached.get_future().wait();
}

void BackgroundQueue::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
}

void BackgroundQueue::run(Priority priority) {
  // On Linux this is of the thread alone. Where it fails, the work goes on at the priority of the rest.
  if (priority == Priority::low) ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), low_priority_niceness);
  work();
}

void BackgroundQueue::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return finishing_ || !jobs_.empty(); });
    if (jobs_.empty()) return;
    Job job = std::move(jobs_.front());
    jobs_.pop_front();
    bytes_ -= job.bytes;
    lock.unlock();
    try {
      job.work();
    } catch (const std::exception& error) {
      spdlog::error("a background job threw: {}", error.what());
    }
    job = {};  // what it held goes before the lock is taken
    lock.lock();
  }
}

}  // namespace pneuma::app
