#include "app/step_goal.h"

#include <algorithm>
#include <optional>
#include <string>

#include "app/request_fields.h"
#include "base/limits.h"

namespace pneuma::app {

using base::Status;

namespace {

/// Its place among the soft bodies, the rigid bodies or the colliders.
struct Named {
  physics::VertexContact::Other kind;
  std::size_t index;
};

std::optional<Named> find(const physics::World& world, const std::string& name) {
  using Other = physics::VertexContact::Other;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    if (world.soft_body(i).name == name) return Named{Other::soft, i};
  }
  const auto& rigid = world.rigid_bodies();
  const auto solid = std::ranges::find(rigid, name, [](const auto& state) { return state.body.name; });
  if (solid != rigid.end()) return Named{Other::rigid, static_cast<std::size_t>(solid - rigid.begin())};
  const auto& colliders = world.colliders();
  const auto wall = std::ranges::find(colliders, name, [](const auto& state) { return state.collider.name; });
  if (wall != colliders.end()) return Named{Other::collider, static_cast<std::size_t>(wall - colliders.begin())};
  return std::nullopt;
}

Status no_such(const std::string& name, const std::string& field) {
  return base::not_found("no such body \"" + name + "\"", field);
}

bool touches(const physics::World& world, const Named& soft, const Named& other) {
  // A sleeper's contacts are known only where somebody watched as it fell asleep.
  if (soft.kind != physics::VertexContact::Other::soft || world.is_asleep(soft.index)) return false;
  return std::ranges::any_of(world.contacts(soft.index), [&](const physics::VertexContact& contact) {
    return contact.other == other.kind && contact.index == other.index;
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
  const std::optional<Named> body = find(world, name);
  if (!body) return std::nullopt;
  switch (body->kind) {
    case physics::VertexContact::Other::soft:
      return world.measure(body->index).centre_of_mass;
    case physics::VertexContact::Other::rigid:
      return world.rigid_bodies()[body->index].position;
    case physics::VertexContact::Other::collider:
      break;
  }
  return std::nullopt;
}

Status check_touch(const physics::World& world, const v1::StepUntil::Touch& touch) {
  const auto first = find(world, touch.first());
  if (!first) return no_such(touch.first(), "step_until.touch.first");
  const auto second = find(world, touch.second());
  if (!second) return no_such(touch.second(), "step_until.touch.second");
  using Other = physics::VertexContact::Other;
  if (touch.first() == touch.second()) return base::invalid("is the first one", "step_until.touch.second");
  if (first->kind == Other::soft || second->kind == Other::soft) return {};
  return base::invalid("neither is a soft body, and of others contacts are not told", "step_until.touch");
}

Status check_past(const physics::World& world, const v1::StepUntil::Past& past) {
  if (!centre_of(world, past.body())) return no_such(past.body(), "step_until.past.body");
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
      const auto first = find(world, request.touch().first());
      const auto second = find(world, request.touch().second());
      return first && second && (touches(world, *first, *second) || touches(world, *second, *first));
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
