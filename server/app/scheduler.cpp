#include "app/scheduler.h"

#include <algorithm>
#include <ctime>
#include <utility>

namespace pneuma::app {

namespace {

// Of this thread: what others take of its processor is not its task's.
std::chrono::nanoseconds processor_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

class Scheduler::Task : public ShareQueue::Sharer {
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
};

Scheduler::Turn::Turn(Scheduler& scheduler, const Task& task)
    : scheduler_(scheduler), task_(task), began_(processor_time()) {}

Scheduler::Clock::duration Scheduler::Turn::used() const {
  return processor_time() - began_;
}

bool Scheduler::Turn::other_due(TimePoint now) const {
  const Clock::duration used = this->used();
  const std::lock_guard lock(scheduler_.mutex_);
  return scheduler_.queue_.has_before(task_, used, now);
}

Scheduler::Scheduler(std::size_t threads) : slices_max_(threads) {
  // Beside all slices that go on for long, as many brief ones; and a few that turn out not to be brief.
  constexpr std::size_t surprises = 4;
  threads_.reserve(2 * threads + surprises);
  for (std::size_t i = 0; i < 2 * threads + surprises; ++i) threads_.emplace_back([this] { work(); });
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
    queue_.remove(task);
    task->state_ = Task::State::resting;
  }
  if (task->state_ == Task::State::resting) enqueue(task, Clock::now(), false);
}

void Scheduler::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  queue_ = {};
}

void Scheduler::enqueue(const std::shared_ptr<Task>& task, TimePoint due, bool rests) {
  task->state_ = Task::State::waiting;
  task->rests_ = rests;
  queue_.add(task, due);
  changed_.notify_one();
}

// When a thread may take a task; nothing until something changes.
std::optional<Scheduler::TimePoint> Scheduler::next_turn(TimePoint now) {
  if (began_.size() < slices_max_) return queue_.next_due();
  const auto due = queue_.next_brief_due(now);
  if (!due) return std::nullopt;
  return std::max(*due, began_[slices_max_ - 1] + ShareQueue::brief_max);  // when that one has gone on for long
}

void Scheduler::work() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    const TimePoint now = Clock::now();
    const auto turn_at = next_turn(now);
    if (!turn_at) {
      changed_.wait(lock);
      continue;
    }
    if (*turn_at > now) {
      changed_.wait_until(lock, *turn_at);
      continue;
    }
    const bool is_spare = began_.size() >= slices_max_;
    const auto task = std::static_pointer_cast<Task>(is_spare ? queue_.take_brief(now) : queue_.take(now));
    task->state_ = Task::State::running;
    task->woken_ = false;
    began_.push_front(now);
    // Another thread may have waited for this very task's time; the next one is its business now.
    changed_.notify_one();
    lock.unlock();
    const Turn turn(*this, *task);
    const Next next = task->slice_(turn);
    const Clock::duration used = turn.used();
    lock.lock();
    began_.erase(std::ranges::find(began_, now));
    ShareQueue::used(*task, used, Clock::now());
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
