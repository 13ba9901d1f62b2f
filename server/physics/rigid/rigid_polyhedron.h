// Where a convex polyhedron touches another one, or a rod.
#pragma once

#include <vector>

#include "physics/mesh/polyhedron.h"
#include "physics/rigid/rigid_mesh.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

/// A polyhedron in the world, stretched along its own axes.
struct PolyhedronPose {
  const Polyhedron& solid;
  Vec3d stretch;
  Frame frame;
};

/// A convex mesh as it is, or a box as a stretched cube. The shape is one of the two.
[[nodiscard]] PolyhedronPose polyhedron_pose(const Shape& shape, const Frame& frame);

/// Appends where two polyhedra touch: in the world, with normals from b to a. Along the axis of faces and pairs of
/// edges that parts them the most, the clipped face or the crossing edges (Gregorius, "The Separating Axis Test between
/// Convex Polyhedra", Game Developers Conference 2013). Points further apart than reach_m are left out.
void touch_polyhedra(const PolyhedronPose& a, const PolyhedronPose& b, double reach_m, std::vector<MeshTouch>& touches);

/// Appends where the segment from `first` along `way` touches a convex mesh, in the mesh's frame and with normals out
/// of it: at the segment's deepest point, and at the two ends of what of the segment lies over the face there.
void touch_segment(const ConvexShape& convex, const Vec3d& first, const Vec3d& way, std::vector<MeshTouch>& touches);

}  // namespace pneuma::physics
