// The order in which a mesh's vertices are coded, and what is known at each of them: derived from the triangles alone,
// so that both sides find the same (proto/WIRE.md, "Order of the vertices").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace pneuma::codec {

inline constexpr std::size_t parents_max = 6;

/// From coarse to fine: most vertices come after all of their neighbours, and near ones in the order do not depend on
/// each other.
struct MeshOrder {
  /// What a slot is predicted from. Tables that it looks up have an entry of zeros before them, so slot s is s + 1
  /// here, and 0, past the count, is nothing.
  struct Parents {
    std::array<std::uint32_t, parents_max> slots{};
    std::uint32_t count = 0;
  };

  // A slot is a place in the order.
  std::vector<std::uint32_t> vertices;  // one a slot
  std::vector<Parents> parents;         // one a slot
  // The slots of all neighbours of a slot: the first six, or fewer and the slot itself repeated (a loop over their
  // number would be guessed wrong too often); and the others, of which most have none.
  std::vector<std::array<std::uint32_t, 6>> rings;
  std::vector<std::uint32_t> ring_rest_begins;  // one a slot, and the end
  std::vector<std::uint32_t> ring_rests;
  // Runs of slots without a parent in the same run: the ends of each.
  std::vector<std::uint32_t> run_ends;

  [[nodiscard]] std::size_t size() const { return vertices.size(); }
};

/// `indices`: three a face, each below vertex_count; any such list will do. Linear in its size.
[[nodiscard]] MeshOrder make_mesh_order(std::uint32_t vertex_count, std::span<const std::uint32_t> indices);

}  // namespace pneuma::codec
