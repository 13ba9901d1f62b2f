// Triangle meshes: their shape, what can be derived from it, and the checks that they must pass.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "base/status.h"

namespace pneuma::physics {

using Face = std::array<std::uint32_t, 3>;  // counter-clockwise seen from outside
using Edge = std::array<std::uint32_t, 2>;  // lower index first

/// A mesh at rest in its own frame. Immutable once made; bodies share it.
struct Mesh {
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<Face> faces;
  // Derived, in a fixed order, so that sums over them have the same bits everywhere:
  std::vector<Edge> edges;                 // each edge once, sorted
  std::vector<double> edge_lengths_m;      // of the rest shape, one an edge
  std::vector<std::uint32_t> face_counts;  // faces that meet at a vertex, one a vertex
  std::vector<std::uint32_t> boundary;     // vertices on an open border, sorted
  bool closed = false;                     // every edge has two faces that run through it in opposite directions
};

/// By what they hold.
[[nodiscard]] bool same_mesh(const Mesh& a, const Mesh& b);

/// Of the bounding box; of one position or more.
[[nodiscard]] double diagonal_m(std::span<const Eigen::Vector3d> positions_m);

[[nodiscard]] double face_area_m2(std::span<const Eigen::Vector3d> positions_m, const Face& face);
/// A face of no more than this has zero area, in a mesh of these positions.
[[nodiscard]] double face_area_min_m2(std::span<const Eigen::Vector3d> positions_m);

/// What must hold of a triangle list before anything can be asked of it: not too many vertices and faces, one of each
/// at least, coordinates that are finite and within coordinate_max_m, indices within the vertices.
[[nodiscard]] base::Status check_lists(const std::vector<Eigen::Vector3d>& positions_m, const std::vector<Face>& faces);

/// Derives edges, lengths and borders of a triangle list and checks it.
/// Refuses, naming the face (`where` is its place in the flat list of a scene, `indices[9..11]` for face 3) or vertex:
/// no vertex or face, more than mesh_vertices_max, a coordinate that is not finite or is past coordinate_max_m, an
/// index out of range, a face with a repeated vertex or zero area, an edge shared by more than two faces or run through
/// twice in the same direction (a flipped face).
[[nodiscard]] base::Result<std::shared_ptr<const Mesh>> make_mesh(std::vector<Eigen::Vector3d> positions_m,
                                                                  std::vector<Face> faces);

/// OK for a mesh that can hold gas: closed, and each connected part facing outwards (positive volume). Otherwise names
/// an open edge's vertices, or a face of the part that is inside out.
[[nodiscard]] base::Status check_holds_gas(const Mesh& mesh);

/// V = 1/6 sum of a.(b x c) over the faces, for positions in the mesh's vertex order (divergence theorem).
[[nodiscard]] double signed_volume_m3(std::span<const Eigen::Vector3d> positions_m, std::span<const Face> faces);

}  // namespace pneuma::physics
