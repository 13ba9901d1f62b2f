#include "physics/contact/lumped_solids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <variant>

#include "physics/contact/solid_features.h"
#include "physics/scene/shape_entry.h"
#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

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

}  // namespace

template <class Real>
void LumpedSolids<Real>::add(const SpanSolid& solid, const SurfaceBody& surface, double border_m,
                             std::span<const ContactRow> rows) {
  const auto is_it = [&](const SpanSolid& known) {
    return known.is_rigid == solid.is_rigid && known.index == solid.index;
  };
  const auto known = std::ranges::find_if(solids_, is_it);
  const auto index = static_cast<std::uint32_t>(known - solids_.begin());
  if (known == solids_.end()) solids_.push_back(solid);
  for (const ContactRow& row : rows) track(row, surface, index, border_m);
}

// To where the substep finds them.
template <class Real>
void LumpedSolids<Real>::move_solids(const ContactWorld<Real>& world) {
  for (SpanSolid& solid : solids_) solid.move(world.rigid, world.colliders, world.substep.dt_s);
  for (Plane& plane : planes_) {
    const SpanSolid& solid = solids_[plane.solid];
    plane.normal = solid.at.rotation * plane.normal_local;
    plane.end_normal = solid.end.rotation * plane.normal_local;
    plane.at_m = plane.normal.dot(solid.at.origin) + plane.level_m;
    plane.end_m = plane.end_normal.dot(solid.end.origin) + plane.level_m;
  }
}

template <class Real>
void LumpedSolids<Real>::track(const ContactRow& row, const SurfaceBody& surface, std::uint32_t index,
                               double border_m) {
  const SpanSolid& solid = solids_[index];
  Track& track = tracks_.emplace_back();
  track.solid = index;
  track.offset_m = surface.surface.thickness_m + solid.surface->thickness_m;
  const Vec3d place = mean_of(row.first, surface.from);
  const Vec3d normal_local = solid.at.rotation.transpose() * row.normal;
  const Vec3d point_local = solid.at.to_local(place - row.gap_m * row.normal);
  if (row.first.count > 1) {
    track.by = row.first.count == 2 ? By::edge : By::face;
    track.index = static_cast<std::uint32_t>(features_.size());
    Feature& feature = features_.emplace_back();
    feature.normal_local = normal_local;
    feature.point_local = point_local;
    feature.slack_m = edge_slack_share * surface.spacing_m;
    if (track.by == By::face) track_face(row, surface, solid, track.offset_m, feature);
    return;
  }
  const auto of_face = std::visit(
      [&]<class S>(const S& shape) -> std::optional<Vec3d> {
        if constexpr (std::is_same_v<S, BoxShape> || std::is_same_v<S, ConvexShape>) {
          return face_normal(shape, normal_local, point_local, border_m);
        } else {
          return std::nullopt;
        }
      },
      *solid.shape);
  if (has_features(*solid.shape) && !of_face) return;
  track.by = By::plane;
  const Vec3d normal = of_face.value_or(normal_local);
  track.index = plane_of(index, normal, normal.dot(point_local));
}

template <class Real>
void LumpedSolids<Real>::track_face(const ContactRow& row, const SurfaceBody& surface, const SpanSolid& solid,
                                    double offset_m, Feature& feature) {
  feature.radius_m =
      of_rigid_shape(*solid.shape, 0.0, [](const auto& rigid, const auto& one) { return rigid.knobs(one).radius_m; });
  feature.knob_local = feature.point_local - (feature.radius_m + offset_m) * feature.normal_local;
  feature.through_m = through_share * surface.spacing_m;
  const auto at = [&](std::size_t i) -> const Vec3d& { return surface.from[row.first.vertices[i]]; };
  feature.along_normal = (at(1) - at(0)).cross(at(2) - at(0)).dot(row.normal) > 0.0;
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
    const SpanSolid& solid = solids_[track.solid];
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
    double end_m = gap_at_end_m(track, point + move_m);
    if (track.by == By::shape && at.gap_m > 0.0) find_way_in(track, solid, point, move_m, at, end_m);
    track.velocity_m_s = velocity_at(solid.velocity, solid.angular_velocity, at.arm);
    gaps.start_m[row] = at.gap_m;
    gaps.end_m[row] = end_m;
    gaps.opening_m_s[row] = at.normal.dot(solver.at_skin(row, velocities_m_s) - track.velocity_m_s);
    if (solid.is_still && track.by == By::plane) continue;
    solver.turn(row, at.normal, at.arm);
    if (solid.is_rigid || solid.is_still) continue;
    const std::size_t slot = 4 * solver.point_slot(row);
    Vec3d::Map(velocities_m_s.data() + slot) = track.velocity_m_s;
    Vec3d::Map(moves_m.data() + slot) = world.substep.dt_s * track.velocity_m_s;
  }
}

// Where an edge or a face meets the solid now, if it does between its vertices.
template <class Real>
bool LumpedSolids<Real>::find_touch(const Track& track, const SpanSolid& solid, std::size_t row, LumpedSolver& solver,
                                    const LumpedSolver::Values& places_m) {
  const auto corner = [&](std::size_t i) -> Vec3d {
    return solid.at.to_local(Vec3d::Map(places_m.data() + 4 * solver.corner_slot(row, i)));
  };
  const Vec3d a = corner(0);
  const Vec3d b = corner(1);
  Feature& feature = features_[track.index];
  if (track.by == By::edge) {
    const auto touch =
        touch_of_edge(*solid.shape, track.offset_m, a, nearest_surface(*solid.shape, a, track.offset_m), b,
                      nearest_surface(*solid.shape, b, track.offset_m), feature.slack_m, (b - a).norm());
    if (!touch) return false;
    feature.normal_local = touch->of_solid.normal;
    feature.point_local = a + touch->share * (b - a) - touch->of_solid.distance_m * feature.normal_local;
    solver.share(row, std::array{1.0 - touch->share, touch->share});
    return true;
  }
  const auto touch = touch_of_face(feature.knob_local, a, b, corner(2), feature.along_normal, feature.through_m);
  if (!touch) return false;
  feature.normal_local = touch->normal;
  feature.point_local = feature.knob_local + (feature.radius_m + track.offset_m) * touch->normal;
  solver.share(row, touch->foot.weights);
  return true;
}

template <class Real>
auto LumpedSolids<Real>::place_at(const Track& track, const Vec3d& point) const -> Place {
  const SpanSolid& solid = solids_[track.solid];
  if (track.by != By::plane) return place_of(track, solid, solid.at, point);
  const Plane& plane = planes_[track.index];
  return place_on(plane.normal, plane.at_m, solid.at, point);
}

template <class Real>
auto LumpedSolids<Real>::place_at_end(const Track& track, const Vec3d& point) const -> Place {
  const SpanSolid& solid = solids_[track.solid];
  if (track.by != By::plane) return place_of(track, solid, solid.end, point);
  const Plane& plane = planes_[track.index];
  return place_on(plane.end_normal, plane.end_m, solid.end, point);
}

template <class Real>
double LumpedSolids<Real>::gap_at_end_m(const Track& track, const Vec3d& point) const {
  if (track.by != By::plane) return place_at_end(track, point).gap_m;
  const Plane& plane = planes_[track.index];
  return plane.end_normal.dot(point) - plane.end_m;
}

template <class Real>
auto LumpedSolids<Real>::place_on(const Vec3d& normal, double level_m, const Frame& at, const Vec3d& point) -> Place {
  const double gap_m = normal.dot(point) - level_m;
  return {normal, point - gap_m * normal - at.origin, gap_m};
}

// With the solid at a frame, of a row that is of no plane.
template <class Real>
auto LumpedSolids<Real>::place_of(const Track& track, const SpanSolid& solid, const Frame& at, const Vec3d& point) const
    -> Place {
  if (track.by == By::shape) {
    const SurfacePoint nearest = nearest_surface(*solid.shape, at.to_local(point), track.offset_m);
    return {at.rotation * nearest.normal, at.rotation * nearest.point, nearest.distance_m};
  }
  const Vec3d normal = at.rotation * features_[track.index].normal_local;
  const Vec3d arm = at.rotation * features_[track.index].point_local;
  return {normal, arm, normal.dot(point - at.origin - arm)};
}

// What is nearest of the solid where the move begins is not what a long move comes to, and a thin solid may lie
// between.
template <class Real>
void LumpedSolids<Real>::find_way_in(const Track& track, const SpanSolid& solid, const Vec3d& point,
                                     const Vec3d& move_m, Place& at, double& end_m) {
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
  const SpanSolid& solid = solids_[tracks_[row].solid];
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
void LumpedSolids<Real>::clear() {
  solids_.clear();
  planes_.clear();
  features_.clear();
  tracks_.clear();
}

template <class Real>
std::size_t LumpedSolids<Real>::bytes() const {
  return solids_.capacity() * sizeof(SpanSolid) + tracks_.capacity() * sizeof(Track) +
         planes_.capacity() * sizeof(Plane) + features_.capacity() * sizeof(Feature);
}

template class LumpedSolids<float>;
template class LumpedSolids<double>;

}  // namespace pneuma::physics
