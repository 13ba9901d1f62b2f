// The surfaces of solids: where they are and which way they face. In the shape's own frame. Every function takes an
// `offset_m`: the surface is moved outwards by that much (a box keeps its edges sharp, an ellipsoid stays one, a convex
// mesh gets round edges), which is how the thickness of a skin is counted.
#pragma once

#include <optional>

#include "physics/mesh/picking.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// -1 or 1, and 1 of a zero of either sign.
[[nodiscard]] inline double sign_of(double x) {
  return x < 0.0 ? -1.0 : 1.0;
}

/// The rotation and place of a solid's own frame in the world.
struct Frame {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Vec3d origin = Vec3d::Zero();

  Frame() = default;
  Frame(const Vec3d& position, const Quatd& orientation) : rotation(orientation.toRotationMatrix()), origin(position) {}
  [[nodiscard]] Vec3d to_local(const Vec3d& world) const { return rotation.transpose() * (world - origin); }
  [[nodiscard]] Vec3d to_world(const Vec3d& local) const { return rotation * local + origin; }
};

struct SurfacePoint {
  double distance_m = 0.0;        // negative in the solid
  Vec3d normal = Vec3d::UnitY();  // out of the solid, unit length
  Vec3d point = Vec3d::Zero();    // the nearest of the surface
};
/// The ellipsoid's by Newton on the Lagrange multiplier of the nearest point (Eberly, "Distance from a Point to an
/// Ellipse, an Ellipsoid, or a Hyperellipsoid", 2013), from below its root, where the iteration is monotonic; bounded.
[[nodiscard]] SurfacePoint nearest_surface(const Shape& shape, const Vec3d& point, double offset_m = 0.0);
[[nodiscard]] double surface_distance(const Shape& shape, const Vec3d& point, double offset_m = 0.0);
/// Along the ray to the surface; from inside, to where the ray leaves. Nothing where it does not meet it.
[[nodiscard]] std::optional<double> surface_hit_m(const Shape& shape, const Ray& ray);

/// Half extents of the smallest box about the shape, in its own frame and centred there; infinite for what has no end.
/// A mesh's are looked up from its vertices.
[[nodiscard]] Vec3d half_extents_m(const Shape& shape);

/// Of a point of a solid: v + w x r.
[[nodiscard]] inline Vec3d velocity_at(const Vec3d& velocity, const Vec3d& angular_velocity, const Vec3d& arm) {
  return velocity + angular_velocity.cross(arm);
}

}  // namespace pneuma::physics
