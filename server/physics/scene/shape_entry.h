// Where a moving point enters a solid. In the shape's own frame, and with its `offset_m` (shape.h).
#pragma once

#include <optional>

#include "physics/scene/shape.h"

namespace pneuma::physics {

/// Where the surface stops a point.
struct SurfaceHit {
  double fraction = 0.0;  // of the way
  Vec3d normal = Vec3d::UnitY();
  Vec3d point = Vec3d::Zero();  // on the surface
};
/// The first place at which a point that moves straight from `start` to `end` runs into the solid, however thin. A
/// point that starts in the solid is stopped at once, at the nearest surface, unless it is on its way out and gets
/// there. A room's walls are met one at a time. What is no deeper than skin_m >= 0 is on the surface.
[[nodiscard]] std::optional<SurfaceHit> first_hit(const Shape& shape, const Vec3d& start, const Vec3d& end,
                                                  double offset_m, double skin_m);

}  // namespace pneuma::physics
