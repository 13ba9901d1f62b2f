// Coarser versions of a mesh, for those who look from afar: a subset of its vertices with triangles of its own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "physics/mesh/mesh.h"

namespace pneuma::physics {

struct CoarseMesh {
  std::vector<std::uint32_t> kept;  // the mesh's vertices that stay, ascending
  std::vector<Face> faces;          // of places in `kept`, in the order of the mesh's faces that they were
};

/// Level 0 is the mesh; each level above keeps a quarter of the vertices of the one below, and of those alone, but not
/// fewer than base::coarse_vertices_min. It keeps more where no further edge can go.
/// Edges are collapsed onto one of their ends (Garland and Heckbert 1997, with quadrics of the rest shape), only where
/// that keeps the surface what it is (the link condition of Dey et al. 1999): a closed mesh stays closed and a
/// manifold, a border stays a border, and the Euler characteristic is kept. Where the faces at a vertex are not one
/// fan, that vertex and its edges stay. `positions_m` are finite; any faces will do whose indices are below their
/// number. The same bits in, the same mesh out.
[[nodiscard]] CoarseMesh coarsen(std::span<const Eigen::Vector3d> positions_m, std::span<const Face> faces,
                                 std::uint32_t level);

}  // namespace pneuma::physics
