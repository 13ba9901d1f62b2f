#include "app/touch_news.h"

#include <algorithm>
#include <utility>

#include "app/request_fields.h"
#include "physics/queries.h"
#include "scene_io/vectors.h"

namespace pneuma::app {

using base::Status;
using scene_io::set;
using Pair = TickTouches::Pair;

namespace {

v1::Touches::Touch touch_of(v1::Touches::Touch::Kind kind, const Pair& pair) {
  v1::Touches::Touch touch;
  touch.set_kind(kind);
  touch.set_first(pair.first);
  touch.set_second(pair.second);
  return touch;
}

v1::Touches::Touch touch_of(v1::Touches::Touch::Kind kind, const Pair& pair, const physics::BodyTouch& found) {
  v1::Touches::Touch touch = touch_of(kind, pair);
  touch.set_impulse_n_s(found.impulse_n_s);
  set(*touch.mutable_position(), found.position);
  set(*touch.mutable_normal(), found.normal);
  set(*touch.mutable_push(), found.push_n_s);
  return touch;
}

}  // namespace

Status check_touch_wish(const physics::World& world, const v1::TouchWish& wish) {
  if (const auto bodies = read_bodies(world, wish.bodies(), "subscribe.touches.bodies"); !bodies.ok()) {
    return bodies.status();
  }
  return check_amount(wish.impulse_min_n_s(), base::impulse_max_n_s, "subscribe.touches.impulse_min_n_s");
}

TickTouches::TickTouches(const physics::World& world) : tick_s_(world.tick_period_s()) {
  for (const physics::BodyTouch& touch : world.touches()) {
    pairs_.emplace(Pair(physics::name_of(world, touch.first), physics::name_of(world, touch.second)), touch);
  }
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    if (world.is_asleep(i)) at_rest_.insert(world.soft_body(i).name);
  }
  for (const physics::RigidState& body : world.rigid_bodies()) {
    if (body.rest.asleep) at_rest_.insert(body.body.name);
  }
  for (const physics::ColliderState& state : world.colliders()) at_rest_.insert(state.collider.name);
}

bool TickTouches::are_at_rest(const Pair& pair) const {
  return at_rest_.contains(pair.first) && at_rest_.contains(pair.second);
}

TouchNews::TouchNews(v1::TouchWish wish)
    : wish_(std::move(wish)), bodies_(wish_.bodies().begin(), wish_.bodies().end()) {}

std::optional<v1::Touches> TouchNews::tell(const TickTouches& now) {
  room_ = std::min(static_cast<double>(base::touches_a_tick_max), room_ + base::touches_per_s_max * now.tick_s());
  v1::Touches news;
  tell_ended(now, news);
  const std::set<Pair> before = touching_;
  tell_begun(now, news);
  if (wish_.has_impulse_min_n_s()) tell_pressed(now, before, news);
  if (news.touches().empty() && news.dropped() == 0) return std::nullopt;
  return news;
}

bool TouchNews::is_wanted(const Pair& pair) const {
  return bodies_.empty() || bodies_.contains(pair.first) || bodies_.contains(pair.second);
}

bool TouchNews::take_room() {
  if (room_ < 1.0) return false;
  room_ -= 1.0;
  return true;
}

void TouchNews::tell_ended(const TickTouches& now, v1::Touches& news) {
  for (auto pair = touching_.begin(); pair != touching_.end();) {
    if (now.pairs().contains(*pair) || now.are_at_rest(*pair)) {
      ++pair;
    } else if (take_room()) {
      *news.add_touches() = touch_of(v1::Touches::Touch::ENDED, *pair);
      pair = touching_.erase(pair);
    } else {
      news.set_dropped(news.dropped() + 1);
      ++pair;
    }
  }
}

void TouchNews::tell_begun(const TickTouches& now, v1::Touches& news) {
  for (const auto& [pair, touch] : now.pairs()) {
    if (!is_wanted(pair) || touching_.contains(pair)) continue;
    if (!take_room()) {
      news.set_dropped(news.dropped() + 1);
      continue;
    }
    *news.add_touches() = touch_of(v1::Touches::Touch::BEGAN, pair, touch);
    touching_.insert(pair);
  }
}

// The hardest first, where there is no room for all.
void TouchNews::tell_pressed(const TickTouches& now, const std::set<Pair>& before, v1::Touches& news) {
  std::vector<std::pair<double, const Pair*>> pressed;
  for (const auto& [pair, touch] : now.pairs()) {
    if (before.contains(pair) && touch.impulse_n_s >= wish_.impulse_min_n_s()) {
      pressed.emplace_back(touch.impulse_n_s, &pair);
    }
  }
  std::ranges::stable_sort(pressed, [](const auto& a, const auto& b) { return a.first > b.first; });
  for (const auto& [impulse_n_s, pair] : pressed) {
    if (!take_room()) {
      news.set_dropped(news.dropped() + 1);
      continue;
    }
    *news.add_touches() = touch_of(v1::Touches::Touch::PRESSED, *pair, now.pairs().at(*pair));
  }
}

}  // namespace pneuma::app
