// The order in which a mesh's vertices are coded, and what is known at each of them: derived from the triangles alone,
// so that both sides find the same (proto/WIRE.md, "Order of the vertices").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pneuma::codec {

struct MeshOrder {
  // A slot is a place in the order. Tables that a vertex looks up have an entry of zeros before them, so in `parents`
  // and `parallelograms` slot s is s + 1, and 0 is nothing.
  std::vector<std::uint32_t> vertices;                // one a slot
  std::vector<std::array<std::uint32_t, 4>> parents;  // neighbours coded before; fewer than four stand repeatedly
  std::vector<std::array<std::uint32_t, 6>> parallelograms;  // a, b, a', b' and, to be taken off, c, c'
  std::vector<std::uint32_t> ring_begins;                    // one a slot, and the end
  std::vector<std::uint32_t> rings;                          // slots of all neighbours

  [[nodiscard]] std::size_t size() const { return vertices.size(); }
};

/// `indices`: three a face, each below vertex_count; any such list will do. Linear in its size but for vertices where
/// very many faces meet.
[[nodiscard]] MeshOrder make_mesh_order(std::uint32_t vertex_count, std::span<const std::uint32_t> indices);

}  // namespace pneuma::codec
