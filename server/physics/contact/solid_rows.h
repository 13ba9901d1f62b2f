// The rows of soft bodies against solids: colliders and rigid bodies.
#pragma once

#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/contact/surface_body.h"
#include "physics/scene/shape.h"

namespace pneuma::physics {

/// A solid as the rows of one pass see it.
struct SolidPlace {
  const Shape* shape = nullptr;
  const Surface* surface = nullptr;
  std::uint32_t response = 0;
  Frame at;                                // where the pass finds it
  Vec3d velocity = Vec3d::Zero();          // m/s, without contact, over the whole substep
  Vec3d angular_velocity = Vec3d::Zero();  // rad/s
  Vec3d ahead = Vec3d::Zero();             // m/s: of that, what does not lie behind it yet
  Vec3d ahead_turning = Vec3d::Zero();     // rad/s
  Box way;                                 // about all of it in the pass (set_way)
};

/// Sets `way` from what is ahead. That of a plane or a room is everywhere, that of a mesh nowhere.
void set_way(SolidPlace& solid, double dt_s);

/// Whether the body may meet the solid in the pass; `way` is about its vertices' `from` and `to`. The solid's own way
/// is set.
[[nodiscard]] bool may_meet(const SurfaceBody& body, const Box& way, const SolidPlace& solid);

/// Appends the rows of the vertices of `body` (with response `response`) that would end nearer to the solid than their
/// thickness. `start`: where the substep found them, for the way that friction sees. Sets what the solver is to reach.
void find_solid_rows(const SurfaceBody& body, std::uint32_t response, std::span<const Vec3d> start,
                     const SolidPlace& solid, double dt_s, std::vector<ContactRow>& rows);

/// The same of what of a solid may meet a face inside its border: the corners of a box or a convex mesh, the centre of
/// a ball, the axis of a capsule (which meets edges too).
void find_corner_rows(const SurfaceBody& body, std::uint32_t response, std::span<const Vec3d> start,
                      const SolidPlace& solid, double dt_s, std::vector<ContactRow>& rows);

/// Sets what the solver is to reach of a row whose gap is set: `ahead_m` is the way of the first as seen from the
/// second that does not lie behind the pass yet, `way_m` that of the whole substep.
void aim_solid_row(ContactRow& row, const Vec3d& ahead_m, const Vec3d& way_m, double dt_s);

/// Cuts the moves of vertices that would end in the solid where it ends.
void cut_at_solid(SurfaceBody& body, const SolidPlace& solid, double dt_s);

}  // namespace pneuma::physics
