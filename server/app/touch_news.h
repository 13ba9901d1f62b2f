// What began and ended to touch, as a subscriber is told.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/limits.h"
#include "base/status.h"
#include "physics/world.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Refuses names that the world has not, and an impulse that cannot be. Errors name the field in `subscribe.touches`.
[[nodiscard]] base::Status check_touch_wish(const physics::World& world, const v1::TouchWish& wish);

/// The touches of the tick that a world has just done, for all who are told of them. The world notes contacts.
class TickTouches {
 public:
  using Pair = std::pair<std::string, std::string>;

  explicit TickTouches(const physics::World& world);
  [[nodiscard]] const std::map<Pair, physics::BodyTouch>& pairs() const { return pairs_; }
  [[nodiscard]] double tick_s() const { return tick_s_; }
  /// Whether the two are at rest: what touched as it fell asleep is not answered, and touches all the same.
  [[nodiscard]] bool are_at_rest(const Pair& pair) const;

 private:
  std::map<Pair, physics::BodyTouch> pairs_;
  std::set<std::string> at_rest_;  // bodies that sleep, and colliders
  double tick_s_;
};

/// One subscriber, and what he was told.
class TouchNews {
 public:
  explicit TouchNews(v1::TouchWish wish);
  [[nodiscard]] const v1::TouchWish& wish() const { return wish_; }

  /// What is new, without `stream_id` and `tick`; nothing where there is nothing to tell.
  [[nodiscard]] std::optional<v1::Touches> tell(const TickTouches& now);

 private:
  [[nodiscard]] bool is_wanted(const TickTouches::Pair& pair) const;
  [[nodiscard]] bool take_room();
  void tell_ended(const TickTouches& now, v1::Touches& news);
  void tell_begun(const TickTouches& now, v1::Touches& news);
  void tell_pressed(const TickTouches& now, const std::set<TickTouches::Pair>& before, v1::Touches& news);

  v1::TouchWish wish_;
  std::set<std::string> bodies_;          // of the wish
  std::set<TickTouches::Pair> touching_;  // as he knows it
  double room_ = static_cast<double>(base::touches_a_tick_max);
};

}  // namespace pneuma::app
