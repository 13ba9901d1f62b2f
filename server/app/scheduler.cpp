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

// Slices that were taken for brief, and are not: as each may have a thread for long, others take their place.
constexpr std::size_t surprises_max = 64;

// A slice that has gone on for so long may have no end, and counts no more: others get its turns.
constexpr auto endless_after = std::chrono::seconds(1);

// A slice as short as the last one of its task is not worth calling another thread for: this one goes on with what is
// due. It would take about as long.
constexpr auto short_slice = std::chrono::microseconds(100);
constexpr auto patience_max = std::chrono::milliseconds(1);  // where a slice is longer than it was

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
  Clock::duration last_used_ = Clock::duration::max();
  bool woken_ = false;  // while running
  bool rests_ = false;  // while waiting: it may be woken before it is due
};

Scheduler::Clock::duration Scheduler::Turn::used() const {
  return processor_time() - began_;
}

bool Scheduler::Turn::other_due(TimePoint now) const {
  const Clock::duration used = this->used();
  const std::lock_guard lock(scheduler_.mutex_);
  return scheduler_.queue_.has_before(task_, used, now);
}

Scheduler::Scheduler(std::size_t threads) : slices_max_(threads), threads_max_(2 * threads + surprises_max) {
  const std::lock_guard lock(mutex_);  // they may be joined by more at once
  // Beside all slices that go on for long, as many brief ones.
  for (std::size_t i = 0; i < 2 * threads; ++i) threads_.emplace_back([this] { work(); });
}

Scheduler::~Scheduler() {
  stop();
}

std::shared_ptr<Scheduler::Task> Scheduler::add(Slice slice) {
  return std::make_shared<Task>(std::move(slice));
}

void Scheduler::wake(const std::shared_ptr<Task>& task) {
  Lock lock(mutex_);
  if (task->state_ == Task::State::running) task->woken_ = true;
  if (task->state_ == Task::State::waiting && task->rests_) {
    queue_.remove(task);
    task->state_ = Task::State::resting;
  }
  if (task->state_ != Task::State::resting) return;
  enqueue(task, Clock::now(), false);
  const Called whom = see_to_next_turn(Clock::duration::zero());
  lock.unlock();
  call(whom);
}

void Scheduler::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  watch_changed_.notify_all();
  called_.notify_all();
  for (std::thread& thread : threads_) thread.join();
  threads_.clear();
  queue_ = {};
}

void Scheduler::enqueue(const std::shared_ptr<Task>& task, TimePoint due, bool rests) {
  task->state_ = Task::State::waiting;
  task->rests_ = rests;
  queue_.add(task, due);
}

// When a thread may take a task; nothing until something changes.
std::optional<Scheduler::TimePoint> Scheduler::next_turn(TimePoint now) {
  if (is_free(now)) return queue_.next_due();
  // When the last of those that count has gone on for long, or counts no more.
  const TimePoint last_began = began_[slices_max_ - 1];
  const auto due = queue_.next_due();
  if (!due) return std::nullopt;
  const TimePoint any_at = std::max(*due, last_began + endless_after);
  const auto brief_due = queue_.next_brief_due(now);
  return brief_due ? std::min(any_at, std::max(*brief_due, last_began + ShareQueue::brief_max)) : any_at;
}

// Whether there is a thread for a slice of any length.
bool Scheduler::is_free(TimePoint now) const {
  return began_.size() < slices_max_ || began_[slices_max_ - 1] + endless_after <= now;
}

// Somebody who watches the time is called where it would sleep for too long; where nobody does, one is called to.
Scheduler::Called Scheduler::see_to_next_turn(Clock::duration patience) {
  const TimePoint now = Clock::now();
  const auto turn_at = next_turn(now);
  if (!turn_at) return Called::nobody;
  if (!watched_.empty()) {
    const TimePoint at_latest = std::max(*turn_at <= now ? now : *turn_at + slack, now + patience);
    return at_latest < *watched_.begin() ? Called::watcher : Called::nobody;
  }
  if (waiting_ > 0) return Called::waiter;
  if (!stopping_ && threads_.size() < threads_max_) threads_.emplace_back([this] { work(); });
  return Called::nobody;
}

void Scheduler::call(Called whom) {
  if (whom == Called::watcher) watch_changed_.notify_one();
  if (whom == Called::waiter) called_.notify_one();
}

void Scheduler::work() {
  std::chrono::nanoseconds spent = processor_time();
  Lock lock(mutex_);
  while (!stopping_) {
    const TimePoint now = Clock::now();
    const auto turn_at = next_turn(now);
    if (turn_at && *turn_at <= now) {
      run_slice(lock, now, spent);
    } else {
      watch(lock, turn_at);
    }
  }
}

// With as many threads that wait for the same time, each slice of a world would wake all of them. One that has to wake
// before those that watch does so itself: calling one of them would take a switch of threads. A second one looks after
// the first, which will be busy with short slices when it has woken.
void Scheduler::watch(Lock& lock, std::optional<TimePoint> turn_at) {
  TimePoint until = turn_at ? *turn_at + slack : TimePoint::max();
  if (!watched_.empty() && *watched_.begin() <= until) {
    if (watched_.size() > 1 || queue_.size() < 2 || *watched_.begin() == TimePoint::max()) {
      ++waiting_;
      called_.wait(lock);
      --waiting_;
      return;
    }
    until = *watched_.begin() + patience_max;
  }
  const auto watched = watched_.insert(until);
  if (until < TimePoint::max()) {
    watch_changed_.wait_until(lock, until);
  } else {
    watch_changed_.wait(lock);
  }
  watched_.erase(watched);
}

// `spent` is the thread's processor time up to its last slice. What it took to get to this one is this task's too.
void Scheduler::run_slice(Lock& lock, TimePoint now, std::chrono::nanoseconds& spent) {
  const auto task = std::static_pointer_cast<Task>(is_free(now) ? queue_.take(now) : queue_.take_brief(now));
  task->state_ = Task::State::running;
  task->woken_ = false;
  began_.push_front(now);
  const bool is_short = task->last_used_ <= short_slice;
  const Called whom = see_to_next_turn(is_short ? patience_max : Clock::duration::zero());
  lock.unlock();
  call(whom);
  const Turn turn(*this, *task, spent);
  const Next next = task->slice_(turn);
  const Clock::duration used = turn.used();
  spent += used;
  lock.lock();
  task->last_used_ = used;
  // From here on this thread sees to the next turn.
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

}  // namespace pneuma::app
