#include "codec/points_check.h"

#include <array>
#include <cstddef>

namespace pneuma::codec {

namespace {

constexpr std::uint32_t digest_factor = 16'777'619;
constexpr std::uint32_t check_factor = 2'654'435'761;

/// What is beyond 32 bits counts too, so that a sum that did not wrap around shows.
std::uint32_t word_of(std::int64_t coordinate) {
  const std::uint64_t rounded = static_cast<std::uint64_t>(coordinate) + (std::uint64_t{1} << 31);
  return static_cast<std::uint32_t>(coordinate) + 3 * static_cast<std::uint32_t>(rounded >> 32);
}

}  // namespace

std::uint32_t points_digest(const Lattice& points) {
  std::array<std::uint32_t, 3> sums{};
  const std::int64_t* const from = points.data();
  for (std::size_t i = 0; i + 3 <= points.size(); i += 3) {
    for (std::size_t axis = 0; axis < 3; ++axis) sums[axis] = sums[axis] * digest_factor + word_of(from[i + axis]);
  }
  return (sums[0] * digest_factor + sums[1]) * digest_factor + sums[2];
}

std::uint32_t points_check(std::span<const std::uint32_t> digests) {
  std::uint32_t sum = 0;
  for (const std::uint32_t digest : digests) sum = sum * digest_factor + digest;
  return ((sum ^ (sum >> 15)) * check_factor) >> (32 - check_bits);
}

}  // namespace pneuma::codec
