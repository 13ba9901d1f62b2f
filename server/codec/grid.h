// The grid of a stream: where its points are, and which of them stands for a position.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "codec/lanes.h"

namespace pneuma::codec {

/// Coordinates of a body's vertices in grid steps, x y z in vertex order. Points of the grid are those whose three
/// coordinates are all even or all odd (the body-centred cubic lattice): of all lattices it covers space with the
/// fewest points a distance, 0.9 bit a vertex fewer than cubes.
using Lattice = std::vector<std::int64_t>;

/// The step with which no position is further than max_error_m (Euclidean) from a point of the grid: 2 e / sqrt(5),
/// less what rounding to double may take.
[[nodiscard]] double grid_step_m(double max_error_m);

/// Nearest points to positions_m (3 a vertex; finite and within base::coordinate_max_m). `out` has the same size.
void quantise(std::span<const double> positions_m, double step_m, std::span<std::int64_t> out);
/// A distance from a point that is known to be within the bound where it is computed in doubles.
[[nodiscard]] double surely_within_m(double max_error_m);
/// For each of the `points` nearest to positions_m what leads to the next one, where that is within_m too, or 0. The
/// fourth lane is 0.
void find_alternatives(std::span<const double> positions_m, std::span<const std::int64_t> points, double step_m,
                       double within_m, std::span<Lanes> out);
void dequantise(std::span<const std::int64_t> points, double step_m, std::span<double> out_m);

}  // namespace pneuma::codec
