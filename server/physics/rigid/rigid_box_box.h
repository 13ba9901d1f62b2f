// Where two boxes touch.
#pragma once

#include <array>
#include <cstddef>

#include "physics/scene/shape.h"

namespace pneuma::physics {

struct BoxPose {
  Vec3d half_extents_m;
  Frame frame;
};

struct ManifoldPoint {
  Vec3d point = Vec3d::Zero();
  double distance_m = 0.0;
};

struct Manifold {
  Vec3d normal = Vec3d::UnitY();        // from b to a
  std::array<ManifoldPoint, 8> points;  // a quadrilateral cut by four planes has eight corners at most
  std::size_t count = 0;
};

/// The separating axis with the largest distance among the 15 of two boxes, and there the clipped face or the crossing
/// edges (Gottschalk et al., "OBBTree", 1996). Points further apart than reach_m are left out.
[[nodiscard]] Manifold touch_boxes(const BoxPose& a, const BoxPose& b, double reach_m);

}  // namespace pneuma::physics
