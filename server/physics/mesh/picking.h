// Where a request's point or ray meets a body: nearest surface points, first hits, and the share of each vertex.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "physics/mesh/mesh.h"

namespace pneuma::physics {

/// A point on a triangle mesh: barycentric weights of the face's three vertices, in its order.
struct MeshPoint {
  std::uint32_t face = 0;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Zero();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  double distance_m = 0.0;  // from the point asked for, or along the ray
};

/// `direction` may have any length; a ray whose direction has none meets nothing.
struct Ray {
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
};

struct VertexWeight {
  std::uint32_t vertex = 0;
  double weight = 0.0;
};

/// The point of the surface nearest to `point_m`; the lowest face where several are as near. At least one face is
/// given.
[[nodiscard]] MeshPoint nearest_surface_point(std::span<const Eigen::Vector3d> positions_m, std::span<const Face> faces,
                                              const Eigen::Vector3d& point_m);

/// Where the ray first meets the surface, from either side; nothing where it does not.
[[nodiscard]] std::optional<MeshPoint> first_hit(std::span<const Eigen::Vector3d> positions_m,
                                                 std::span<const Face> faces, const Ray& ray);

/// Distance in metres along the ray to the surface of a sphere, box or capsule that is centred at the origin of the
/// ray's frame (the box along its axes, the capsule along y); from inside, to where the ray leaves.
[[nodiscard]] std::optional<double> hit_sphere_m(const Ray& ray, double radius_m);
[[nodiscard]] std::optional<double> hit_box_m(const Ray& ray, const Eigen::Vector3d& half_extents_m);
[[nodiscard]] std::optional<double> hit_capsule_m(const Ray& ray, double radius_m, double half_height_m);

/// The vertex nearest to a point; the lowest where several are as near. At least one position is given.
[[nodiscard]] std::uint32_t nearest_vertex(std::span<const Eigen::Vector3d> positions_m,
                                           const Eigen::Vector3d& point_m);

/// The vertices within radius_m of a point, by index, with weights (1 - (d / r)^2)^2 scaled to a sum of 1: smooth, and
/// 0 at the radius. The nearest vertex alone, with weight 1, where none is inside.
[[nodiscard]] std::vector<VertexWeight> weights_near(std::span<const Eigen::Vector3d> positions_m,
                                                     const Eigen::Vector3d& point_m, double radius_m);

/// The weights of a patch of skin, scaled to a sum of 1: of the vertices less than radius_m away from `centre` along
/// edges. They are those of weights_near() by that way; the centre's is the largest. Another fold or finger is not in
/// the patch, however near. Of more than `most` vertices, the nearest `most` + 1.
[[nodiscard]] std::vector<VertexWeight> weights_along_skin(std::span<const Eigen::Vector3d> positions_m,
                                                           std::span<const Edge> edges, std::uint32_t centre,
                                                           double radius_m, std::size_t most);

}  // namespace pneuma::physics
