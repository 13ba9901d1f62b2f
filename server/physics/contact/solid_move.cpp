#include "physics/contact/solid_move.h"

#include "physics/mesh/mesh_tree.h"
#include "physics/rigid/rigid_motion.h"

namespace pneuma::physics {
namespace {

// How far a solid's own frame moves, seen from the furthest corner of the box.
double frame_move_m(const SolidMove& solid, const Aabb<double>& box, double dt_s) {
  const double reach_m =
      (box.min - solid.start.origin).cwiseAbs().cwiseMax((box.max - solid.start.origin).cwiseAbs()).norm();
  return dt_s * (solid.velocity.norm() + solid.angular_velocity.norm() * reach_m);
}

// The shape's own would walk over all of its vertices.
Vec3d extents_of(const MeshTree& tree) {
  const FaceTree::Box& box = tree.box();
  return box.low_m.cwiseAbs().cwiseMax(box.high_m.cwiseAbs());
}

}  // namespace

SolidMove move_of(const ColliderState& state, double dt_s) {
  const Collider& c = state.collider;
  return {&c.shape,
          &c.surface,
          Frame(state.position, state.orientation),
          Frame(state.position + dt_s * c.velocity, turned(state.orientation, c.angular_velocity, dt_s)),
          c.velocity,
          c.angular_velocity,
          state.tree != nullptr ? extents_of(*state.tree) : half_extents_m(c.shape)};
}

bool may_meet(const BodyBounds& bounds, const SolidMove& solid, double offset_m, double dt_s) {
  const auto centre_of = [](const Aabb<double>& box) -> Vec3d { return 0.5 * (box.min + box.max); };
  const auto half_of = [&solid](const Aabb<double>& box) -> Vec3d {
    return solid.end.rotation.transpose().cwiseAbs() * (0.5 * (box.max - box.min));
  };
  if (const auto* room = std::get_if<RoomShape>(solid.shape)) {
    const Vec3d reach = solid.end.to_local(centre_of(bounds.moved)).cwiseAbs() + half_of(bounds.moved);
    return (reach.array() > room->half_extents_m.array() - offset_m).any();
  }
  if (const auto* plane = std::get_if<PlaneShape>(solid.shape)) {
    const Vec3d centre = solid.end.to_local(centre_of(bounds.moved));
    return plane->normal.dot(centre) - plane->normal.cwiseAbs().dot(half_of(bounds.moved)) < offset_m;
  }
  const Vec3d nearest = solid.end.to_local(centre_of(bounds.swept)).cwiseAbs() - half_of(bounds.swept);
  const double grown_m = offset_m + frame_move_m(solid, bounds.swept, dt_s);
  return (nearest.array() <= solid.half_extents_m.array() + grown_m).all();
}

}  // namespace pneuma::physics
