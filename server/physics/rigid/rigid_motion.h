// How rigid bodies and moving colliders go through space.
#pragma once

#include <span>

#include "physics/state/state.h"

namespace pneuma::physics {

/// Neither frozen nor about to be: finite, and within the limits of speed and place. It may be asleep.
[[nodiscard]] bool is_active(const RigidState& body);

/// Whether it goes anywhere.
[[nodiscard]] inline bool is_moving(const Collider& collider) {
  return !collider.velocity.isZero(0.0) || !collider.angular_velocity.isZero(0.0);
}

/// Moves the rigid bodies' velocities on by gravity.
void accelerate_rigid_bodies(std::span<RigidState> rigid, const Vec3d& gravity_m_s2, double dt_s);

/// Moves rigid bodies and colliders along their velocities for dt_s. A rigid body's angular momentum about its centre
/// is kept to round-off (about the axes that it is free to turn about), which bounds its energy: its spin cannot blow
/// up at any step. A collider turns by the exact exponential map. Bodies that the contact solver has moved already
/// stay.
void move_solids(std::span<RigidState> rigid, std::span<ColliderState> colliders, double dt_s);

/// The same of one body.
void move_rigid(RigidState& body, double dt_s);

/// `orientation` after turning at a constant angular velocity (rad/s, in the world's frame); unit length.
[[nodiscard]] Quatd turned(const Quatd& orientation, const Vec3d& angular_velocity_rad_s, double dt_s);

}  // namespace pneuma::physics
