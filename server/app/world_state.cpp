#include "app/world_state.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "app/plain_numbers.h"
#include "app/world_stats.h"
#include "base/limits.h"
#include "base/nearest_word.h"

namespace pneuma::app {

using base::Result;
using base::Status;

namespace {

std::size_t bytes_per_vertex(const v1::Observe& asked) {
  return 3 * (asked.double_precision() ? sizeof(double) : sizeof(float)) * (asked.velocities() ? 2 : 1);
}

physics::Vec3d to_vector(const v1::Vec3& in) {
  return {in.x(), in.y(), in.z()};
}

Result<physics::Quatd> read_orientation(const v1::Quaternion& in, const std::string& field) {
  const physics::Quatd orientation(in.w(), in.x(), in.y(), in.z());
  if (!orientation.coeffs().allFinite()) return base::invalid("is not finite", field);
  const double length = orientation.coeffs().stableNorm();
  if (!(length > 0.0)) return base::invalid("has no length", field);
  // What GetState told comes back to the bit.
  constexpr double rounding = 1e-14;
  if (std::abs(length - 1.0) <= rounding) return orientation;
  return physics::Quatd(orientation.coeffs() / length);
}

Result<physics::SoftPlacement> read_soft(const v1::SetState::Soft& in, bool double_precision,
                                         const std::string& field) {
  auto positions_m = read_numbers(in.positions(), double_precision, field + ".positions");
  if (!positions_m.ok()) return positions_m.status();
  auto velocities_m_s = read_numbers(in.velocities(), double_precision, field + ".velocities");
  if (!velocities_m_s.ok()) return velocities_m_s.status();
  return physics::SoftPlacement{in.name(), std::move(*positions_m), std::move(*velocities_m_s)};
}

Result<physics::RigidPlacement> read_rigid(const v1::SetState::Rigid& in, const std::string& field) {
  physics::RigidPlacement out{in.name(), {}, {}, {}, {}};
  if (in.has_position()) out.position = to_vector(in.position());
  if (in.has_velocity()) out.velocity = to_vector(in.velocity());
  if (in.has_angular_velocity()) out.angular_velocity = to_vector(in.angular_velocity());
  if (in.has_orientation()) {
    const auto orientation = read_orientation(in.orientation(), field + ".orientation");
    if (!orientation.ok()) return orientation.status();
    out.orientation = *orientation;
  }
  return out;
}

}  // namespace

std::size_t observed_bytes(const physics::World& world, const v1::Observe& asked) {
  std::size_t vertices = 0;
  const std::set<std::string> wanted(asked.bodies().begin(), asked.bodies().end());
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    const physics::SoftBody& body = world.soft_body(i);
    if (wanted.empty() || wanted.contains(body.name)) vertices += body.mesh->positions_m.size();
  }
  return vertices * bytes_per_vertex(asked);
}

Status check_observed(const physics::World& world, const v1::Observe& asked) {
  if (static_cast<std::size_t>(asked.bodies_size()) > base::world_bodies_max) {
    return {base::StatusCode::limit_exceeded,
            "names " + std::to_string(asked.bodies_size()) + " bodies; a world holds at most " +
                std::to_string(base::world_bodies_max),
            "bodies"};
  }
  std::set<std::string> names;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) names.insert(world.soft_body(i).name);
  for (int i = 0; i < asked.bodies_size(); ++i) {
    if (names.contains(asked.bodies(i))) continue;
    return base::not_found("no soft body is named \"" + asked.bodies(i) + "\"" +
                               base::nearest_or_all(asked.bodies(i), std::vector(names.begin(), names.end())),
                           "bodies[" + std::to_string(i) + "]");
  }
  if (const std::size_t bytes = observed_bytes(world, asked); bytes > base::state_bytes_max) {
    return {base::StatusCode::limit_exceeded,
            "is of " + std::to_string(bytes) + " bytes; a reply holds at most " +
                std::to_string(base::state_bytes_max) + ": ask for some of the bodies",
            "bodies"};
  }
  return {};
}

v1::State state_of(const physics::World& world, const v1::Observe& asked, const std::string& name, std::uint64_t tick) {
  v1::State state;
  state.set_world(name);
  state.set_tick(tick);
  state.set_time_s(world.time_s());
  state.set_state_hash(world.state_hash());
  state.set_double_precision(asked.double_precision());
  const std::set<std::string> wanted(asked.bodies().begin(), asked.bodies().end());
  std::vector<double> numbers;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    const physics::SoftBody& body = world.soft_body(i);
    if (!wanted.empty() && !wanted.contains(body.name)) continue;
    v1::State::Soft& out = *state.add_soft_bodies();
    describe(world, i, *out.mutable_body());
    numbers.resize(3 * body.mesh->positions_m.size());
    world.copy_positions(i, numbers);
    append_numbers(numbers, asked.double_precision(), *out.mutable_positions());
    if (!asked.velocities()) continue;
    world.copy_velocities(i, numbers);
    append_numbers(numbers, asked.double_precision(), *out.mutable_velocities());
  }
  for (const physics::RigidState& body : world.rigid_bodies()) describe(body, *state.add_rigid_bodies());
  return state;
}

Status set_state(physics::World& world, const v1::SetState& request) {
  std::vector<physics::SoftPlacement> soft;
  std::vector<physics::RigidPlacement> rigid;
  for (int i = 0; i < request.soft_bodies_size(); ++i) {
    const std::string field = "set_state.soft_bodies[" + std::to_string(i) + "]";
    auto read = read_soft(request.soft_bodies(i), request.double_precision(), field);
    if (!read.ok()) return read.status();
    soft.push_back(std::move(*read));
  }
  for (int i = 0; i < request.rigid_bodies_size(); ++i) {
    const std::string field = "set_state.rigid_bodies[" + std::to_string(i) + "]";
    auto read = read_rigid(request.rigid_bodies(i), field);
    if (!read.ok()) return read.status();
    rigid.push_back(std::move(*read));
  }
  if (soft.empty() && rigid.empty()) return base::invalid("names no body", "set_state");
  const Status placed = world.place(soft, rigid);
  return placed.ok() ? placed : placed.inside("set_state");
}

}  // namespace pneuma::app
