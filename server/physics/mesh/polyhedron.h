// Convex polyhedra: what a closed convex mesh is as one filled solid.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/status.h"
#include "physics/mesh/mesh.h"
#include "physics/mesh/picking.h"

namespace pneuma::physics {

/// Along the axes of its mesh, with its centre of mass at the origin. Triangles that are level with each other are one
/// face, and vertices that lie within a face or along an edge are no corners.
struct Polyhedron {
  struct Side {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitY();  // outwards
    double level_m = 0.0;                               // of its plane, along the normal
    std::uint32_t first = 0;                            // of its corners in `loops`, counter-clockwise from outside
    std::uint32_t count = 0;
  };
  struct Ridge {
    std::array<std::uint32_t, 2> corners{};
    std::array<std::uint32_t, 2> sides{};  // the first has the corners in this order, the second in the other
  };

  std::vector<Eigen::Vector3d> corners_m;
  std::vector<Side> sides;
  std::vector<std::uint32_t> loops;
  std::vector<Ridge> ridges;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();  // of mass, in the mesh's frame
  double volume_m3 = 0.0;
  Eigen::Vector3d moments_m2 = Eigen::Vector3d::Zero();  // principal moments of inertia of 1 kg, spread evenly
  std::optional<Eigen::Quaterniond> axes;                // their axes; unset: the mesh's own
  double radius_m = 0.0;                                 // of the ball about the centre
  double half_width_m = 0.0;                             // half the least width across a face
  Eigen::Vector3d half_extents_m = Eigen::Vector3d::Zero();

  [[nodiscard]] std::span<const std::uint32_t> corners_of(const Side& side) const {
    return std::span(loops).subspan(side.first, side.count);
  }
};

/// Refuses a mesh of more than rigid_mesh_vertices_max vertices, and one that is open, inside out, flat or not convex,
/// naming the edge, or the vertex and the face. The mass is that of the exact integrals over tetrahedra (Tonon,
/// "Explicit Exact Formulas for the 3-D Tetrahedron Inertia Tensor", 2004).
[[nodiscard]] base::Result<std::shared_ptr<const Polyhedron>> make_polyhedron(const Mesh& mesh);

/// Of the surface, as seen from a point.
struct PolyhedronPoint {
  double distance_m = 0.0;  // negative inside
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
};
[[nodiscard]] PolyhedronPoint nearest_point(const Polyhedron& solid, const Eigen::Vector3d& point_m);

/// The share of the way at which a point comes within `distance_m` of the solid; nothing where it does not. It starts
/// no nearer than that.
[[nodiscard]] std::optional<double> enter_polyhedron(const Polyhedron& solid, const Eigen::Vector3d& start_m,
                                                     const Eigen::Vector3d& way_m, double distance_m);

/// Distance in metres along the ray to the surface; from inside, to where the ray leaves.
[[nodiscard]] std::optional<double> hit_polyhedron_m(const Ray& ray, const Polyhedron& solid);

}  // namespace pneuma::physics
