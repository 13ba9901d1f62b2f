#include "app/touch_news.h"

#include <algorithm>

#include "app/request_fields.h"
#include "physics/queries.h"
#include "scene_io/vectors.h"

namespace pneuma::app {

using base::Status;
using scene_io::set;
using ToldTouch = v1::Touches::Touch;

namespace {

TickTouches::Pair pair_of(const physics::BodyTouch& touch) {
  return {touch.first, touch.second};
}

bool is_at_rest(const physics::World& world, physics::BodyRef body) {
  switch (body.kind) {
    case physics::BodyKind::soft:
      return world.is_asleep(body.index);
    case physics::BodyKind::rigid:
      return world.rigid_bodies()[body.index].rest.asleep;
    case physics::BodyKind::collider:
      break;
  }
  return true;
}

void add(ToldTouch::Kind kind, const std::string& first, const std::string& second, const physics::BodyTouch* found,
         v1::Touches& news) {
  ToldTouch& touch = *news.add_touches();
  touch.set_kind(kind);
  touch.set_first(first);
  touch.set_second(second);
  if (found == nullptr) return;
  touch.set_impulse_n_s(found->impulse_n_s);
  set(*touch.mutable_position(), found->position);
  set(*touch.mutable_normal(), found->normal);
  set(*touch.mutable_push(), found->push_n_s);
}

}  // namespace

Status check_touch_wish(const physics::World& world, const v1::TouchWish& wish) {
  if (const auto bodies = read_bodies(world, wish.bodies(), "subscribe.touches.bodies"); !bodies.ok()) {
    return bodies.status();
  }
  return check_amount(wish.impulse_min_n_s(), base::impulse_max_n_s, "subscribe.touches.impulse_min_n_s");
}

const physics::BodyTouch* TickTouches::find(const Pair& pair) const {
  const auto found = std::ranges::lower_bound(touches_, pair, {}, pair_of);
  return found != touches_.end() && pair_of(*found) == pair ? &*found : nullptr;
}

bool TickTouches::are_at_rest(const Pair& pair) const {
  return is_at_rest(world_, pair.first) && is_at_rest(world_, pair.second);
}

void TouchNews::forget() {
  touching_.clear();
  removed_.clear();
  waiting_.clear();
}

std::optional<v1::Touches> TouchNews::tell(const TickTouches& now) {
  if (is_stale_) find_bodies_again(now.world());
  room_ = std::min(static_cast<double>(base::touches_a_tick_max),
                   room_ + base::touches_per_s_max * now.world().tick_period_s());
  v1::Touches news;
  tell_removed(news);
  const std::set<Pair> begun = tell_changed(now, news);
  if (wish_.has_impulse_min_n_s()) tell_pressed(now, begun, news);
  if (news.touches().empty() && news.dropped() == 0) return std::nullopt;
  return news;
}

void TouchNews::find_bodies_again(const physics::World& world) {
  is_stale_ = false;
  std::map<std::string, physics::BodyRef> by_name;
  for (const physics::BodyRef body : physics::all_bodies(world)) by_name.emplace(physics::name_of(world, body), body);
  bodies_.clear();
  for (const std::string& name : wish_.bodies()) {
    if (const auto body = by_name.find(name); body != by_name.end()) bodies_.insert(body->second);
  }
  waiting_.clear();
  for (auto& [before, names] : std::exchange(touching_, {})) {
    const auto first = by_name.find(names.first);
    const auto second = by_name.find(names.second);
    if (first == by_name.end() || second == by_name.end()) {
      removed_.push_back(names);
    } else {
      touching_.emplace(std::minmax(first->second, second->second), names);
    }
  }
}

bool TouchNews::is_wanted(const Pair& pair) const {
  return wish_.bodies().empty() || bodies_.contains(pair.first) || bodies_.contains(pair.second);
}

bool TouchNews::take_room() {
  if (room_ < 1.0) return false;
  room_ -= 1.0;
  return true;
}

void TouchNews::tell_removed(v1::Touches& news) {
  while (!removed_.empty() && take_room()) {
    add(ToldTouch::ENDED, removed_.back().first, removed_.back().second, nullptr, news);
    removed_.pop_back();
  }
}

std::vector<TouchNews::Pair> TouchNews::changed(const TickTouches& now) const {
  std::vector<Pair> changed;
  for (const auto& [pair, names] : touching_) {
    if (now.find(pair) == nullptr && !now.are_at_rest(pair)) changed.push_back(pair);
  }
  for (const physics::BodyTouch& touch : now.all()) {
    const Pair pair = pair_of(touch);
    if (is_wanted(pair) && !touching_.contains(pair)) changed.push_back(pair);
  }
  // In turn, so that none waits for ever.
  std::ranges::sort(changed);
  std::ranges::rotate(changed, std::ranges::upper_bound(changed, last_told_));
  return changed;
}

std::set<TouchNews::Pair> TouchNews::tell_changed(const TickTouches& now, v1::Touches& news) {
  std::set<Pair> begun;
  std::set<Pair> waiting;
  for (const Pair& pair : changed(now)) {
    const physics::BodyTouch* found = now.find(pair);
    if (!take_room()) {
      if (found != nullptr) waiting.insert(pair);
      continue;
    }
    last_told_ = pair;
    if (found == nullptr) {
      const auto ended = touching_.find(pair);
      add(ToldTouch::ENDED, ended->second.first, ended->second.second, nullptr, news);
      touching_.erase(ended);
    } else {
      const Names names{physics::name_of(now.world(), pair.first), physics::name_of(now.world(), pair.second)};
      add(ToldTouch::BEGAN, names.first, names.second, found, news);
      touching_.emplace(pair, names);
      begun.insert(pair);
    }
  }
  for (const Pair& pair : std::exchange(waiting_, waiting)) {
    if (now.find(pair) == nullptr && !now.are_at_rest(pair)) news.set_dropped(news.dropped() + 1);
  }
  return begun;
}

// The hardest first, where there is no room for all.
void TouchNews::tell_pressed(const TickTouches& now, const std::set<Pair>& begun, v1::Touches& news) {
  std::vector<const physics::BodyTouch*> pressed;
  for (const physics::BodyTouch& touch : now.all()) {
    const Pair pair = pair_of(touch);
    if (touch.impulse_n_s < wish_.impulse_min_n_s() || !touching_.contains(pair) || begun.contains(pair)) continue;
    pressed.push_back(&touch);
  }
  std::ranges::sort(pressed, {},
                    [](const physics::BodyTouch* touch) { return std::pair(-touch->impulse_n_s, pair_of(*touch)); });
  for (const physics::BodyTouch* touch : pressed) {
    if (take_room()) {
      const auto& names = touching_.at(pair_of(*touch));
      add(ToldTouch::PRESSED, names.first, names.second, touch, news);
    } else {
      news.set_dropped(news.dropped() + 1);
    }
  }
}

}  // namespace pneuma::app
