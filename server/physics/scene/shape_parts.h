// What each shape of a solid is to the rest of the engine. A shape is a struct in scene.h, a name in its variant, and
// its ShapeParts here, with all that SolidShape asks for. A part that does not apply to it is None, with the reason; a
// part that is forgotten does not compile. All in the shape's own frame.
#pragma once

#include <array>
#include <concepts>
#include <optional>
#include <variant>

#include "base/limits.h"
#include "physics/machine/none.h"
#include "physics/mesh/picking.h"
#include "physics/mesh/polyhedron.h"
#include "physics/scene/shape.h"
#include "physics/scene/shape_entry.h"

namespace pneuma::physics {

/// What of a solid meets faces inside their borders: balls about points, of no radius for corners.
struct Knobs {
  std::array<Vec3d, base::rigid_mesh_vertices_max> centres{};
  std::size_t count = 0;
  double radius_m = 0.0;
  bool is_rod = false;  // there are two, and what lies between them is as thick

  void add(const Vec3d& centre) { centres[count++] = centre; }
};

template <class S>
struct ShapeParts;

namespace shape_parts {

template <class S>
using Parts = ShapeParts<S>;

template <class S>
concept NoFirstHit = requires {
  { Parts<S>::first_hit } -> std::same_as<const None&>;
};
template <class S>
concept NoRigid = requires {
  { Parts<S>::rigid } -> std::same_as<const None&>;
};

/// Of shapes that rigid bodies may have.
template <class Rigid, class S>
concept RigidParts =
    requires(const Rigid& rigid, const S& shape, double mass_kg, const Eigen::Matrix3d& rotation, Knobs& knobs) {
      { rigid.principal_inertia_kg_m2(shape, mass_kg) } -> std::same_as<Vec3d>;  // of a solid one
      { rigid.principal_axes(shape) } -> std::same_as<std::optional<Quatd>>;     // in its own frame; unset: its own
      { rigid.radius_m(shape) } -> std::same_as<double>;                         // about its centre
      { rigid.half_box_m(shape, rotation) } -> std::same_as<Vec3d>;              // along the axes that it is turned to
      { rigid.knobs(shape) } -> std::same_as<Knobs>;
    };

}  // namespace shape_parts

/// A shape with all its parts.
template <class S>
concept SolidShape =
    requires(const S& shape, const Vec3d& point, const Ray& ray, double offset_m) {
      { ShapeParts<S>::nearest(shape, point, offset_m) } -> std::same_as<SurfacePoint>;
      // Along the ray to the surface; from inside, to where the ray leaves.
      { ShapeParts<S>::hit_m(shape, ray) } -> std::same_as<std::optional<double>>;
      { ShapeParts<S>::half_extents_m(shape) } -> std::same_as<Vec3d>;
      // Whether soft bodies meet its surface as they meet each other's (mesh_colliders.h), not vertex by vertex.
      { ShapeParts<S>::is_surface } -> std::same_as<const bool&>;
      { ShapeParts<S>::rigid };
    } &&
    (shape_parts::NoFirstHit<S> ||
     requires(const S& shape, const Vec3d& start, const Vec3d& end, double offset_m, double skin_m) {
       { ShapeParts<S>::first_hit(shape, start, end, offset_m, skin_m) } -> std::same_as<std::optional<SurfaceHit>>;
     }) &&
    (shape_parts::NoRigid<S> || shape_parts::RigidParts<decltype(ShapeParts<S>::rigid), S>);

template <>
struct ShapeParts<PlaneShape> {
  static SurfacePoint nearest(const PlaneShape& plane, const Vec3d& point, double offset_m);
  static std::optional<double> hit_m(const PlaneShape& plane, const Ray& ray);
  static std::optional<SurfaceHit> first_hit(const PlaneShape& plane, const Vec3d& start, const Vec3d& end,
                                             double offset_m, double skin_m);
  static Vec3d half_extents_m(const PlaneShape& plane);
  static constexpr bool is_surface = false;
  static constexpr None rigid{"it has no end, and so no mass"};
};

template <>
struct ShapeParts<SphereShape> {
  static SurfacePoint nearest(const SphereShape& sphere, const Vec3d& point, double offset_m);
  static std::optional<double> hit_m(const SphereShape& sphere, const Ray& ray);
  static std::optional<SurfaceHit> first_hit(const SphereShape& sphere, const Vec3d& start, const Vec3d& end,
                                             double offset_m, double skin_m);
  static Vec3d half_extents_m(const SphereShape& sphere);
  static constexpr bool is_surface = false;
  struct Rigid {
    static Vec3d principal_inertia_kg_m2(const SphereShape& sphere, double mass_kg);
    static std::optional<Quatd> principal_axes(const SphereShape&) { return std::nullopt; }
    static double radius_m(const SphereShape& sphere) { return sphere.radius_m; }
    static Vec3d half_box_m(const SphereShape& sphere, const Eigen::Matrix3d& rotation);
    static Knobs knobs(const SphereShape& sphere);
  };
  static constexpr Rigid rigid{};
};

template <>
struct ShapeParts<BoxShape> {
  static SurfacePoint nearest(const BoxShape& box, const Vec3d& point, double offset_m);
  static std::optional<double> hit_m(const BoxShape& box, const Ray& ray);
  static std::optional<SurfaceHit> first_hit(const BoxShape& box, const Vec3d& start, const Vec3d& end, double offset_m,
                                             double skin_m);
  static Vec3d half_extents_m(const BoxShape& box) { return box.half_extents_m; }
  static constexpr bool is_surface = false;
  struct Rigid {
    static Vec3d principal_inertia_kg_m2(const BoxShape& box, double mass_kg);
    static std::optional<Quatd> principal_axes(const BoxShape&) { return std::nullopt; }
    static double radius_m(const BoxShape& box) { return box.half_extents_m.norm(); }
    static Vec3d half_box_m(const BoxShape& box, const Eigen::Matrix3d& rotation);
    static Knobs knobs(const BoxShape& box);
  };
  static constexpr Rigid rigid{};
};

template <>
struct ShapeParts<EllipsoidShape> {
  static SurfacePoint nearest(const EllipsoidShape& ellipsoid, const Vec3d& point, double offset_m);
  static std::optional<double> hit_m(const EllipsoidShape& ellipsoid, const Ray& ray);
  static std::optional<SurfaceHit> first_hit(const EllipsoidShape& ellipsoid, const Vec3d& start, const Vec3d& end,
                                             double offset_m, double skin_m);
  static Vec3d half_extents_m(const EllipsoidShape& ellipsoid) { return ellipsoid.radii_m; }
  static constexpr bool is_surface = false;
  static constexpr None rigid{"the rigid contacts know balls, boxes, capsules and polyhedra"};
};

template <>
struct ShapeParts<CapsuleShape> {
  static SurfacePoint nearest(const CapsuleShape& capsule, const Vec3d& point, double offset_m);
  static std::optional<double> hit_m(const CapsuleShape& capsule, const Ray& ray);
  static std::optional<SurfaceHit> first_hit(const CapsuleShape& capsule, const Vec3d& start, const Vec3d& end,
                                             double offset_m, double skin_m);
  static Vec3d half_extents_m(const CapsuleShape& capsule);
  static constexpr bool is_surface = false;
  struct Rigid {
    static Vec3d principal_inertia_kg_m2(const CapsuleShape& capsule, double mass_kg);
    static std::optional<Quatd> principal_axes(const CapsuleShape&) { return std::nullopt; }
    static double radius_m(const CapsuleShape& capsule) { return capsule.half_height_m + capsule.radius_m; }
    static Vec3d half_box_m(const CapsuleShape& capsule, const Eigen::Matrix3d& rotation);
    static Knobs knobs(const CapsuleShape& capsule);
  };
  static constexpr Rigid rigid{};
};

template <>
struct ShapeParts<RoomShape> {
  static SurfacePoint nearest(const RoomShape& room, const Vec3d& point, double offset_m);
  static std::optional<double> hit_m(const RoomShape& room, const Ray& ray);
  static std::optional<SurfaceHit> first_hit(const RoomShape& room, const Vec3d& start, const Vec3d& end,
                                             double offset_m, double skin_m);
  static Vec3d half_extents_m(const RoomShape& room);
  static constexpr bool is_surface = false;
  static constexpr None rigid{"it is all that is outside, and so has no mass"};
};

template <>
struct ShapeParts<MeshShape> {
  static SurfacePoint nearest(const MeshShape& shape, const Vec3d& point, double offset_m);
  static std::optional<double> hit_m(const MeshShape& shape, const Ray& ray);
  static constexpr None first_hit{"its triangles are met as a soft body's are (mesh_colliders.h)"};
  static Vec3d half_extents_m(const MeshShape& shape);
  static constexpr bool is_surface = true;
  static constexpr None rigid{"it may be open, and so has no mass"};
};

template <>
struct ShapeParts<ConvexShape> {
  static SurfacePoint nearest(const ConvexShape& convex, const Vec3d& point, double offset_m);
  static std::optional<double> hit_m(const ConvexShape& convex, const Ray& ray);
  static std::optional<SurfaceHit> first_hit(const ConvexShape& convex, const Vec3d& start, const Vec3d& end,
                                             double offset_m, double skin_m);
  static Vec3d half_extents_m(const ConvexShape& convex) { return convex.solid->half_extents_m; }
  static constexpr bool is_surface = false;
  struct Rigid {
    static Vec3d principal_inertia_kg_m2(const ConvexShape& convex, double mass_kg) {
      return mass_kg * convex.solid->moments_m2;
    }
    static std::optional<Quatd> principal_axes(const ConvexShape& convex) { return convex.solid->axes; }
    static double radius_m(const ConvexShape& convex) { return convex.solid->radius_m; }
    static Vec3d half_box_m(const ConvexShape& convex, const Eigen::Matrix3d& rotation);
    static Knobs knobs(const ConvexShape& convex);
  };
  static constexpr Rigid rigid{};
};

template <class Variant>
inline constexpr bool are_solid_shapes = false;
template <class... Shapes>
inline constexpr bool are_solid_shapes<std::variant<Shapes...>> = (SolidShape<Shapes> && ...);
static_assert(are_solid_shapes<Shape>, "a shape of the variant lacks a part");

/// Whether a rigid body may have the shape.
[[nodiscard]] inline bool may_be_rigid(const Shape& shape) {
  return std::visit([]<class S>(const S&) { return !shape_parts::NoRigid<S>; }, shape);
}

/// Whether soft bodies meet its surface as they meet each other's.
[[nodiscard]] inline bool is_surface(const Shape& shape) {
  return std::visit([]<class S>(const S&) { return ShapeParts<S>::is_surface; }, shape);
}

/// Calls work(rigid parts, shape) for a shape that may_be_rigid, and returns what that returns; or `otherwise`.
template <class Result, class Work>
[[nodiscard]] Result of_rigid_shape(const Shape& shape, const Result& otherwise, const Work& work) {
  return std::visit(
      [&]<class S>(const S& one) -> Result {
        if constexpr (shape_parts::NoRigid<S>) {
          return otherwise;
        } else {
          return work(ShapeParts<S>::rigid, one);
        }
      },
      shape);
}

}  // namespace pneuma::physics
