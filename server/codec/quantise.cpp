#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "base/limits.h"
#include "codec/frame_codec.h"

namespace pneuma::codec {

namespace {

// Added to a double below 2^51 in size, it leaves the nearest integer in the low bits of the mantissa.
constexpr double rounding_shift = 0x1.8p52;
static_assert(base::coordinate_max_m / base::max_error_min_m < 0x1p51);

}  // namespace

double grid_step_m(double max_error_m) {
  // Each axis is off by half a step, plus what the division (a relative 2^-53, so 2^-53 |x| in metres) and the product
  // of dequantise() (as much again) round away; the diagonal of the three is within max_error_m. At the least bound and
  // the largest coordinate this takes 0.4 % of the step; a bound below some 4e-9 m could not be met in doubles at all.
  assert(max_error_m >= base::max_error_min_m);
  constexpr double unit_roundoff = 0x1p-53;
  constexpr double rounding_m = 2.0 * unit_roundoff * (base::coordinate_max_m + base::max_error_max_m);
  return (2.0 * max_error_m / std::sqrt(3.0) - 2.0 * rounding_m) * (1.0 - 8.0 * unit_roundoff);
}

void quantise(std::span<const double> positions_m, double step_m, std::span<std::int64_t> out) {
  assert(positions_m.size() == out.size());
  for (std::size_t i = 0; i < positions_m.size(); ++i) {
    assert(std::abs(positions_m[i]) <= base::coordinate_max_m);
    const double shifted = positions_m[i] / step_m + rounding_shift;
    out[i] = std::bit_cast<std::int64_t>(shifted) - std::bit_cast<std::int64_t>(rounding_shift);
  }
}

void dequantise(std::span<const std::int64_t> lattice, double step_m, std::span<double> out_m) {
  assert(lattice.size() == out_m.size());
  for (std::size_t i = 0; i < lattice.size(); ++i) out_m[i] = static_cast<double>(lattice[i]) * step_m;
}

}  // namespace pneuma::codec
