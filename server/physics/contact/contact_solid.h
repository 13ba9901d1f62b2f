// Soft bodies against colliders and rigid bodies.
#pragma once

#include <span>
#include <vector>

#include "physics/contact/contact_bounds.h"
#include "physics/contact/contact_note.h"
#include "physics/rigid/contact_surface.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

/// What a substep needs to know of a solid: where it is, and where it is going.
struct SolidMove {
  const Shape* shape = nullptr;
  const Surface* surface = nullptr;
  Frame start;
  Frame end;
  Vec3d velocity = Vec3d::Zero();
  Vec3d angular_velocity = Vec3d::Zero();
  Vec3d half_extents_m = Vec3d::Zero();
};
[[nodiscard]] SolidMove move_of(const ColliderState& collider, double dt_s);
[[nodiscard]] SolidMove move_of(const RigidState& body, double dt_s);

/// Whether a vertex in the boxes may touch the solid at all within dt_s, at `offset_m` from its surface.
[[nodiscard]] bool may_meet(const BodyBounds& bounds, const SolidMove& solid, double offset_m, double dt_s);

struct SubstepPhysics {
  Vec3d gravity_m_s2 = Vec3d::Zero();
  double dt_s = 0.0;
  double resting_m_s = 0.0;

  [[nodiscard]] static SubstepPhysics of(const Vec3d& gravity_m_s2, double dt_s) {
    return {gravity_m_s2, dt_s, resting_substeps * gravity_m_s2.norm() * dt_s};
  }
};

/// Stops a body's vertices at the colliders, and carries them along. Sets bounds.stale where anything was touched.
/// `notes`: null, or where what was answered is appended.
template <class Real>
void meet_colliders(SoftState<Real>& body, BodyBounds& bounds, std::span<const SolidMove> colliders,
                    const SubstepPhysics& physics, ContactNotes* notes);

/// Stops a body's vertices at a rigid body, which gets the opposite impulses one by one, in the order of the vertices;
/// so momentum is kept to round-off and a light rigid body is not pushed twice for one touch. Pinned vertices push too.
/// True where they touched. `index`: the rigid body's own, for `notes`.
template <class Real>
bool meet_rigid(SoftState<Real>& body, BodyBounds& bounds, RigidState& rigid, std::uint32_t index,
                const SubstepPhysics& physics, ContactNotes* notes);

}  // namespace pneuma::physics
