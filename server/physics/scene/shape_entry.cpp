#include "physics/scene/shape_entry.h"

#include <algorithm>
#include <cmath>

#include "physics/scene/shape.h"

namespace pneuma::physics {
namespace {

/// Where start + f (end - start), 0 <= f <= 1, runs into the ball from outside.
std::optional<double> enter_ball(const Vec3d& start, const Vec3d& way, double radius_m) {
  const double towards = start.dot(way);
  const double outside = start.squaredNorm() - radius_m * radius_m;
  const double length2 = way.squaredNorm();
  const double discriminant = towards * towards - length2 * outside;
  if (towards >= 0.0 || discriminant <= 0.0 || length2 == 0.0) return std::nullopt;
  const double fraction = outside / (-towards + std::sqrt(discriminant));
  if (fraction > 1.0) return std::nullopt;
  return std::max(0.0, fraction);
}

std::optional<double> enter_box(const Vec3d& half, const Vec3d& start, const Vec3d& way) {
  double enter = 0.0;
  double leave = 1.0;
  for (int k = 0; k < 3; ++k) {
    if (way[k] == 0.0) {
      if (std::abs(start[k]) >= half[k]) return std::nullopt;
      continue;
    }
    const double near = ((way[k] > 0.0 ? -half[k] : half[k]) - start[k]) / way[k];
    const double far = ((way[k] > 0.0 ? half[k] : -half[k]) - start[k]) / way[k];
    enter = std::max(enter, near);
    leave = std::min(leave, far);
  }
  if (enter >= leave) return std::nullopt;
  return enter;
}

std::optional<double> enter_capsule(double radius_m, double half_height_m, const Vec3d& start, const Vec3d& way) {
  std::optional<double> first;
  const auto take = [&first](std::optional<double> f) {
    if (f && (!first || *f < *first)) first = f;
  };
  take(enter_ball(start - half_height_m * Vec3d::UnitY(), way, radius_m));
  take(enter_ball(start + half_height_m * Vec3d::UnitY(), way, radius_m));
  const std::optional<double> side =
      enter_ball(Vec3d(start.x(), 0.0, start.z()), Vec3d(way.x(), 0.0, way.z()), radius_m);
  if (side && std::abs(start.y() + *side * way.y()) <= half_height_m) take(side);
  return first;
}

/// Of a convex solid, shrunk by the skin so that what slides on the surface does not enter it.
std::optional<double> enter(const Shape& shape, const Vec3d& start, const Vec3d& way, double offset_m, double skin_m) {
  const double offset = offset_m - skin_m;
  if (const auto* sphere = std::get_if<SphereShape>(&shape)) return enter_ball(start, way, sphere->radius_m + offset);
  if (const auto* box = std::get_if<BoxShape>(&shape))
    return enter_box(box->half_extents_m.array() + offset, start, way);
  if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) {
    return enter_capsule(capsule->radius_m + offset, capsule->half_height_m, start, way);
  }
  const Vec3d radii = std::get<EllipsoidShape>(shape).radii_m.array() + offset;
  return enter_ball(start.cwiseQuotient(radii), way.cwiseQuotient(radii), 1.0);
}

std::optional<SurfaceHit> hit_plane(const Vec3d& normal, double offset_m, const Vec3d& start, const Vec3d& end,
                                    double skin_m) {
  const double after = normal.dot(end) - offset_m;
  if (after >= -skin_m) return std::nullopt;
  const double before = normal.dot(start) - offset_m;
  const double fraction = before > 0.0 ? before / (before - after) : 0.0;
  const Vec3d at = start + fraction * (end - start);
  return SurfaceHit{fraction, normal, at - (normal.dot(at) - offset_m) * normal};
}

std::optional<SurfaceHit> hit_room(const Vec3d& half, const Vec3d& start, const Vec3d& end, double skin_m) {
  int wall = -1;
  double fraction = 2.0;
  for (int k = 0; k < 3; ++k) {
    const double after = std::abs(end[k]) - half[k];
    if (after <= skin_m) continue;
    const double before = (end[k] < 0.0 ? -start[k] : start[k]) - half[k];
    const double f = before < 0.0 ? before / (before - after) : 0.0;
    if (f < fraction) {
      fraction = f;
      wall = k;
    }
  }
  if (wall < 0) return std::nullopt;
  const double side = end[wall] < 0.0 ? -1.0 : 1.0;
  SurfaceHit hit{fraction, Vec3d::Zero(), start + fraction * (end - start)};
  hit.normal[wall] = -side;
  hit.point[wall] = side * half[wall];
  return hit;
}

}  // namespace

std::optional<SurfaceHit> first_hit(const Shape& shape, const Vec3d& start, const Vec3d& end, double offset_m,
                                    double skin_m) {
  if (const auto* plane = std::get_if<PlaneShape>(&shape))
    return hit_plane(plane->normal, offset_m, start, end, skin_m);
  if (const auto* room = std::get_if<RoomShape>(&shape)) {
    return hit_room((room->half_extents_m.array() - offset_m).cwiseMax(0.0), start, end, skin_m);
  }
  const SurfacePoint from = nearest_surface(shape, start, offset_m);
  const Vec3d way = end - start;
  if (from.distance_m < 0.0) {
    const bool leaves = way.dot(from.normal) >= 0.0 && surface_distance(shape, end, offset_m) >= -skin_m;
    if (leaves) return std::nullopt;
    return SurfaceHit{0.0, from.normal, from.point};
  }
  const std::optional<double> fraction = enter(shape, start, way, offset_m, skin_m);
  if (!fraction) return std::nullopt;
  const SurfacePoint at = nearest_surface(shape, start + *fraction * way, offset_m);
  return SurfaceHit{*fraction, at.normal, at.point};
}

}  // namespace pneuma::physics
