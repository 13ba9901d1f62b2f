// Where edges and faces of a skin meet a convex solid between their vertices. Everything in the solid's frame.
#pragma once

#include <optional>

#include "physics/contact/closest.h"
#include "physics/rigid/rigid_mesh.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

/// Of an edge, to its deepest point: past 1e-4 of its length.
inline constexpr int deepest_halvings = 14;
/// Of the mean distance of a body's vertices: a corner that has gone through a face by more than this is on its other
/// side.
inline constexpr double through_share = 0.2;

/// Of the same: an edge needs no row if it goes deeper than its ends by no more than this. With a larger share edges
/// come into their rows deep, and are thrown out.
inline constexpr double edge_slack_share = 0.003;

struct EdgeTouch {
  double share = 0.0;  // of the way along it
  SurfacePoint of_solid;
};
/// The point of an edge that is deepest in the solid, if it lies between the ends and deeper than both by more than
/// `slack_m`. None where an end is in the solid already: it goes out first; nor where the ends are nearest to opposite
/// sides, between which there is no way out. What is further away than `near_m` may be left out. The ends are given
/// with what is nearest to them of the solid, moved outwards by `offset_m`.
[[nodiscard]] std::optional<EdgeTouch> touch_of_edge(const Shape& shape, double offset_m, const Vec3d& first,
                                                     const SurfacePoint& of_first, const Vec3d& second,
                                                     const SurfacePoint& of_second, double slack_m, double near_m);

struct FaceTouch {
  FacePoint foot;                 // of the face, under the knob
  Vec3d normal = Vec3d::UnitY();  // from the knob to the face
};
/// How a face lies to a knob of a solid (shape_parts.h) whose foot is inside the face. The solid is behind the face
/// where `along_normal`, else before it; the knob may have gone through by as much as `deepest_m`.
[[nodiscard]] std::optional<FaceTouch> touch_of_face(const Vec3d& knob, const Vec3d& a, const Vec3d& b, const Vec3d& c,
                                                     bool along_normal, double deepest_m);

}  // namespace pneuma::physics
