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
  using Pair = std::pair<physics::BodyRef, physics::BodyRef>;

  explicit TickTouches(const physics::World& world) : world_(world), touches_(world.touches()) {}
  /// By pair.
  [[nodiscard]] const std::vector<physics::BodyTouch>& all() const { return touches_; }
  /// Null where the two did not press each other.
  [[nodiscard]] const physics::BodyTouch* find(const Pair& pair) const;
  /// Whether the two are at rest: what touched as it fell asleep is not answered, and touches all the same.
  [[nodiscard]] bool are_at_rest(const Pair& pair) const;
  [[nodiscard]] const physics::World& world() const { return world_; }

 private:
  const physics::World& world_;
  std::vector<physics::BodyTouch> touches_;
};

/// One subscriber, and what he was told.
class TouchNews {
 public:
  explicit TouchNews(v1::TouchWish wish) : wish_(std::move(wish)) {}
  [[nodiscard]] const v1::TouchWish& wish() const { return wish_; }

  /// The world was edited: bodies may have gone, and others have their places.
  void edited() { is_stale_ = true; }
  /// The world is another one now: nothing touches until it is told anew.
  void forget();
  /// What is new, without `stream_id` and `tick`; nothing where there is nothing to tell.
  [[nodiscard]] std::optional<v1::Touches> tell(const TickTouches& now);

 private:
  using Pair = TickTouches::Pair;
  struct Names {
    std::string first;
    std::string second;
  };

  void find_bodies_again(const physics::World& world);
  [[nodiscard]] bool is_wanted(const Pair& pair) const;
  [[nodiscard]] bool take_room();
  void tell_removed(v1::Touches& news);
  [[nodiscard]] std::vector<Pair> changed(const TickTouches& now) const;
  /// The pairs that begin.
  [[nodiscard]] std::set<Pair> tell_changed(const TickTouches& now, v1::Touches& news);
  void tell_pressed(const TickTouches& now, const std::set<Pair>& begun, v1::Touches& news);

  v1::TouchWish wish_;
  bool is_stale_ = true;
  std::set<physics::BodyRef> bodies_;  // of the wish
  std::map<Pair, Names> touching_;     // as he knows it
  std::vector<Names> removed_;         // with a body of theirs, and not told yet
  std::set<Pair> waiting_;             // that began, and were not told yet
  Pair last_told_;                     // of those that change: the ones after it come first
  double room_ = static_cast<double>(base::touches_a_tick_max);
};

}  // namespace pneuma::app
