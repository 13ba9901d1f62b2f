// A solid on its way through a span of time.
#pragma once

#include "physics/contact/contact_bounds.h"
#include "physics/scene/shape.h"
#include "physics/state/state.h"

namespace pneuma::physics {

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

/// Whether a vertex in the boxes may touch the solid at all within dt_s, at `offset_m` from its surface.
[[nodiscard]] bool may_meet(const BodyBounds& bounds, const SolidMove& solid, double offset_m, double dt_s);

}  // namespace pneuma::physics
