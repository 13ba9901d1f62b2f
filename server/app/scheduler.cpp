#include "app/scheduler.h"

#include <utility>

namespace pneuma::app {

class Scheduler::Task {
 public:
  explicit Task(Slice slice) : slice_(std::move(slice)) {}

 private:
  friend class Scheduler;
  enum class State { resting, waiting, running };

  Slice slice_;
  // Guarded by the scheduler's mutex:
  State state_ = State::resting;
  bool woken_ = false;  // while running
  bool rests_ = false;  // while waiting: it may be woken before it is due
  TimePoint due_{};
  std::uint64_t sequence_ = 0;  // of equal due times, the one that has waited longer goes first
};

bool Scheduler::Earlier::operator()(const std::shared_ptr<Task>& a, const std::shared_ptr<Task>& b) const {
  return std::pair(a->due_, a->sequence_) < std::pair(b->due_, b->sequence_);
}

Scheduler::Scheduler(std::size_t threads) {
  threads_.reserve(threads);
  for (std::size_t i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

Scheduler::~Scheduler() {
  stop();
}

std::shared_ptr<Scheduler::Task> Scheduler::add(Slice slice) {
  return std::make_shared<Task>(std::move(slice));
}

void Scheduler::wake(const std::shared_ptr<Task>& task) {
  const std::lock_guard lock(mutex_);
  if (task->state_ == Task::State::running) task->woken_ = true;
  if (task->state_ == Task::State::waiting && task->rests_) {
    waiting_.erase(task);
    task->state_ = Task::State::resting;
  }
  if (task->state_ == Task::State::resting) enqueue(task, Clock::now(), false);
}

bool Scheduler::other_due(TimePoint now) const {
  const std::lock_guard lock(mutex_);
  return !waiting_.empty() && (*waiting_.begin())->due_ <= now;
}

void Scheduler::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  waiting_.clear();
}

void Scheduler::enqueue(const std::shared_ptr<Task>& task, TimePoint due, bool rests) {
  task->state_ = Task::State::waiting;
  task->rests_ = rests;
  task->due_ = due;
  task->sequence_ = ++sequence_;
  waiting_.insert(task);
  changed_.notify_one();
}

void Scheduler::work() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    if (waiting_.empty()) {
      changed_.wait(lock);
      continue;
    }
    const TimePoint due = (*waiting_.begin())->due_;
    if (due > Clock::now()) {
      changed_.wait_until(lock, due);
      continue;
    }
    const std::shared_ptr<Task> task = waiting_.extract(waiting_.begin()).value();
    task->state_ = Task::State::running;
    task->woken_ = false;
    // Another thread may have waited for this very task's time; the next one is its business now.
    if (!waiting_.empty()) changed_.notify_one();
    lock.unlock();
    const Next next = task->slice_();
    lock.lock();
    if (next.rests && task->woken_) {
      enqueue(task, Clock::now(), false);
    } else if (next.due) {
      enqueue(task, *next.due, next.rests);
    } else {
      task->state_ = Task::State::resting;
    }
  }
}

}  // namespace pneuma::app
