#include "app/step_budget.h"

#include <algorithm>

#include "base/number_text.h"

namespace pneuma::app {

double TimeBudget::left_at_s(TimePoint now) const {
  const double passed_s = std::max(0.0, std::chrono::duration<double>(now - spent_at_).count());
  return std::min(saved_max_s * processors_, left_s_ + passed_s * processors_);
}

void TimeBudget::spend(TimePoint now, Duration used) {
  if (!is_limited()) return;
  const std::lock_guard lock(mutex_);
  left_s_ = std::max(left_at_s(now) - std::chrono::duration<double>(used).count(), -wait_max_s * processors_);
  spent_at_ = std::max(spent_at_, now);
}

TimeBudget::TimePoint TimeBudget::ready_at(TimePoint now) const {
  if (!is_limited()) return now;
  const std::lock_guard lock(mutex_);
  const double lacking_s = -left_at_s(now);
  if (lacking_s <= 0.0) return now;
  // Rounded up, or whoever waits until then would find a little lacking still.
  return now + std::chrono::ceil<Duration>(std::chrono::duration<double>(lacking_s / processors_));
}

bool TimeBudget::is_full(TimePoint now) const {
  const std::lock_guard lock(mutex_);
  return !is_limited() || left_at_s(now) >= saved_max_s * processors_;
}

bool StepBudget::is_limited() const {
  return world_->is_limited() || (client_ && client_->is_limited());
}

void StepBudget::spend(TimePoint now, TimeBudget::Duration used) {
  world_->spend(now, used);
  if (client_) client_->spend(now, used);
}

StepBudget::TimePoint StepBudget::ready_at(TimePoint now) const {
  return client_ ? std::max(world_->ready_at(now), client_->ready_at(now)) : world_->ready_at(now);
}

std::string StepBudget::describe(TimePoint now) const {
  const bool is_the_clients = client_ && client_->ready_at(now) > world_->ready_at(now);
  const std::string processors = base::number_text((is_the_clients ? *client_ : *world_).processors());
  return (is_the_clients ? "all worlds of whoever made it may take " : "it may take ") + processors +
         " processor seconds a second";
}

}  // namespace pneuma::app
