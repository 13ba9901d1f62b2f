// What the matrices of rows that are solved together have in common.
#pragma once

#include <cstddef>
#include <span>

#include "physics/contact/dense_kernels.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// A matrix W of rows holds three numbers a row, in the world's axes: all x, then all y, then all z. Each of the three
/// has the length of a column (dense_kernels.h); what is beyond the rows is 0.
[[nodiscard]] inline Vec3d at_row(std::span<const double> values, std::size_t row) {
  const std::size_t stride = values.size() / 3;
  return {values[row], values[stride + row], values[2 * stride + row]};
}
inline void set_row(std::span<double> values, std::size_t row, const Vec3d& value) {
  const std::size_t stride = values.size() / 3;
  for (std::size_t axis = 0; axis < 3; ++axis) values[axis * stride + row] = value[static_cast<Eigen::Index>(axis)];
}

/// Four sums, added in one order on every machine. The size is a multiple of dense_block.
[[nodiscard]] inline double dot(std::span<const double> a, std::span<const double> b) {
  double sums[4] = {};
  for (std::size_t i = 0; i < a.size(); i += 4) {
    for (std::size_t lane = 0; lane < 4; ++lane) sums[lane] += a[i + lane] * b[i + lane];
  }
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

}  // namespace pneuma::physics
