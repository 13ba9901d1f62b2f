#include "app/background_queue.h"

#include <algorithm>
#include <exception>
#include <utility>

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

namespace pneuma::app {

namespace {

// A tenth of the processor where others want it too.
constexpr int low_priority_niceness = 10;

}  // namespace

void BackgroundQueue::post(std::function<void()> job, const std::string& taker) {
  (void)try_post(std::move(job), 0, {}, taker);
}

bool BackgroundQueue::has_room(const std::string& taker, std::size_t bytes, const Room& room) const {
  if (jobs_ >= room.jobs_max || bytes > room.bytes_max - std::min(bytes_, room.bytes_max)) return false;
  const auto own = lines_.find(taker);
  if (taker.empty() || own == lines_.end()) return true;
  return own->second.jobs.size() < room.jobs_max / 2 && own->second.bytes + bytes <= room.bytes_max / 2;
}

bool BackgroundQueue::try_post(std::function<void()> job, std::size_t bytes, const Room& room,
                               const std::string& taker) {
  {
    const std::lock_guard lock(mutex_);
    if (finishing_ || !has_room(taker, bytes, room)) return false;
    Line& line = lines_[taker];
    if (line.jobs.empty()) turns_.push_back(taker);
    line.jobs.push_back({std::move(job), bytes, ++last_number_});
    line.bytes += bytes;
    unfinished_.insert(last_number_);
    ++jobs_;
    bytes_ += bytes;
  }
  changed_.notify_all();
  return true;
}

BackgroundQueue::Job BackgroundQueue::take() {
  const auto line = lines_.find(turns_.front());
  Job job = std::move(line->second.jobs.front());
  line->second.jobs.pop_front();
  line->second.bytes -= job.bytes;
  --jobs_;
  bytes_ -= job.bytes;
  if (line->second.jobs.empty()) {
    lines_.erase(line);
  } else {
    turns_.push_back(line->first);
  }
  turns_.pop_front();
  return job;
}

void BackgroundQueue::flush() {
  std::unique_lock lock(mutex_);
  const std::uint64_t last = last_number_;
  changed_.wait(lock, [&] { return unfinished_.empty() || *unfinished_.begin() > last; });
}

void BackgroundQueue::finish() {
  {
    const std::lock_guard lock(mutex_);
    finishing_ = true;
  }
  changed_.notify_all();
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
    changed_.wait(lock, [this] { return finishing_ || jobs_ > 0; });
    if (jobs_ == 0) return;
    Job job = take();
    const std::uint64_t number = job.number;
    lock.unlock();
    try {
      job.work();
    } catch (const std::exception& error) {
      spdlog::error("a background job threw: {}", error.what());
    }
    job = {};  // what it held goes before the lock is taken
    lock.lock();
    unfinished_.erase(number);
    changed_.notify_all();
  }
}

}  // namespace pneuma::app
