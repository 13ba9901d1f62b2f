#include "physics/contact/lumped_solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include "physics/contact/solid_features.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/scene/shape_entry.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

// Of what the fastest of a body's vertices would go in the span: what is that near a solid has a row.
constexpr double reach_share = 1.3;

// A vertex that was missed and is no deeper than this share of its body's spacing is on the surface.
constexpr double on_surface_share = 1e-9;

// A normal is that of a face where the two differ by no more than this.
constexpr double same_normal = 1e-9;
// And a plane another, where their levels differ by no more than this share.
constexpr double same_level = 1e-9;

// The face of a box that a point of its surface is on, by its normal, if it is this far from the face's border.
std::optional<Vec3d> face_normal(const BoxShape& box, const Vec3d& normal, const Vec3d& point, double border_m) {
  Eigen::Index along = 0;
  if (normal.cwiseAbs().maxCoeff(&along) < 1.0 - same_normal) return std::nullopt;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (axis != along && std::abs(point[axis]) > box.half_extents_m[axis] - border_m) return std::nullopt;
  }
  return sign_of(normal[along]) * Vec3d::Unit(along);
}

// The same of a convex mesh.
std::optional<Vec3d> face_normal(const ConvexShape& convex, const Vec3d& normal, const Vec3d& point, double border_m) {
  std::optional<Vec3d> of_face;
  for (const Polyhedron::Side& side : convex.solid->sides) {
    if ((side.normal - normal).norm() < same_normal) {
      of_face = side.normal;
    } else if (side.normal.dot(point) > side.level_m - border_m) {
      return std::nullopt;
    }
  }
  return of_face;
}

// The walls that a point in the solid's frame is past: a bit each, as rows number them.
std::uint8_t walls_behind(const Shape& shape, const Vec3d& local, double offset_m) {
  if (const auto* plane = std::get_if<PlaneShape>(&shape)) return plane->normal.dot(local) < offset_m ? 1 : 0;
  const Vec3d inner = std::get<RoomShape>(shape).half_extents_m.array() - offset_m;
  unsigned walls = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    walls |= local[axis] < -inner[axis] ? 1U << (2 * axis) : local[axis] > inner[axis] ? 2U << (2 * axis) : 0U;
  }
  return static_cast<std::uint8_t>(walls);
}

// Whether all of a box may be told to be past none.
bool is_clear_of_walls(const Shape& shape, const Frame& at, const Box& box, double offset_m) {
  const Vec3d middle = at.to_local(0.5 * (box.low + box.high));
  const Vec3d half = at.rotation.transpose().cwiseAbs() * (0.5 * (box.high - box.low));
  if (const auto* plane = std::get_if<PlaneShape>(&shape)) {
    return plane->normal.dot(middle) - plane->normal.cwiseAbs().dot(half) >= offset_m;
  }
  return walls_behind(shape, middle.cwiseAbs() + half, offset_m) == 0;
}

}  // namespace

template <class Real>
void LumpedSolids<Real>::take_solids(const ContactWorld<Real>& world) {
  solids_.clear();
  const auto take = [&](const auto& of_scene, bool is_rigid, std::uint32_t index, bool is_still) {
    Solid& solid = solids_.emplace_back();
    solid.shape = &of_scene.shape;
    solid.surface = &of_scene.surface;
    solid.is_rigid = is_rigid;
    solid.index = index;
    solid.is_still = is_still;
  };
  for (std::uint32_t r = 0; r < world.rigid.size(); ++r) take(world.rigid[r].body, true, r, false);
  for (std::uint32_t c = 0; c < world.colliders.size(); ++c) {
    const Collider& collider = world.colliders[c].collider;
    take(collider, false, c, !is_moving(collider));
  }
  move_solids(world);
  for (Solid& solid : solids_) solid.start = solid.at;
}

// To where the substep finds them.
template <class Real>
void LumpedSolids<Real>::move_solids(const ContactWorld<Real>& world) {
  const double dt_s = world.substep.dt_s;
  for (Solid& solid : solids_) {
    if (solid.is_still && solid.is_placed) continue;
    solid.is_placed = true;
    if (solid.is_rigid) {
      const RigidState& state = world.rigid[solid.index];
      solid.at = {state.position, state.orientation};
      solid.velocity = state.velocity;
      solid.angular_velocity = state.angular_velocity;
    } else {
      const ColliderState& state = world.colliders[solid.index];
      solid.at = {state.position, state.orientation};
      solid.velocity = state.collider.velocity;
      solid.angular_velocity = state.collider.angular_velocity;
    }
    solid.end = solid.at;
    solid.end.origin += dt_s * solid.velocity;
    if (solid.angular_velocity.isZero(0.0)) continue;
    solid.end.rotation = turned(Quatd(solid.at.rotation), solid.angular_velocity, dt_s).toRotationMatrix();
  }
  for (Plane& plane : planes_) {
    const Solid& solid = solids_[plane.solid];
    plane.normal = solid.at.rotation * plane.normal_local;
    plane.end_normal = solid.end.rotation * plane.normal_local;
    plane.at_m = plane.normal.dot(solid.at.origin) + plane.level_m;
    plane.end_m = plane.end_normal.dot(solid.end.origin) + plane.level_m;
  }
}

template <class Real>
void LumpedSolids<Real>::find_rows(const ContactWorld<Real>& world, std::span<const SurfaceBody> surfaces,
                                   std::span<const std::uint32_t> soft, std::uint32_t first, double substeps,
                                   std::vector<ContactRow>& rows) {
  tracks_.clear();
  planes_.clear();
  take_solids(world);
  const double span_s = substeps * world.substep.dt_s;
  places_.clear();
  for (std::uint32_t k = 0; k < solids_.size(); ++k) {
    const Solid& solid = solids_[k];
    SolidPlace& place = places_.emplace_back();
    place.shape = solid.shape;
    place.surface = solid.surface;
    place.response = first + k;
    place.yields = solid.is_rigid;
    place.at = solid.at;
    place.velocity = place.ahead = solid.velocity;
    place.angular_velocity = place.ahead_turning = solid.angular_velocity;
    set_way(place, span_s);
  }
  for (const std::uint32_t i : soft) {
    for (std::uint32_t k = 0; k < solids_.size(); ++k) {
      const Solid& solid = solids_[k];
      if (solid.is_rigid && !is_active(world.rigid[solid.index])) continue;
      const bool is_awake = world.soft[i].is_awake() || (solid.is_rigid && world.rigid[solid.index].is_awake());
      if (!is_awake || !may_meet(surfaces[i], surfaces[i].way, places_[k])) continue;
      const std::size_t before = rows.size();
      finder_.find(skin_move_of(surfaces[i], surfaces[i].from), i, places_[k], span_s, reach_share, rows);
      for (std::size_t r = before; r < rows.size(); ++r) track(rows[r], surfaces[i], k);
    }
  }
}

template <class Real>
void LumpedSolids<Real>::track(const ContactRow& row, const SurfaceBody& surface, std::uint32_t index) {
  const Solid& solid = solids_[index];
  Track& track = tracks_.emplace_back();
  track.solid = index;
  track.soft = row.first.body;
  track.offset_m = surface.surface.thickness_m + solid.surface->thickness_m;
  const Vec3d place = mean_of(row.first, surface.from);
  track.normal_local = solid.at.rotation.transpose() * row.normal;
  track.point_local = solid.at.to_local(place - row.gap_m * row.normal);
  if (row.first.count == 2) {
    track.by = By::edge;
    track.slack_m = edge_slack_share * surface.spacing_m;
    return;
  }
  if (row.first.count == 3) return track_face(row, surface, solid, track);
  track.vertex = row.first.vertices[0];
  if (!has_features(*solid.shape)) track.walls = static_cast<std::uint8_t>(1U << (row.key.features & 0xffU));
  const double border_m = reach_share * finder_.furthest_m();
  const auto normal_local = std::visit(
      [&]<class S>(const S& shape) -> std::optional<Vec3d> {
        if constexpr (std::is_same_v<S, BoxShape> || std::is_same_v<S, ConvexShape>) {
          return face_normal(shape, track.normal_local, track.point_local, border_m);
        } else {
          return std::nullopt;
        }
      },
      *solid.shape);
  if (has_features(*solid.shape) && !normal_local) return;
  track.by = By::plane;
  const Vec3d normal = normal_local.value_or(track.normal_local);
  track.plane = plane_of(index, normal, normal.dot(track.point_local));
}

template <class Real>
void LumpedSolids<Real>::track_face(const ContactRow& row, const SurfaceBody& surface, const Solid& solid,
                                    Track& track) const {
  track.by = By::face;
  track.radius_m =
      of_rigid_shape(*solid.shape, 0.0, [](const auto& rigid, const auto& one) { return rigid.knobs(one).radius_m; });
  track.knob_local = track.point_local - (track.radius_m + track.offset_m) * track.normal_local;
  track.through_m = through_share * surface.spacing_m;
  const auto at = [&](std::size_t i) -> const Vec3d& { return surface.from[row.first.vertices[i]]; };
  track.along_normal = (at(1) - at(0)).cross(at(2) - at(0)).dot(row.normal) > 0.0;
}

// Rows of one solid follow each other, and its planes are few.
template <class Real>
std::uint32_t LumpedSolids<Real>::plane_of(std::uint32_t solid, const Vec3d& normal_local, double level_m) {
  const auto is_it = [&](const Plane& plane) {
    return plane.solid == solid && (plane.normal_local - normal_local).norm() < same_normal &&
           std::abs(plane.level_m - level_m) < same_level * (1.0 + std::abs(level_m));
  };
  const auto known = std::ranges::find_if(planes_, is_it);
  if (known != planes_.end()) return static_cast<std::uint32_t>(known - planes_.begin());
  planes_.push_back({.solid = solid, .normal_local = normal_local, .level_m = level_m});
  return static_cast<std::uint32_t>(planes_.size() - 1);
}

template <class Real>
void LumpedSolids<Real>::measure(const ContactWorld<Real>& world, std::size_t first_row, LumpedSolver& solver,
                                 const LumpedSolver::Values& places_m, LumpedSolver::Values& velocities_m_s,
                                 LumpedSolver::Values& moves_m, const Gaps& gaps) {
  move_solids(world);
  for (std::size_t k = 0; k < tracks_.size(); ++k) {
    Track& track = tracks_[k];
    const Solid& solid = solids_[track.solid];
    const std::size_t row = first_row + k;
    const bool is_feature = track.by == By::edge || track.by == By::face;
    if (is_feature && !find_touch(track, solid, row, solver, places_m)) {
      solver.let_go(row);
      gaps.start_m[row] = gaps.end_m[row] = std::numeric_limits<double>::infinity();
      gaps.opening_m_s[row] = 0.0;
      continue;
    }
    const Vec3d point = solver.at_skin(row, places_m);
    const Vec3d move_m = solver.at_skin(row, moves_m);
    Place at = place_at(track, point);
    double end_m = place_at_end(track, point + move_m).gap_m;
    if (track.by == By::shape && at.gap_m > 0.0) find_way_in(track, solid, point, move_m, at, end_m);
    track.velocity_m_s = velocity_at(solid.velocity, solid.angular_velocity, at.arm);
    gaps.start_m[row] = at.gap_m;
    gaps.end_m[row] = end_m;
    gaps.opening_m_s[row] = at.normal.dot(solver.at_skin(row, velocities_m_s) - track.velocity_m_s);
    if (solid.is_still && track.by == By::plane) continue;
    solver.turn(row, at.normal, at.arm);
    if (solid.is_rigid) continue;
    const std::size_t slot = 4 * solver.point_slot(row);
    Vec3d::Map(velocities_m_s.data() + slot) = track.velocity_m_s;
    Vec3d::Map(moves_m.data() + slot) = world.substep.dt_s * track.velocity_m_s;
  }
}

// Where an edge or a face meets the solid now, if it does between its vertices.
template <class Real>
bool LumpedSolids<Real>::find_touch(Track& track, const Solid& solid, std::size_t row, LumpedSolver& solver,
                                    const LumpedSolver::Values& places_m) {
  const auto corner = [&](std::size_t i) -> Vec3d {
    return solid.at.to_local(Vec3d::Map(places_m.data() + 4 * solver.corner_slot(row, i)));
  };
  const Vec3d a = corner(0);
  const Vec3d b = corner(1);
  if (track.by == By::edge) {
    const auto touch =
        touch_of_edge(*solid.shape, track.offset_m, a, nearest_surface(*solid.shape, a, track.offset_m), b,
                      nearest_surface(*solid.shape, b, track.offset_m), track.slack_m, (b - a).norm());
    if (!touch) return false;
    track.normal_local = touch->of_solid.normal;
    track.point_local = a + touch->share * (b - a) - touch->of_solid.distance_m * track.normal_local;
    solver.share(row, std::array{1.0 - touch->share, touch->share});
    return true;
  }
  const auto touch = touch_of_face(track.knob_local, a, b, corner(2), track.along_normal, track.through_m);
  if (!touch) return false;
  track.normal_local = touch->normal;
  track.point_local = track.knob_local + (track.radius_m + track.offset_m) * touch->normal;
  solver.share(row, touch->foot.weights);
  return true;
}

template <class Real>
auto LumpedSolids<Real>::place_at(const Track& track, const Vec3d& point) const -> Place {
  const Solid& solid = solids_[track.solid];
  if (track.by != By::plane) return place_of(track, solid, solid.at, point);
  const Plane& plane = planes_[track.plane];
  return place_on(plane.normal, plane.at_m, solid.at, point);
}

template <class Real>
auto LumpedSolids<Real>::place_at_end(const Track& track, const Vec3d& point) const -> Place {
  const Solid& solid = solids_[track.solid];
  if (track.by != By::plane) return place_of(track, solid, solid.end, point);
  const Plane& plane = planes_[track.plane];
  return place_on(plane.end_normal, plane.end_m, solid.end, point);
}

template <class Real>
auto LumpedSolids<Real>::place_on(const Vec3d& normal, double level_m, const Frame& at, const Vec3d& point) -> Place {
  const double gap_m = normal.dot(point) - level_m;
  return {normal, point - gap_m * normal - at.origin, gap_m};
}

// With the solid at a frame, of a row that is of no plane.
template <class Real>
auto LumpedSolids<Real>::place_of(const Track& track, const Solid& solid, const Frame& at, const Vec3d& point)
    -> Place {
  if (track.by == By::shape) {
    const SurfacePoint nearest = nearest_surface(*solid.shape, at.to_local(point), track.offset_m);
    return {at.rotation * nearest.normal, at.rotation * nearest.point, nearest.distance_m};
  }
  const Vec3d normal = at.rotation * track.normal_local;
  const Vec3d arm = at.rotation * track.point_local;
  return {normal, arm, normal.dot(point - at.origin - arm)};
}

// What is nearest of the solid where the move begins is not what a long move comes to, and a thin solid may lie
// between.
template <class Real>
void LumpedSolids<Real>::find_way_in(const Track& track, const Solid& solid, const Vec3d& point, const Vec3d& move_m,
                                     Place& at, double& end_m) {
  const Vec3d start = solid.at.to_local(point);
  const Vec3d end = solid.end.to_local(point + move_m);
  if ((end - start).squaredNorm() < at.gap_m * at.gap_m) return;
  const auto hit = first_hit(*solid.shape, start, end, track.offset_m, 0.0);
  if (!hit) return;
  at = {solid.at.rotation * hit->normal, solid.at.rotation * hit->point, (start - hit->point).dot(hit->normal)};
  end_m = (end - hit->point).dot(hit->normal);
}

template <class Real>
Vec3d LumpedSolids<Real>::move_to_slide_m(std::size_t row, const Vec3d& place, const Vec3d& move_m, double share,
                                          const Vec3d& slide_m) const {
  const Solid& solid = solids_[tracks_[row].solid];
  const Vec3d start = solid.at.to_local(place);
  const Vec3d end = solid.end.to_local(place + move_m);
  const Vec3d slid = start + share * (end - start) + solid.end.rotation.transpose() * slide_m;
  return solid.end.to_world(slid) - place;
}

template <class Real>
auto LumpedSolids<Real>::end_gap(std::size_t row, const Vec3d& point) const -> EndGap {
  const Place end = place_at_end(tracks_[row], point);
  return {end.normal, end.gap_m};
}

template <class Real>
bool LumpedSolids<Real>::stop_missed(const ContactWorld<Real>& world, std::span<const SurfaceBody> surfaces,
                                     std::span<const std::uint32_t> soft) {
  move_solids(world);
  for (std::uint32_t k = 0; k < solids_.size(); ++k) {
    const Solid& solid = solids_[k];
    places_[k].at = solid.start;
    places_[k].ahead = solid.end.origin - solid.start.origin;
    set_way(places_[k], 1.0);
  }
  bool any = false;
  auto track = tracks_.begin();
  for (const std::uint32_t i : soft) {
    if (!world.soft[i].is_awake()) continue;
    const Box way = surfaces[i].box_of_moves();
    for (std::uint32_t k = 0; k < solids_.size(); ++k) {
      const Solid& solid = solids_[k];
      if (is_surface(*solid.shape) || (solid.is_rigid && !is_active(world.rigid[solid.index]))) continue;
      if (!may_meet(surfaces[i], way, places_[k])) continue;
      const double offset_m = surfaces[i].surface.thickness_m + solid.surface->thickness_m;
      if (!has_features(*solid.shape) && is_clear_of_walls(*solid.shape, solid.end, way, offset_m)) continue;
      has_row_.assign(surfaces[i].to.size(), 0);
      while (track != tracks_.end() && std::pair(track->soft, track->solid) < std::pair(i, k)) ++track;
      for (; track != tracks_.end() && track->soft == i && track->solid == k; ++track) {
        if (track->vertex != no_vertex) has_row_[track->vertex] |= track->walls;
      }
      any = stop_missed(world.soft[i], surfaces[i], solid) || any;
    }
  }
  return any;
}

template <class Real>
bool LumpedSolids<Real>::stop_missed(SoftState<Real>& state, const SurfaceBody& surface, const Solid& solid) const {
  const double offset_m = surface.surface.thickness_m + solid.surface->thickness_m;
  const Vec3d outer = half_extents_m(*solid.shape).array() + offset_m;
  const bool is_flat = !has_features(*solid.shape);
  bool any = false;
  for (std::uint32_t v = 0; v < surface.to.size(); ++v) {
    if (has_row_[v] == all_walls || surface.inverse_masses_1_kg[v] == 0.0) continue;
    const Vec3d end = solid.end.to_local(surface.to[v]);
    if (is_flat && (walls_behind(*solid.shape, end, offset_m) & ~has_row_[v]) == 0) continue;
    const Vec3d start = solid.start.to_local(surface.from[v]);
    const bool keeps_off =
        (start.cwiseMin(end).array() > outer.array()).any() || (start.cwiseMax(end).array() < -outer.array()).any();
    if (!is_flat && keeps_off) continue;
    const auto hit = first_hit(*solid.shape, start, end, offset_m, on_surface_share * surface.spacing_m);
    if (!hit) continue;
    state.dr[v] = (solid.end.to_world(hit->point) - state.position_m(v)).template cast<Real>();
    any = true;
  }
  return any;
}

template <class Real>
void LumpedSolids<Real>::clear() {
  solids_.clear();
  places_.clear();
  planes_.clear();
  tracks_.clear();
}

template <class Real>
std::size_t LumpedSolids<Real>::bytes() const {
  return solids_.capacity() * sizeof(Solid) + places_.capacity() * sizeof(SolidPlace) +
         tracks_.capacity() * sizeof(Track) + planes_.capacity() * sizeof(Plane) + finder_.bytes() +
         has_row_.capacity();
}

template class LumpedSolids<float>;
template class LumpedSolids<double>;

}  // namespace pneuma::physics
