// Where a rigid body touches a mesh.
#pragma once

#include <vector>

#include "physics/mesh/mesh_tree.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

/// A convex body (a ball, a capsule, a box or a convex mesh), in the mesh's frame.
struct ConvexPose {
  const Shape& shape;
  Frame frame;
  Vec3d way_m;  // its move in the time looked at
};

/// In the mesh's frame.
struct MeshTouch {
  Vec3d point = Vec3d::Zero();
  Vec3d normal = Vec3d::UnitY();  // from the mesh to the body
  double distance_m = 0.0;
};

/// Appends what of the two is nearer than reach_m: centres, ends and corners of the body over faces (or on their way
/// through them), and edges of the mesh that are not level. A face is met from the side that the body's centre is on.
void touch_mesh(const MeshTree& tree, const ConvexPose& body, double reach_m, std::vector<MeshTouch>& touches);

/// The share of the way from `first` along `way` at which a segment is nearest to a convex solid, or deepest in it: the
/// distance to such a solid is convex. In the solid's frame. Within 2^-halvings of the way.
[[nodiscard]] double deepest_on_segment(const Shape& shape, const Vec3d& first, const Vec3d& way, int halvings = 40);

}  // namespace pneuma::physics
