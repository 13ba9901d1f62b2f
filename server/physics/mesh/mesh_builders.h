// The meshes that a scene names by a few numbers.
#pragma once

#include <cstdint>
#include <memory>

#include "base/status.h"
#include "physics/mesh/mesh.h"

namespace pneuma::physics {

/// A unit icosahedron scaled to radius_m, each face split in four `subdivisions` times: 10 * 4^s + 2 vertices.
[[nodiscard]] base::Result<std::shared_ptr<const Mesh>> make_icosphere(std::uint32_t subdivisions, double radius_m);
/// An open sheet of columns x rows cells in the x-z plane, normal +y, centred at the origin.
[[nodiscard]] base::Result<std::shared_ptr<const Mesh>> make_grid(std::uint32_t columns, std::uint32_t rows,
                                                                  double width_m, double height_m);
/// A closed box, each side split into subdivisions^2 cells of two triangles (0 counts as 1).
[[nodiscard]] base::Result<std::shared_ptr<const Mesh>> make_box(const Eigen::Vector3d& half_extents_m,
                                                                 std::uint32_t subdivisions);

}  // namespace pneuma::physics
