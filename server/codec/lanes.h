// Three numbers of a vertex and one beside them, in one vector register.
#pragma once

#include <bit>
#include <cstdint>

namespace pneuma::codec {

/// Added to a double below 2^51 in size, it leaves the nearest integer in the low bits of the mantissa.
inline constexpr double rounding_shift = 0x1.8p52;

using LaneVector [[gnu::vector_size(16)]] = std::uint32_t;
using SignedLaneVector [[gnu::vector_size(16)]] = std::int32_t;

/// x, y, z of a vertex; what the fourth lane holds depends on the table. Arithmetic is modulo 2^32.
struct Lanes {
  LaneVector v = {0, 0, 0, 0};

  friend bool operator==(const Lanes& a, const Lanes& b) {
    const LaneVector difference = a.v ^ b.v;
    return (difference[0] | difference[1] | difference[2] | difference[3]) == 0;
  }
};

/// Each lane as a signed number over 2^bits, rounded down.
inline LaneVector shifted_down(LaneVector lanes, int bits) {
  return std::bit_cast<LaneVector>(std::bit_cast<SignedLaneVector>(lanes) >> bits);
}

}  // namespace pneuma::codec
