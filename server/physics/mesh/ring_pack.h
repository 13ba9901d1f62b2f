// How a body's vertices are cut into packs and blocks; apart from ring.h because the lane kernels include it (see
// PerLane).
#pragma once

#include <cstddef>
#include <cstdint>

namespace pneuma::physics {

/// Vertices of one degree, in 16 slots side by side: as many as the widest lanes have, so that no lane waits for
/// another's longer ring.
inline constexpr std::size_t pack_slots = 16;
/// Packs whose sums are taken in one go; the sums of blocks are added in order. Threads share a body by blocks.
inline constexpr std::size_t block_packs = 64;

struct RingPack {
  std::uint32_t degree = 0;
  std::uint32_t count = 0;      // slots in use, the first ones; the others repeat the last vertex and count in no sum
  std::uint32_t first = 0;      // of this pack's entries in the lists of neighbours
  std::uint32_t far_begin = 0;  // and in the list of far neighbours
  std::uint32_t far_end = 0;
};

}  // namespace pneuma::physics
