// Meshes by their triangles, for tests of the codec.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "codec/mesh_order.h"

namespace pneuma::codec {

inline const std::vector<std::uint32_t> tetrahedron{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

/// The triangles of a sheet of columns x rows vertices, numbered row by row.
inline std::vector<std::uint32_t> sheet(std::uint32_t columns, std::uint32_t rows) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t at = row * columns + column;
      for (const std::uint32_t vertex : {at, at + columns, at + 1, at + 1, at + columns, at + columns + 1}) {
        indices.push_back(vertex);
      }
    }
  }
  return indices;
}

inline std::shared_ptr<const MeshOrder> order_of(std::uint32_t vertex_count,
                                                 const std::vector<std::uint32_t>& indices) {
  return std::make_shared<const MeshOrder>(make_mesh_order(vertex_count, indices));
}
inline std::shared_ptr<const MeshOrder> sheet_order(std::uint32_t columns, std::uint32_t rows) {
  return order_of(columns * rows, sheet(columns, rows));
}

}  // namespace pneuma::codec
