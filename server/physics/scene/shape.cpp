#include "physics/scene/shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/mesh/picking.h"

namespace pneuma::physics {
namespace {

// Newton doubles the digits once it is near; from the bound it starts at, 12 iterations were enough at every axis ratio
// to 1:1000.
constexpr int newton_iterations_max = 32;

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

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

}  // namespace

SurfacePoint nearest_surface(const Shape& shape, const Vec3d& point, double offset_m) {
  return std::visit(
      Overloaded{
          [&](const PlaneShape& s) -> SurfacePoint {
            const double distance = s.normal.dot(point) - offset_m;
            return {distance, s.normal, point - distance * s.normal};
          },
          [&](const SphereShape& s) { return nearest_on_ball(Vec3d::Zero(), s.radius_m + offset_m, point); },
          [&](const BoxShape& s) { return nearest_on_box(s.half_extents_m.array() + offset_m, point); },
          [&](const EllipsoidShape& s) { return nearest_on_ellipsoid(s.radii_m.array() + offset_m, point); },
          [&](const CapsuleShape& s) {
            const Vec3d centre(0.0, std::clamp(point.y(), -s.half_height_m, s.half_height_m), 0.0);
            SurfacePoint nearest = nearest_on_ball(centre, s.radius_m + offset_m, point);
            if (point == centre) {  // on the axis: out through the side
              nearest.normal = Vec3d::UnitX();
              nearest.point = centre + (s.radius_m + offset_m) * nearest.normal;
            }
            return nearest;
          },
          [&](const RoomShape& s) {
            return nearest_on_room((s.half_extents_m.array() - offset_m).cwiseMax(0.0), point);
          },
          [&](const MeshShape& s) { return nearest_on_mesh(*s.mesh, offset_m, point); },
      },
      shape);
}

double surface_distance(const Shape& shape, const Vec3d& point, double offset_m) {
  return nearest_surface(shape, point, offset_m).distance_m;
}

Vec3d half_extents_m(const Shape& shape) {
  const Vec3d endless = Vec3d::Constant(std::numeric_limits<double>::infinity());
  return std::visit(
      Overloaded{
          [&](const PlaneShape&) -> Vec3d { return endless; },
          [](const SphereShape& s) -> Vec3d { return Vec3d::Constant(s.radius_m); },
          [](const BoxShape& s) { return s.half_extents_m; },
          [](const EllipsoidShape& s) { return s.radii_m; },
          [](const CapsuleShape& s) -> Vec3d { return {s.radius_m, s.half_height_m + s.radius_m, s.radius_m}; },
          [&](const RoomShape&) -> Vec3d { return endless; },
          [](const MeshShape& s) {
            Vec3d half = Vec3d::Zero();
            for (const Vec3d& position : s.mesh->positions_m) half = half.cwiseMax(position.cwiseAbs());
            return half;
          },
      },
      shape);
}

}  // namespace pneuma::physics
