// Triangles for a hole in a mesh.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "physics/mesh/mesh.h"

namespace pneuma::physics {

/// The edges that a mesh has, to be asked for.
class EdgeSet {
 public:
  void insert(std::uint32_t a, std::uint32_t b) { keys_.insert(key(a, b)); }
  [[nodiscard]] bool contains(std::uint32_t a, std::uint32_t b) const { return keys_.contains(key(a, b)); }

 private:
  static std::uint64_t key(std::uint32_t a, std::uint32_t b) {
    return a < b ? std::uint64_t{a} << 32 | b : std::uint64_t{b} << 32 | a;
  }
  std::set<std::uint64_t> keys_;
};

/// `border`.size() - 2 faces that fill the hole with this border: three or more vertices, each once, in the direction
/// in which the new faces are to run. Ears are cut, seen along the border's mean normal, the one with the shortest new
/// edge first. No face has less than area_min_m2, and no new edge is one that the mesh has; the new ones are put into
/// `edges`. Nothing where there is no such filling: the border is too twisted, or lies in one line.
[[nodiscard]] std::optional<std::vector<Face>> fill_hole(std::span<const Eigen::Vector3d> positions_m,
                                                         std::span<const std::uint32_t> border, double area_min_m2,
                                                         EdgeSet& edges);

}  // namespace pneuma::physics
