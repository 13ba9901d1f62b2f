// A few bits by which a reader sees that it holds the writer's points (proto/WIRE.md, "Check").
#pragma once

#include <cstdint>
#include <span>

#include "codec/grid.h"

namespace pneuma::codec {

/// One wrong frame in 16,384 passes, and a reader that has gone wrong has many. In a message, two bytes and a tag.
inline constexpr int check_bits = 14;

/// Of a body's points, in the order of the slots. Each axis has a sum of its own: the three multiplications of a slot
/// do not wait for each other.
[[nodiscard]] std::uint32_t points_digest(const Lattice& points);

/// Of the digests of a payload's bodies, in order.
[[nodiscard]] std::uint32_t points_check(std::span<const std::uint32_t> digests);

}  // namespace pneuma::codec
