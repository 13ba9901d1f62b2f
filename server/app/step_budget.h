// How much processor time worlds may take.
#pragma once

#include <chrono>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace pneuma::app {

/// So many seconds of processor time a second, of which little is saved up. Any thread; the time is passed in.
class TimeBudget {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;
  static constexpr double unlimited = std::numeric_limits<double>::infinity();
  /// What may be saved up, and how long an overdraft makes wait at most: in seconds of the budget.
  static constexpr double saved_max_s = 0.25;
  static constexpr double wait_max_s = 60.0;

  explicit TimeBudget(double processors) : processors_(processors), left_s_(saved_max_s * processors) {}

  [[nodiscard]] double processors() const { return processors_; }
  [[nodiscard]] bool is_limited() const { return processors_ < unlimited; }
  void spend(TimePoint now, Duration used);
  /// When there is some left: `now`, or later.
  [[nodiscard]] TimePoint ready_at(TimePoint now) const;
  /// As at the beginning.
  [[nodiscard]] bool is_full(TimePoint now) const;

 private:
  [[nodiscard]] double left_at_s(TimePoint now) const;

  const double processors_;
  mutable std::mutex mutex_;
  double left_s_;  // when it was last spent from
  TimePoint spent_at_{};
};

/// A world's own budget, and that of all worlds of whoever made it.
class StepBudget {
 public:
  using TimePoint = TimeBudget::TimePoint;
  using TimeBudgetPtr = std::shared_ptr<TimeBudget>;

  /// Without limits.
  StepBudget() : StepBudget(TimeBudget::unlimited) {}
  /// `of_client` is null of a world that no client made.
  explicit StepBudget(double of_world, TimeBudgetPtr of_client = nullptr)
      : world_(std::make_shared<TimeBudget>(of_world)), client_(std::move(of_client)) {}

  [[nodiscard]] bool is_limited() const;
  void spend(TimePoint now, TimeBudget::Duration used);
  [[nodiscard]] TimePoint ready_at(TimePoint now) const;
  /// For people: which of the two makes the world wait for longer.
  [[nodiscard]] std::string describe(TimePoint now) const;

 private:
  TimeBudgetPtr world_;
  TimeBudgetPtr client_;
};

}  // namespace pneuma::app
