#include "codec/grid.h"

#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "base/limits.h"
#include "codec/clones.h"

namespace pneuma::codec {

namespace {

static_assert(2.0 * base::coordinate_max_m / base::max_error_min_m < 0x1p51);

std::int64_t shifted_integer(double shifted) {
  return std::bit_cast<std::int64_t>(shifted) - std::bit_cast<std::int64_t>(rounding_shift);
}

}  // namespace

double grid_step_m(double max_error_m) {
  // The points furthest from the grid are the corners of its cells, (1, 1/2, 0) steps and the like from a point. To
  // that comes what doubles round away, a relative 2^-53 each: the inverse of the step, the product with it, and that
  // of dequantise(). At the least bound and the largest coordinate this takes 0.7 % of the step.
  assert(max_error_m >= base::max_error_min_m);
  constexpr double unit_roundoff = 0x1p-53;
  constexpr double rounding_m = 3.0 * unit_roundoff * (base::coordinate_max_m + base::max_error_max_m);
  return 2.0 * (max_error_m - 2.0 * rounding_m) / std::sqrt(5.0) * (1.0 - 8.0 * unit_roundoff);
}

PNEUMA_CLONED void quantise(std::span<const double> positions_m, double step_m, std::span<std::int64_t> out) {
  assert(positions_m.size() == out.size());
  const double halves_a_m = 0.5 / step_m;
  for (std::size_t vertex = 0; vertex < positions_m.size(); vertex += 3) {
    // The nearest point with even coordinates, and the nearest with odd ones.
    std::array<double, 3> even{};
    std::array<double, 3> odd{};
    double even_squares = 0.0;
    double odd_squares = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double halves = positions_m[vertex + axis] * halves_a_m;
      even[axis] = halves + rounding_shift;
      odd[axis] = (halves - 0.5) + rounding_shift;
      const double from_even = halves - (even[axis] - rounding_shift);
      const double from_odd = (halves - 0.5) - (odd[axis] - rounding_shift);
      even_squares += from_even * from_even;
      odd_squares += from_odd * from_odd;
    }
    const bool is_odd = odd_squares < even_squares;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      out[vertex + axis] = 2 * shifted_integer(is_odd ? odd[axis] : even[axis]) + (is_odd ? 1 : 0);
    }
  }
}

double surely_within_m(double max_error_m) {
  // As much as the products with the step round away, here and in dequantise(), and the distance itself.
  return (max_error_m - 0x1p-51 * (base::coordinate_max_m + base::max_error_max_m)) * (1.0 - 0x1p-40);
}

PNEUMA_CLONED void find_alternatives(std::span<const double> positions_m, std::span<const std::int64_t> points,
                                     double step_m, double within_m, std::span<Lanes> out) {
  assert(positions_m.size() == points.size() && 3 * out.size() == points.size());
  using DoubleLanes [[gnu::vector_size(32)]] = double;
  using Masks [[gnu::vector_size(32)]] = std::int64_t;
  const double steps_a_m = 1.0 / step_m;
  const double squares_max = within_m * steps_a_m * (within_m * steps_a_m);
  for (std::size_t vertex = 0; vertex < out.size(); ++vertex) {
    const std::int64_t* const point = points.data() + 3 * vertex;
    const double* const position_m = positions_m.data() + 3 * vertex;
    const DoubleLanes place{static_cast<double>(point[0]), static_cast<double>(point[1]), static_cast<double>(point[2]),
                            0.0};
    const DoubleLanes along =
        (DoubleLanes{position_m[0], position_m[1], position_m[2], 0.0} - place * step_m) * steps_a_m;
    const DoubleLanes corner = along < 0.0 ? DoubleLanes{-1.0, -1.0, -1.0, 0.0} : DoubleLanes{1.0, 1.0, 1.0, 0.0};
    const DoubleLanes rest = corner - along;
    const DoubleLanes squares = rest * rest;
    const std::int64_t within = squares[0] + squares[1] + squares[2] <= squares_max ? -1 : 0;
    const auto kept =
        reinterpret_cast<DoubleLanes>(reinterpret_cast<Masks>(corner) & Masks{within, within, within, within});
    out[vertex].v = std::bit_cast<LaneVector>(__builtin_convertvector(kept, SignedLaneVector));
  }
}

void dequantise(std::span<const std::int64_t> points, double step_m, std::span<double> out_m) {
  assert(points.size() == out_m.size());
  for (std::size_t i = 0; i < points.size(); ++i) out_m[i] = static_cast<double>(points[i]) * step_m;
}

}  // namespace pneuma::codec
