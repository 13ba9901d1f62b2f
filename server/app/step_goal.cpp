#include "app/step_goal.h"

#include <algorithm>
#include <optional>
#include <string>

#include "app/request_fields.h"
#include "base/limits.h"
#include "physics/queries.h"

namespace pneuma::app {

using base::Status;

namespace {

bool touches(const physics::World& world, physics::BodyRef first, physics::BodyRef second) {
  return std::ranges::any_of(world.touches(), [&](const physics::BodyTouch& touch) {
    return (touch.first == first && touch.second == second) || (touch.first == second && touch.second == first);
  });
}

/// A body that was frozen did not come to rest: it was stopped.
bool is_at_rest(const physics::World& world) {
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    if (!world.is_asleep(i)) return false;
  }
  return std::ranges::all_of(world.rigid_bodies(), [](const auto& body) { return body.rest.asleep; });
}

std::optional<physics::Vec3d> centre_of(const physics::World& world, const std::string& name) {
  const auto body = physics::find_body(world, name);
  if (!body || body->kind == physics::BodyKind::collider) return std::nullopt;
  if (body->kind == physics::BodyKind::rigid) return world.rigid_bodies()[body->index].position;
  return world.measure(body->index).centre_of_mass;
}

Status check_touch(const physics::World& world, const v1::StepUntil::Touch& touch) {
  const auto first = physics::find_body(world, touch.first());
  if (!first) return physics::no_such_body(world, touch.first(), "step_until.touch.first");
  const auto second = physics::find_body(world, touch.second());
  if (!second) return physics::no_such_body(world, touch.second(), "step_until.touch.second");
  if (touch.first() == touch.second()) return base::invalid("is the first one", "step_until.touch.second");
  const bool can_move = first->kind != physics::BodyKind::collider || second->kind != physics::BodyKind::collider;
  return can_move ? Status() : base::invalid("both are colliders, which never touch", "step_until.touch");
}

Status check_past(const physics::World& world, const v1::StepUntil::Past& past) {
  if (!centre_of(world, past.body())) return physics::no_such_body(world, past.body(), "step_until.past.body");
  const auto normal = read_vector(past.normal(), base::coordinate_max_m, "step_until.past.normal");
  if (!normal.ok()) return normal.status();
  if (normal->isZero(0.0)) return base::invalid("has no length", "step_until.past.normal");
  return check_amount(std::abs(past.offset_m()), base::coordinate_max_m, "step_until.past.offset_m");
}

}  // namespace

Status check_goal(const physics::World& world, const v1::StepUntil& request) {
  switch (request.until_case()) {
    case v1::StepUntil::kTick:
    case v1::StepUntil::kRest:
      return {};
    case v1::StepUntil::kTouch:
      return check_touch(world, request.touch());
    case v1::StepUntil::kPast:
      return check_past(world, request.past());
    case v1::StepUntil::UNTIL_NOT_SET:
      break;
  }
  return base::invalid("says nothing to wait for", "step_until.until");
}

bool is_reached(const physics::World& world, std::uint64_t tick, const v1::StepUntil& request) {
  switch (request.until_case()) {
    case v1::StepUntil::kTick:
      return tick >= request.tick();
    case v1::StepUntil::kRest:
      return is_at_rest(world);
    case v1::StepUntil::kTouch: {
      const auto first = physics::find_body(world, request.touch().first());
      const auto second = physics::find_body(world, request.touch().second());
      return first && second && touches(world, *first, *second);
    }
    case v1::StepUntil::kPast: {
      const auto centre = centre_of(world, request.past().body());
      const v1::Vec3& normal = request.past().normal();
      return centre && physics::Vec3d(normal.x(), normal.y(), normal.z()).dot(*centre) > request.past().offset_m();
    }
    case v1::StepUntil::UNTIL_NOT_SET:
      break;
  }
  return false;
}

}  // namespace pneuma::app
