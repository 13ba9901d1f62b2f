#include "physics/mesh/mesh_builders.h"

#include <cmath>
#include <numbers>
#include <string>
#include <unordered_map>
#include <utility>

#include <Eigen/Geometry>

#include "base/limits.h"
#include "physics/mesh/mesh.h"

namespace pneuma::physics {
namespace {

base::Status check_size(double size_m, const std::string& where) {
  if (!std::isfinite(size_m)) return base::invalid("is not finite", where);
  if (size_m <= 0.0) return base::invalid("must be greater than 0", where);
  if (size_m < base::extent_min_m) return {base::StatusCode::limit_exceeded, "is less than 1e-7 m", where};
  if (size_m > base::coordinate_max_m) {
    return {base::StatusCode::limit_exceeded, "is more than 1e7 m", where};
  }
  return {};
}

base::Status too_many_vertices(const std::string& where) {
  return {base::StatusCode::limit_exceeded, "makes more than " + std::to_string(base::mesh_vertices_max) + " vertices",
          where};
}

struct Triangles {
  std::vector<Eigen::Vector3d> positions_m;
  std::vector<Face> faces;
};

/// Circumradius 1. The vertices are the cyclic permutations of (0, +-1, +-golden ratio).
Triangles unit_icosahedron() {
  const double length = std::sqrt(1.0 + std::numbers::phi * std::numbers::phi);
  const double s = 1.0 / length;
  const double l = std::numbers::phi / length;
  return {{{-s, l, 0},
           {s, l, 0},
           {-s, -l, 0},
           {s, -l, 0},
           {0, -s, l},
           {0, s, l},
           {0, -s, -l},
           {0, s, -l},
           {l, 0, -s},
           {l, 0, s},
           {-l, 0, -s},
           {-l, 0, s}},
          {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
           {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
           {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
}

/// Each face becomes four; new vertices, at the middles of the edges, are drawn out to the unit sphere.
Triangles split_in_four(Triangles coarse) {
  Triangles fine{std::move(coarse.positions_m), {}};
  fine.faces.reserve(coarse.faces.size() * 4);
  std::unordered_map<std::uint64_t, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint64_t edge = (std::uint64_t{std::min(a, b)} << 32U) | std::max(a, b);
    const auto [entry, is_new] = middles.try_emplace(edge, static_cast<std::uint32_t>(fine.positions_m.size()));
    if (is_new) fine.positions_m.emplace_back((fine.positions_m[a] + fine.positions_m[b]).normalized());
    return entry->second;
  };
  for (const auto& [a, b, c] : coarse.faces) {
    const std::uint32_t ab = middle(a, b);
    const std::uint32_t bc = middle(b, c);
    const std::uint32_t ca = middle(c, a);
    fine.faces.insert(fine.faces.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  return fine;
}

/// The points of a cubic lattice of n cells a side that lie on its surface, numbered as they come.
class BoxLattice {
 public:
  explicit BoxLattice(std::uint32_t cells) : cells_(cells), side_(cells + 1), numbers_(side_ * side_ * side_, unset) {}

  std::uint32_t number(const std::array<std::uint32_t, 3>& point) {
    std::uint32_t& slot = numbers_[(std::size_t{point[0]} * side_ + point[1]) * side_ + point[2]];
    if (slot == unset) {
      slot = static_cast<std::uint32_t>(points_.size());
      points_.push_back(point);
    }
    return slot;
  }

  [[nodiscard]] std::vector<Eigen::Vector3d> positions(const Eigen::Vector3d& half_extents_m) const {
    std::vector<Eigen::Vector3d> positions_m;
    positions_m.reserve(points_.size());
    for (const auto& point : points_) {
      // From -1 to 1 in steps that are the same seen from both ends, so that the box is symmetric to the last bit.
      const Eigen::Vector3d unit =
          Eigen::Vector3d(point[0], point[1], point[2]) * 2.0 - Eigen::Vector3d::Constant(cells_);
      positions_m.emplace_back((unit / cells_).cwiseProduct(half_extents_m));
    }
    return positions_m;
  }

 private:
  static constexpr std::uint32_t unset = ~std::uint32_t{0};
  std::uint32_t cells_;
  std::size_t side_;
  std::vector<std::uint32_t> numbers_;
  std::vector<std::array<std::uint32_t, 3>> points_;
};

}  // namespace

base::Result<std::shared_ptr<const Mesh>> make_icosphere(std::uint32_t subdivisions, double radius_m) {
  if (subdivisions > base::icosphere_subdivisions_max) {
    return base::Status(
        base::StatusCode::limit_exceeded,
        "is " + std::to_string(subdivisions) + "; at most " + std::to_string(base::icosphere_subdivisions_max),
        "subdivisions");
  }
  if (base::Status status = check_size(radius_m, "radius_m"); !status.ok()) return status;
  Triangles sphere = unit_icosahedron();
  for (std::uint32_t i = 0; i < subdivisions; ++i) sphere = split_in_four(std::move(sphere));
  for (Eigen::Vector3d& position : sphere.positions_m) position *= radius_m;
  return make_mesh(std::move(sphere.positions_m), std::move(sphere.faces));
}

base::Result<std::shared_ptr<const Mesh>> make_grid(std::uint32_t columns, std::uint32_t rows, double width_m,
                                                    double height_m) {
  if (columns == 0) return base::invalid("must be at least 1", "columns");
  if (rows == 0) return base::invalid("must be at least 1", "rows");
  if (columns >= base::mesh_vertices_max) return too_many_vertices("columns");
  if (rows >= base::mesh_vertices_max) return too_many_vertices("rows");
  if ((std::uint64_t{columns} + 1) * (std::uint64_t{rows} + 1) > base::mesh_vertices_max) {
    return too_many_vertices("columns");
  }
  if (base::Status status = check_size(width_m, "width_m"); !status.ok()) return status;
  if (base::Status status = check_size(height_m, "height_m"); !status.ok()) return status;

  std::vector<Eigen::Vector3d> positions_m;
  positions_m.reserve(std::size_t{columns + 1} * (rows + 1));
  for (std::uint32_t r = 0; r <= rows; ++r) {
    for (std::uint32_t c = 0; c <= columns; ++c) {
      positions_m.emplace_back((2.0 * c - columns) / columns * width_m / 2, 0.0,
                               (2.0 * r - rows) / rows * height_m / 2);
    }
  }
  std::vector<Face> faces;
  faces.reserve(std::size_t{columns} * rows * 2);
  for (std::uint32_t r = 0; r < rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      const std::uint32_t a = r * (columns + 1) + c;
      const std::uint32_t b = a + 1;
      const std::uint32_t d = a + columns + 1;
      const std::uint32_t e = d + 1;
      // Diagonals alternate, so that the sheet is not stiffer one way than the other.
      if ((r + c) % 2 == 0) {
        faces.insert(faces.end(), {{a, d, e}, {a, e, b}});
      } else {
        faces.insert(faces.end(), {{a, d, b}, {b, d, e}});
      }
    }
  }
  return make_mesh(std::move(positions_m), std::move(faces));
}

base::Result<std::shared_ptr<const Mesh>> make_box(const Eigen::Vector3d& half_extents_m, std::uint32_t subdivisions) {
  const std::uint32_t cells = std::max<std::uint32_t>(subdivisions, 1);
  if (6 * std::uint64_t{cells} * cells + 2 > base::mesh_vertices_max) return too_many_vertices("subdivisions");
  constexpr std::array<const char*, 3> axis_names{"half_extents.x", "half_extents.y", "half_extents.z"};
  for (int axis = 0; axis < 3; ++axis) {
    if (base::Status status = check_size(half_extents_m[axis], axis_names[static_cast<std::size_t>(axis)]);
        !status.ok()) {
      return status;
    }
  }
  BoxLattice lattice(cells);
  std::vector<Face> faces;
  faces.reserve(std::size_t{cells} * cells * 12);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t along = (axis + 1) % 3;  // along x across = axis
    const std::size_t across = (axis + 2) % 3;
    for (const bool far_side : {false, true}) {
      for (std::uint32_t i = 0; i < cells; ++i) {
        for (std::uint32_t j = 0; j < cells; ++j) {
          const auto corner = [&](std::uint32_t di, std::uint32_t dj) {
            std::array<std::uint32_t, 3> point{};
            point[axis] = far_side ? cells : 0;
            point[along] = i + di;
            point[across] = j + dj;
            return lattice.number(point);
          };
          const std::uint32_t a = corner(0, 0);
          const std::uint32_t b = corner(1, 0);
          const std::uint32_t c = corner(1, 1);
          const std::uint32_t d = corner(0, 1);
          if (far_side) {
            faces.insert(faces.end(), {{a, b, c}, {a, c, d}});
          } else {
            faces.insert(faces.end(), {{a, c, b}, {a, d, c}});
          }
        }
      }
    }
  }
  return make_mesh(lattice.positions(half_extents_m), std::move(faces));
}

}  // namespace pneuma::physics
