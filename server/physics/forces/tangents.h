// The derivatives of a body's forces, as elements that a solver multiplies with: it forms no matrix.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/forces/edge_tangent.h"
#include "physics/mesh/mesh.h"
#include "physics/state/substep_context.h"

namespace pneuma::physics {

/// Of a number that four vertices move: its gradient, and the stiffness against it.
struct FourPointTangent {
  std::array<std::uint32_t, 4> vertices{};
  std::array<Vec3d, 4> gradient{};
  double stiffness = 0.0;
};

/// Where the tangents are taken, for a step of length s.
struct TangentPlace {
  std::span<const Vec3d> x;  // m
  std::span<const Vec3d> v;  // m/s
  double s = 0.0;
  Surroundings surroundings = {};
  std::span<const std::array<std::uint32_t, 2>> opposite = {};  // opposite_vertices(), of closed meshes
};

/// s D + s^2 K without what is on the diagonal and along the volume's gradient.
struct Tangents {
  std::vector<EdgeTangent> edges;  // one an edge of the mesh
  std::vector<FourPointTangent> four_points;
  std::vector<Eigen::Matrix3d> faces;  // against the sum of the vertices' moves; one a face, or none

  void clear(const Mesh& mesh);
  [[nodiscard]] std::size_t bytes() const;
};

}  // namespace pneuma::physics
