#include "physics/scene/shape_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace pneuma::physics {
namespace {

// Newton doubles the digits once it is near; from the bound it starts at, 12 iterations were enough at every axis ratio
// to 1:1000.
constexpr int newton_iterations_max = 32;

SurfacePoint nearest_on_ball(const Vec3d& centre, double radius_m, const Vec3d& p) {
  const Vec3d d = p - centre;
  const double length = d.norm();
  const Vec3d normal = length > 0.0 ? Vec3d(d / length) : Vec3d::UnitY();
  return {length - radius_m, normal, centre + radius_m * normal};
}

SurfacePoint nearest_on_box(const Vec3d& half, const Vec3d& p) {
  const Vec3d over = p.cwiseAbs() - half;
  if ((over.array() <= 0.0).all()) {
    Eigen::Index axis = 0;
    const double distance = over.maxCoeff(&axis);
    const double side = sign_of(p[axis]);
    SurfacePoint s{distance, Vec3d::Zero(), p};
    s.normal[axis] = side;
    s.point[axis] = side * half[axis];
    return s;
  }
  const Vec3d nearest = p.cwiseMax(-half).cwiseMin(half);
  const Vec3d d = p - nearest;
  const double distance = d.norm();
  return {distance, d / distance, nearest};
}

SurfacePoint nearest_on_room(const Vec3d& half, const Vec3d& p) {
  SurfacePoint s = nearest_on_box(half, p);
  s.distance_m = -s.distance_m;
  s.normal = -s.normal;
  return s;
}

// With y_i = r_i^2 p_i / (t + r_i^2) on the surface: g(t) = sum (r_i p_i / (t + r_i^2))^2 - 1 = 0, g falling and
// convex.
SurfacePoint nearest_on_ellipsoid(const Vec3d& radii, const Vec3d& p) {
  // Off the axes by round-off: there the nearest point is not unique, and any will do.
  const Vec3d a = p.cwiseAbs().cwiseMax(1e-12 * radii);
  const Vec3d square = radii.cwiseProduct(radii);
  double t = (radii.cwiseProduct(a) - square).maxCoeff();  // g >= 0 here
  for (int i = 0; i < newton_iterations_max; ++i) {
    const Vec3d denominator = square.array() + t;
    const Vec3d ratio = radii.cwiseProduct(a).cwiseQuotient(denominator);
    const double g = ratio.squaredNorm() - 1.0;
    const double slope = -2.0 * ratio.cwiseProduct(ratio).cwiseQuotient(denominator).sum();
    const double step = g / slope;
    t -= step;
    if (std::abs(step) <= 1e-15 * square.maxCoeff()) break;
  }
  Vec3d nearest;
  for (int k = 0; k < 3; ++k) nearest[k] = sign_of(p[k]) * square[k] * a[k] / (t + square[k]);
  nearest /= nearest.cwiseQuotient(radii).norm();
  const Vec3d normal = nearest.cwiseQuotient(square).normalized();
  const double distance = (p - nearest).norm();
  const bool inside = p.cwiseQuotient(radii).squaredNorm() < 1.0;
  return {inside ? -distance : distance, normal, nearest};
}

// A mesh has two sides: nothing is in it.
SurfacePoint nearest_on_mesh(const Mesh& mesh, double offset_m, const Vec3d& p) {
  const MeshPoint nearest = nearest_surface_point(mesh.positions_m, mesh.faces, p);
  const auto& [a, b, c] = mesh.faces[nearest.face];
  const Vec3d across = (mesh.positions_m[b] - mesh.positions_m[a]).cross(mesh.positions_m[c] - mesh.positions_m[a]);
  const Vec3d normal =
      nearest.distance_m > 0.0 ? Vec3d((p - nearest.position_m) / nearest.distance_m) : Vec3d(across.normalized());
  return {nearest.distance_m - offset_m, normal, nearest.position_m + offset_m * normal};
}

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

// Of a convex solid. `enter(start, way, offset)` finds where a point enters it, shrunk by the skin so that what slides
// on the surface does not.
template <class S, class Enter>
std::optional<SurfaceHit> hit_convex(const S& shape, const Vec3d& start, const Vec3d& end, double offset_m,
                                     double skin_m, const Enter& enter) {
  const SurfacePoint from = ShapeParts<S>::nearest(shape, start, offset_m);
  const Vec3d way = end - start;
  if (from.distance_m < 0.0) {
    const bool leaves =
        way.dot(from.normal) >= 0.0 && ShapeParts<S>::nearest(shape, end, offset_m).distance_m >= -skin_m;
    if (leaves) return std::nullopt;
    return SurfaceHit{0.0, from.normal, from.point};
  }
  const std::optional<double> fraction = enter(way, offset_m - skin_m);
  if (!fraction) return std::nullopt;
  const SurfacePoint at = ShapeParts<S>::nearest(shape, start + *fraction * way, offset_m);
  return SurfaceHit{*fraction, at.normal, at.point};
}

Vec3d endless() {
  return Vec3d::Constant(std::numeric_limits<double>::infinity());
}

}  // namespace

SurfacePoint ShapeParts<PlaneShape>::nearest(const PlaneShape& plane, const Vec3d& point, double offset_m) {
  const double distance = plane.normal.dot(point) - offset_m;
  return {distance, plane.normal, point - distance * plane.normal};
}
std::optional<double> ShapeParts<PlaneShape>::hit_m(const PlaneShape& plane, const Ray& ray) {
  const double along = plane.normal.dot(ray.direction.stableNormalized());
  if (along == 0.0) return std::nullopt;
  const double distance_m = -plane.normal.dot(ray.origin_m) / along;
  return distance_m >= 0.0 ? std::optional(distance_m) : std::nullopt;
}
std::optional<SurfaceHit> ShapeParts<PlaneShape>::first_hit(const PlaneShape& plane, const Vec3d& start,
                                                            const Vec3d& end, double offset_m, double skin_m) {
  return hit_plane(plane.normal, offset_m, start, end, skin_m);
}
Vec3d ShapeParts<PlaneShape>::half_extents_m(const PlaneShape&) {
  return endless();
}

SurfacePoint ShapeParts<SphereShape>::nearest(const SphereShape& sphere, const Vec3d& point, double offset_m) {
  return nearest_on_ball(Vec3d::Zero(), sphere.radius_m + offset_m, point);
}
std::optional<double> ShapeParts<SphereShape>::hit_m(const SphereShape& sphere, const Ray& ray) {
  return hit_sphere_m(ray, sphere.radius_m);
}
std::optional<SurfaceHit> ShapeParts<SphereShape>::first_hit(const SphereShape& sphere, const Vec3d& start,
                                                             const Vec3d& end, double offset_m, double skin_m) {
  return hit_convex(sphere, start, end, offset_m, skin_m,
                    [&](const Vec3d& way, double offset) { return enter_ball(start, way, sphere.radius_m + offset); });
}
Vec3d ShapeParts<SphereShape>::half_extents_m(const SphereShape& sphere) {
  return Vec3d::Constant(sphere.radius_m);
}
Vec3d ShapeParts<SphereShape>::Rigid::principal_inertia_kg_m2(const SphereShape& sphere, double mass_kg) {
  return Vec3d::Constant(0.4 * mass_kg * sphere.radius_m * sphere.radius_m);
}
Vec3d ShapeParts<SphereShape>::Rigid::half_box_m(const SphereShape& sphere, const Eigen::Matrix3d&) {
  return Vec3d::Constant(sphere.radius_m);
}
Knobs ShapeParts<SphereShape>::Rigid::knobs(const SphereShape& sphere) {
  Knobs knobs;
  knobs.add(Vec3d::Zero());
  knobs.radius_m = sphere.radius_m;
  return knobs;
}

SurfacePoint ShapeParts<BoxShape>::nearest(const BoxShape& box, const Vec3d& point, double offset_m) {
  return nearest_on_box(box.half_extents_m.array() + offset_m, point);
}
std::optional<double> ShapeParts<BoxShape>::hit_m(const BoxShape& box, const Ray& ray) {
  return hit_box_m(ray, box.half_extents_m);
}
std::optional<SurfaceHit> ShapeParts<BoxShape>::first_hit(const BoxShape& box, const Vec3d& start, const Vec3d& end,
                                                          double offset_m, double skin_m) {
  return hit_convex(box, start, end, offset_m, skin_m, [&](const Vec3d& way, double offset) {
    return enter_box(box.half_extents_m.array() + offset, start, way);
  });
}
Vec3d ShapeParts<BoxShape>::Rigid::principal_inertia_kg_m2(const BoxShape& box, double mass_kg) {
  const Vec3d squares = box.half_extents_m.cwiseAbs2();
  return mass_kg / 3.0 * (Vec3d::Constant(squares.sum()) - squares);
}
Vec3d ShapeParts<BoxShape>::Rigid::half_box_m(const BoxShape& box, const Eigen::Matrix3d& rotation) {
  return rotation.cwiseAbs() * box.half_extents_m;
}
Knobs ShapeParts<BoxShape>::Rigid::knobs(const BoxShape& box) {
  Knobs knobs;
  for (unsigned k = 0; k < 8; ++k) {
    const Vec3d sides((k & 1U) != 0 ? 1.0 : -1.0, (k & 2U) != 0 ? 1.0 : -1.0, (k & 4U) != 0 ? 1.0 : -1.0);
    knobs.add(sides.cwiseProduct(box.half_extents_m));
  }
  return knobs;
}

SurfacePoint ShapeParts<EllipsoidShape>::nearest(const EllipsoidShape& ellipsoid, const Vec3d& point, double offset_m) {
  return nearest_on_ellipsoid(ellipsoid.radii_m.array() + offset_m, point);
}
std::optional<double> ShapeParts<EllipsoidShape>::hit_m(const EllipsoidShape& ellipsoid, const Ray& ray) {
  // As a ball of radius 1, where the way is counted in other units.
  const Vec3d way = ray.direction.stableNormalized().cwiseQuotient(ellipsoid.radii_m);
  const auto distance = hit_sphere_m({ray.origin_m.cwiseQuotient(ellipsoid.radii_m), way}, 1.0);
  return distance ? std::optional(*distance / way.norm()) : std::nullopt;
}
std::optional<SurfaceHit> ShapeParts<EllipsoidShape>::first_hit(const EllipsoidShape& ellipsoid, const Vec3d& start,
                                                                const Vec3d& end, double offset_m, double skin_m) {
  return hit_convex(ellipsoid, start, end, offset_m, skin_m, [&](const Vec3d& way, double offset) {
    const Vec3d radii = ellipsoid.radii_m.array() + offset;
    return enter_ball(start.cwiseQuotient(radii), way.cwiseQuotient(radii), 1.0);
  });
}

SurfacePoint ShapeParts<CapsuleShape>::nearest(const CapsuleShape& capsule, const Vec3d& point, double offset_m) {
  const Vec3d centre(0.0, std::clamp(point.y(), -capsule.half_height_m, capsule.half_height_m), 0.0);
  SurfacePoint nearest = nearest_on_ball(centre, capsule.radius_m + offset_m, point);
  if (point == centre) {  // on the axis: out through the side
    nearest.normal = Vec3d::UnitX();
    nearest.point = centre + (capsule.radius_m + offset_m) * nearest.normal;
  }
  return nearest;
}
std::optional<double> ShapeParts<CapsuleShape>::hit_m(const CapsuleShape& capsule, const Ray& ray) {
  return hit_capsule_m(ray, capsule.radius_m, capsule.half_height_m);
}
std::optional<SurfaceHit> ShapeParts<CapsuleShape>::first_hit(const CapsuleShape& capsule, const Vec3d& start,
                                                              const Vec3d& end, double offset_m, double skin_m) {
  return hit_convex(capsule, start, end, offset_m, skin_m, [&](const Vec3d& way, double offset) {
    return enter_capsule(capsule.radius_m + offset, capsule.half_height_m, start, way);
  });
}
Vec3d ShapeParts<CapsuleShape>::half_extents_m(const CapsuleShape& capsule) {
  return {capsule.radius_m, capsule.half_height_m + capsule.radius_m, capsule.radius_m};
}
Vec3d ShapeParts<CapsuleShape>::Rigid::principal_inertia_kg_m2(const CapsuleShape& capsule, double mass_kg) {
  const double r = capsule.radius_m;
  const double h = capsule.half_height_m;
  const double middle_kg = mass_kg * 2.0 * h / (2.0 * h + 4.0 / 3.0 * r);
  const double ends_kg = mass_kg - middle_kg;
  const double along = (0.5 * middle_kg + 0.4 * ends_kg) * r * r;
  // A half ball's centre of mass is 3/8 r from its flat side.
  const double across = middle_kg * (0.25 * r * r + h * h / 3.0) + ends_kg * (0.4 * r * r + h * h + 0.75 * h * r);
  return {across, along, across};
}
Vec3d ShapeParts<CapsuleShape>::Rigid::half_box_m(const CapsuleShape& capsule, const Eigen::Matrix3d& rotation) {
  const Vec3d end = capsule.half_height_m * rotation.col(1);
  return end.cwiseAbs().array() + capsule.radius_m;
}
Knobs ShapeParts<CapsuleShape>::Rigid::knobs(const CapsuleShape& capsule) {
  Knobs knobs;
  for (const double side : {-1.0, 1.0}) knobs.add(side * capsule.half_height_m * Vec3d::UnitY());
  knobs.radius_m = capsule.radius_m;
  knobs.is_rod = true;
  return knobs;
}

SurfacePoint ShapeParts<RoomShape>::nearest(const RoomShape& room, const Vec3d& point, double offset_m) {
  return nearest_on_room((room.half_extents_m.array() - offset_m).cwiseMax(0.0), point);
}
std::optional<double> ShapeParts<RoomShape>::hit_m(const RoomShape& room, const Ray& ray) {
  return hit_box_m(ray, room.half_extents_m);
}
std::optional<SurfaceHit> ShapeParts<RoomShape>::first_hit(const RoomShape& room, const Vec3d& start, const Vec3d& end,
                                                           double offset_m, double skin_m) {
  return hit_room((room.half_extents_m.array() - offset_m).cwiseMax(0.0), start, end, skin_m);
}
Vec3d ShapeParts<RoomShape>::half_extents_m(const RoomShape&) {
  return endless();
}

SurfacePoint ShapeParts<MeshShape>::nearest(const MeshShape& shape, const Vec3d& point, double offset_m) {
  return nearest_on_mesh(*shape.mesh, offset_m, point);
}
std::optional<double> ShapeParts<MeshShape>::hit_m(const MeshShape& shape, const Ray& ray) {
  const auto hit = physics::first_hit(shape.mesh->positions_m, shape.mesh->faces, ray);
  return hit ? std::optional(hit->distance_m) : std::nullopt;
}
Vec3d ShapeParts<MeshShape>::half_extents_m(const MeshShape& shape) {
  Vec3d half = Vec3d::Zero();
  for (const Vec3d& position : shape.mesh->positions_m) half = half.cwiseMax(position.cwiseAbs());
  return half;
}

// Round at its edges where it is offset: all of that surface is offset_m from the solid's own.
SurfacePoint ShapeParts<ConvexShape>::nearest(const ConvexShape& convex, const Vec3d& point, double offset_m) {
  const PolyhedronPoint nearest = nearest_point(*convex.solid, point);
  return {nearest.distance_m - offset_m, nearest.normal, nearest.position_m + offset_m * nearest.normal};
}
std::optional<double> ShapeParts<ConvexShape>::hit_m(const ConvexShape& convex, const Ray& ray) {
  return hit_polyhedron_m(ray, *convex.solid);
}
std::optional<SurfaceHit> ShapeParts<ConvexShape>::first_hit(const ConvexShape& convex, const Vec3d& start,
                                                             const Vec3d& end, double offset_m, double skin_m) {
  return hit_convex(convex, start, end, offset_m, skin_m, [&](const Vec3d& way, double offset) {
    return enter_polyhedron(*convex.solid, start, way, offset);
  });
}
Vec3d ShapeParts<ConvexShape>::Rigid::half_box_m(const ConvexShape& convex, const Eigen::Matrix3d& rotation) {
  Vec3d half = Vec3d::Zero();
  for (const Vec3d& corner : convex.solid->corners_m) half = half.cwiseMax((rotation * corner).cwiseAbs());
  return half;
}
Knobs ShapeParts<ConvexShape>::Rigid::knobs(const ConvexShape& convex) {
  Knobs knobs;
  for (const Vec3d& corner : convex.solid->corners_m) knobs.add(corner);
  return knobs;
}

SurfacePoint nearest_surface(const Shape& shape, const Vec3d& point, double offset_m) {
  return std::visit([&]<class S>(const S& one) { return ShapeParts<S>::nearest(one, point, offset_m); }, shape);
}

std::optional<double> surface_hit_m(const Shape& shape, const Ray& ray) {
  return std::visit([&]<class S>(const S& one) { return ShapeParts<S>::hit_m(one, ray); }, shape);
}

double surface_distance(const Shape& shape, const Vec3d& point, double offset_m) {
  return nearest_surface(shape, point, offset_m).distance_m;
}

Vec3d half_extents_m(const Shape& shape) {
  return std::visit([]<class S>(const S& one) { return ShapeParts<S>::half_extents_m(one); }, shape);
}

std::optional<SurfaceHit> first_hit(const Shape& shape, const Vec3d& start, const Vec3d& end, double offset_m,
                                    double skin_m) {
  return std::visit(
      [&]<class S>(const S& one) -> std::optional<SurfaceHit> {
        if constexpr (shape_parts::NoFirstHit<S>) {
          return std::nullopt;
        } else {
          return ShapeParts<S>::first_hit(one, start, end, offset_m, skin_m);
        }
      },
      shape);
}

}  // namespace pneuma::physics
