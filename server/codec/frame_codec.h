// Vertex frames as integers on a grid, and those as bytes: pure functions over arrays, used by server and client alike.
// The byte format is proto/WIRE.md, "Frame payload".
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"

namespace pneuma::codec {

/// Grid coordinates of a body's vertices, x y z in vertex order.
using Lattice = std::vector<std::int64_t>;

/// Edge of the grid on which no point is further than max_error_m (Euclidean) from a grid point: 2 e / sqrt(3), less
/// what rounding to double may take.
[[nodiscard]] double grid_step_m(double max_error_m);

/// Nearest grid coordinates of positions_m (3 a vertex; finite and within base::coordinate_max_m). `out` has the same
/// size.
void quantise(std::span<const double> positions_m, double step_m, std::span<std::int64_t> out);
void dequantise(std::span<const std::int64_t> lattice, double step_m, std::span<double> out_m);

/// Appends one body's block that stands alone.
void encode_key(std::span<const std::int64_t> lattice, std::string& payload);
/// Appends one body's block relative to `base`, the same body's lattice in the frame built on. An unchanged body takes
/// one byte.
void encode_delta(std::span<const std::int64_t> lattice, std::span<const std::int64_t> base, std::string& payload);

/// Reads the blocks of a whole payload: one a body, in order. On entry `bodies` holds the base frame's lattices (for a
/// key frame only their sizes count); on success the frame's. Bytes that do not fit change nothing and give a status
/// that names the body and what was wrong. Time and memory are bounded by the sizes of `bodies` and the payload.
[[nodiscard]] base::Status decode(std::string_view payload, bool key, std::span<Lattice> bodies);

}  // namespace pneuma::codec
