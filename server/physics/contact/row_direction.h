// Where the impulses of rows that are solved together may go.
#pragma once

#include <cstddef>

namespace pneuma::physics {

/// One coordinate of the rows' impulses. A row has three: along its normal, and two across it. Or it is a mix of the
/// two across: the tangent of a disc at its edge.
struct RowDirection {
  std::size_t at = 0;  // the coordinate
  double share = 1.0;
  double next_share = 0.0;  // of at + 1
  double bend_1_kg = 0.0;   // what keeping to the edge adds

  [[nodiscard]] std::size_t row() const { return at / 3; }
  [[nodiscard]] std::size_t axis() const { return at % 3; }
};

/// Of the diagonal: rows that say the same twice must not make a matrix singular.
inline constexpr double row_regularisation = 1e-9;

}  // namespace pneuma::physics
