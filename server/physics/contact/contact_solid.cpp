#include "physics/contact/contact_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/limits.h"
#include "physics/mesh/mesh_tree.h"
#include "physics/rigid/contact_surface.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/scene/shape_entry.h"

namespace pneuma::physics {
namespace {

// A room's corner takes one pass a wall, three in all, and one that finds no more.
constexpr int corner_passes_max = 4;
// Rounds over the colliders while a vertex that one pushed may be in another; a wedge too tight for it is left at the
// last.
constexpr int sweeps_max = 3;
// How much of its overlap with a pinned vertex a rigid body gives up in a substep.
constexpr double pin_push_share = 0.2;

/// Stops a point's way at a solid. `answer(normal, arm, gap_m, after_s)` changes the velocities and returns the
/// relative one that is left; the rest of the time the point slides along with it.
template <class Answer>
bool stop_at(const SolidMove& solid, double offset_m, double skin_m, double dt_s, const Vec3d& start, Vec3d& end,
             const Answer& answer) {
  Vec3d from = solid.start.to_local(start);
  Vec3d to = solid.end.to_local(end);
  double after_s = dt_s;
  bool touched = false;
  for (int pass = 0; pass < corner_passes_max; ++pass) {
    const std::optional<SurfaceHit> hit = first_hit(*solid.shape, from, to, offset_m, skin_m);
    if (!hit) break;
    touched = true;
    after_s *= 1.0 - hit->fraction;
    const double gap_m = (from - hit->point).dot(hit->normal);
    const Vec3d normal = solid.end.rotation * hit->normal;
    const Vec3d relative = answer(normal, Vec3d(solid.end.rotation * hit->point), gap_m, after_s);
    const Vec3d slide = relative - relative.dot(normal) * normal;
    from = hit->point;
    to = pass + 1 < corner_passes_max ? Vec3d(from + after_s * (solid.end.rotation.transpose() * slide)) : from;
  }
  if (touched) end = solid.end.to_world(to);
  return touched;
}

/// How far a solid's own frame moves, seen from the furthest corner of the box.
double frame_move_m(const SolidMove& solid, const Aabb<double>& box, double dt_s) {
  const double reach_m =
      (box.min - solid.start.origin).cwiseAbs().cwiseMax((box.max - solid.start.origin).cwiseAbs()).norm();
  return dt_s * (solid.velocity.norm() + solid.angular_velocity.norm() * reach_m);
}

/// Calls visit(i) for the vertices whose way may touch the solid: for walls its end decides, for the rest the box about
/// the way.
template <class Real, class Visit>
void for_near_vertices(const SoftState<Real>& body, const SolidMove& solid, double offset_m, const Visit& visit) {
  const std::size_t count = body.x.size();
  const Eigen::Matrix3d to_local = solid.end.rotation.transpose();
  const auto end_of = [&](std::size_t i) -> Vec3d {
    return to_local * (body.position_m(i) + body.dr[i].template cast<double>() - solid.end.origin);
  };
  if (const auto* room = std::get_if<RoomShape>(solid.shape)) {
    const Vec3d half = room->half_extents_m.array() - offset_m;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d over = end_of(i).cwiseAbs() - half;
      if (over.x() > 0.0 || over.y() > 0.0 || over.z() > 0.0) visit(i);
    }
  } else if (const auto* plane = std::get_if<PlaneShape>(solid.shape)) {
    const Vec3d normal = solid.end.rotation * plane->normal;
    const double level = normal.dot(solid.end.origin) + offset_m;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d end = body.position_m(i) + body.dr[i].template cast<double>();
      if (normal.dot(end) < level) visit(i);
    }
  } else {
    const Vec3d half = half_extents_m(*solid.shape).array() + offset_m;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d end = end_of(i);
      const Vec3d start = solid.start.to_local(body.position_m(i));
      const Vec3d over = (start + end).cwiseAbs() - 2.0 * half - (end - start).cwiseAbs();
      if (over.x() <= 0.0 && over.y() <= 0.0 && over.z() <= 0.0) visit(i);
    }
  }
}

struct Tolerances {
  double skin_m;
  double touching_m;
};

// Coordinates of their precision cannot tell a smaller gap from none.
template <class Real>
Tolerances tolerances_of(const SoftState<Real>& body, const BodyBounds& bounds) {
  const auto furthest_m = [&](const Vec3d& origin) {
    return (bounds.swept.min - origin).cwiseAbs().cwiseMax((bounds.swept.max - origin).cwiseAbs()).maxCoeff();
  };
  const double in_body_m = static_cast<double>(std::numeric_limits<Real>::epsilon()) * furthest_m(body.origin_m);
  const double in_world_m = std::numeric_limits<double>::epsilon() * furthest_m(Vec3d::Zero());
  const auto length_m = static_cast<double>(body.length_m);
  return {std::max(skin_share * length_m, in_world_m),
          std::max(touching_share * length_m, 4.0 * std::max(in_body_m, in_world_m))};
}

/// Tells a vertex that its own body presses against a surface from one that hits it.
template <class Real>
class Pressure {
 public:
  Pressure(const SoftState<Real>& body, double touching_m, double resting_m_s)
      : body_(body), touching_m_(touching_m), resting_m_s_(resting_m_s) {}
  [[nodiscard]] bool presses(const Vec3d& normal, double gap_m, const Vec3d& of_surface) {
    if (gap_m > touching_m_) return false;
    if (!mean_) mean_ = mean_velocity(body_);
    return (*mean_ - of_surface).dot(normal) >= -resting_m_s_;
  }

 private:
  const SoftState<Real>& body_;
  double touching_m_;
  double resting_m_s_;
  std::optional<Vec3d> mean_;  // of the body when the first vertex touched
};

template <class Real>
bool within_speed(const Vec3<Real>& velocity) {
  const Real limit = static_cast<Real>(base::speed_max_m_s);
  return velocity.squaredNorm() <= limit * limit;
}

/// A wall of a collider that a vertex meets, `arm` from the collider's origin, `after_s` before the substep's end.
struct Wall {
  const Vec3d& normal;
  const Vec3d& arm;
  double gap_m;
  double after_s;
};

/// What the vertex does then, as seen from the surface.
struct Answer {
  Vec3d of_surface;
  double impact_m_s;
  Vec3d after;
};

template <class Real>
Answer meet_wall(const Vec3d& velocity, const Wall& wall, const SolidMove& solid, const ContactSurface& surface,
                 const SubstepPhysics& physics, Pressure<Real>& pressure) {
  const Vec3d of_surface = velocity_at(solid.velocity, solid.angular_velocity, wall.arm);
  const Vec3d before = velocity - of_surface;
  const double gained_m_s = wall.after_s * wall.normal.dot(physics.gravity_m_s2);
  const double impact_m_s = pressure.presses(wall.normal, wall.gap_m, of_surface)
                                ? 0.0
                                : impact_speed(before.dot(wall.normal), gained_m_s, physics.resting_m_s);
  return {of_surface, impact_m_s, respond(before, wall.normal, impact_m_s, surface)};
}

template <class Real>
bool meet_collider(SoftState<Real>& body, const BodyBounds& bounds, const SolidMove& solid, std::uint32_t index,
                   const SubstepPhysics& physics, ContactNotes* notes) {
  const ContactSurface surface = combine(body.body.surface, *solid.surface);
  const Tolerances tolerances = tolerances_of(body, bounds);
  Pressure<Real> pressure(body, tolerances.touching_m, physics.resting_m_s);
  bool touched = false;
  for_near_vertices(body, solid, surface.thickness_m, [&](std::size_t i) {
    if (body.is_pinned(i) || !within_speed(body.v[i])) return;
    const Vec3d start = body.position_m(i);
    Vec3d end = start + body.dr[i].template cast<double>();
    Vec3d velocity = body.v[i].template cast<double>();
    const auto answer = [&](const Vec3d& normal, const Vec3d& arm, double gap_m, double after_s) -> Vec3d {
      const Answer met = meet_wall(velocity, {normal, arm, gap_m, after_s}, solid, surface, physics, pressure);
      if (notes != nullptr) {
        notes->push_back({static_cast<std::uint32_t>(i), VertexContact::Other::collider, index, normal});
      }
      velocity = met.of_surface + met.after;
      return met.after;
    };
    if (!stop_at(solid, surface.thickness_m, tolerances.skin_m, physics.dt_s, start, end, answer)) return;
    body.dr[i] = (end - start).template cast<Real>();
    body.v[i] = velocity.template cast<Real>();
    touched = true;
  });
  return touched;
}

/// What of a rigid body stays as it is while vertices meet it.
struct RigidInverse {
  Vec3d masses_1_kg;
  Eigen::Matrix3d inertia_1_kg_m2;
};

/// A vertex and the point of a rigid body that it touches, as two masses.
struct Touch {
  RigidState& rigid;
  const RigidInverse& inverse;
  double inverse_vertex_mass_1_kg;
  Vec3d arm;

  [[nodiscard]] Vec3d relative(const Vec3d& velocity) const {
    return velocity - velocity_at(rigid.velocity, rigid.angular_velocity, arm);
  }
  /// Of the relative velocity.
  [[nodiscard]] Vec3d change_m_s(const Vec3d& impulse_n_s) const {
    const Vec3d turning = inverse.inertia_1_kg_m2 * arm.cross(impulse_n_s);
    return inverse_vertex_mass_1_kg * impulse_n_s + inverse.masses_1_kg.cwiseProduct(impulse_n_s) + turning.cross(arm);
  }
  void push(Vec3d& velocity, const Vec3d& impulse_n_s) const {
    velocity += inverse_vertex_mass_1_kg * impulse_n_s;
    rigid.velocity -= inverse.masses_1_kg.cwiseProduct(impulse_n_s);
    rigid.angular_velocity -= inverse.inertia_1_kg_m2 * arm.cross(impulse_n_s);
  }
};

// The shape's own would walk over all of its vertices.
Vec3d extents_of(const MeshTree& tree) {
  const MeshTree::Box& box = tree.nodes.front().box;
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

SolidMove move_of(const RigidState& state, double dt_s) {
  return {&state.body.shape,
          &state.body.surface,
          Frame(state.position, state.orientation),
          Frame(state.position + dt_s * state.velocity, turned(state.orientation, state.angular_velocity, dt_s)),
          state.velocity,
          state.angular_velocity,
          half_extents_m(state.body.shape)};
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

template <class Real>
void meet_colliders(SoftState<Real>& body, BodyBounds& bounds, std::span<const SolidMove> colliders,
                    const SubstepPhysics& physics, ContactNotes* notes) {
  for (int round = 0; round < sweeps_max; ++round) {
    bool touched = false;
    for (std::uint32_t c = 0; c < colliders.size(); ++c) {
      const SolidMove& solid = colliders[c];
      if (std::holds_alternative<MeshShape>(*solid.shape)) continue;  // its surface meets the body's
      const double offset_m = body.body.surface.thickness_m + solid.surface->thickness_m;
      if (!may_meet(bounds, solid, offset_m, physics.dt_s)) continue;
      touched = meet_collider(body, bounds, solid, c, physics, notes) || touched;
    }
    if (!touched || colliders.size() == 1) break;
    fit_boxes(body, bounds);
  }
}

template <class Real>
bool meet_rigid(SoftState<Real>& body, BodyBounds& bounds, RigidState& rigid, std::uint32_t index,
                const SubstepPhysics& physics, ContactNotes* notes) {
  const SolidMove solid = move_of(rigid, physics.dt_s);
  const ContactSurface surface = combine(body.body.surface, rigid.body.surface);
  if (!may_meet(bounds, solid, surface.thickness_m, physics.dt_s)) return false;
  const Tolerances tolerances = tolerances_of(body, bounds);
  Pressure<Real> pressure(body, tolerances.touching_m, physics.resting_m_s);
  const RigidInverse inverse{inverse_masses_1_kg(rigid), inverse_inertia_1_kg_m2(rigid)};
  bool touched = false;
  for_near_vertices(body, solid, surface.thickness_m, [&](std::size_t i) {
    if (!within_speed(body.v[i])) return;
    const Vec3d start = body.position_m(i);
    Vec3d end = start + body.dr[i].template cast<double>();
    const bool pinned = body.is_pinned(i);
    const double inverse_mass_1_kg = pinned ? 0.0 : 1.0 / body.mass_kg(i);
    Vec3d velocity = body.v[i].template cast<double>();
    Vec3d push_m = Vec3d::Zero();
    const auto answer = [&](const Vec3d& normal, const Vec3d& arm, double gap_m, double) -> Vec3d {
      const Touch touch{rigid, inverse, inverse_mass_1_kg, arm};
      const Vec3d relative = touch.relative(velocity);
      const double impact_m_s = pressure.presses(normal, gap_m, velocity - relative)
                                    ? 0.0
                                    : impact_speed(relative.dot(normal), 0.0, physics.resting_m_s);
      if (notes != nullptr) {
        notes->push_back({static_cast<std::uint32_t>(i), VertexContact::Other::rigid, index, normal});
      }
      if (pinned) push_m = pin_push_share * std::min(gap_m, 0.0) * normal;
      const auto by_impulse = [&](const Vec3d& impulse_n_s) { return touch.change_m_s(impulse_n_s); };
      touch.push(velocity, contact_impulse(relative, normal, impact_m_s, surface, by_impulse));
      return touch.relative(velocity);
    };
    if (!stop_at(solid, surface.thickness_m, tolerances.skin_m, physics.dt_s, start, end, answer)) return;
    touched = true;
    if (pinned) {
      rigid.position += free_part(rigid.body.locked.translation, push_m);
      return;
    }
    body.dr[i] = (end - start).template cast<Real>();
    body.v[i] = velocity.template cast<Real>();
  });
  bounds.stale = bounds.stale || touched;
  return touched;
}

#define PNEUMA_INSTANTIATE(Real)                                                                                 \
  template void meet_colliders(SoftState<Real>&, BodyBounds&, std::span<const SolidMove>, const SubstepPhysics&, \
                               ContactNotes*);                                                                   \
  template bool meet_rigid(SoftState<Real>&, BodyBounds&, RigidState&, std::uint32_t, const SubstepPhysics&,     \
                           ContactNotes*);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
