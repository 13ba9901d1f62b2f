// What a rigid body does with an impulse: its mass and its inertia, and the axes that it is locked along.
#pragma once

#include <array>
#include <optional>

#include "physics/state/state.h"

namespace pneuma::physics {

/// About the principal axes, of a shape that is filled evenly.
[[nodiscard]] Vec3d principal_inertia_kg_m2(const Shape& shape, double mass_kg);

/// In the shape's own frame; unset where they are that frame's.
[[nodiscard]] std::optional<Quatd> principal_axes(const Shape& shape);

/// Of the body's principal axes in the world.
[[nodiscard]] inline Quatd principal_orientation(const RigidState& body) {
  return body.principal_axes ? body.orientation * *body.principal_axes : body.orientation;
}

/// `x` with zeros in place of its locked parts.
[[nodiscard]] inline Vec3d free_part(const std::array<bool, 3>& locked, const Vec3d& x) {
  return {locked[0] ? 0.0 : x.x(), locked[1] ? 0.0 : x.y(), locked[2] ? 0.0 : x.z()};
}

/// What gravity, or any acceleration, is to a body that moves along its free axes alone.
[[nodiscard]] inline Vec3d pull_m_s2(const RigidState& body, const Vec3d& gravity_m_s2) {
  return free_part(body.body.locked.translation, gravity_m_s2);
}

/// One an axis of the world; 0 along those that are locked.
[[nodiscard]] inline Vec3d inverse_masses_1_kg(const RigidState& body) {
  return free_part(body.body.locked.translation, Vec3d::Constant(body.inverse_mass_1_kg));
}

/// Along a direction of unit length: n.W n.
[[nodiscard]] double inverse_mass_along_1_kg(const RigidState& body, const Vec3d& direction);

/// In the world's axes. Of a body with locked ones, the inverse of its inertia about those that are free, with zeros
/// in the rows and columns of the others: what an angular impulse does where guides take the rest of it.
[[nodiscard]] Eigen::Matrix3d inverse_inertia_1_kg_m2(const RigidState& body);

/// What an angular impulse x does to the angular velocity.
[[nodiscard]] Vec3d inverse_inertia_times(const RigidState& body, const Vec3d& x);

}  // namespace pneuma::physics
