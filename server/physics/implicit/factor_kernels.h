// The inner loops of a solve with a factored matrix (sparse_cholesky.h). One source (factor_kernel_source.h), compiled
// for each instruction set as the lane kernels are; all do the same operations on each number in the same order.
#pragma once

#include <cstddef>
#include <cstdint>

namespace pneuma::physics {

/// A row of right-hand sides, and then of solutions, side by side.
template <std::size_t Columns>
struct alignas(Columns * sizeof(double)) FactorRow {
  double columns[Columns];
};

/// Entries of L below its unit diagonal, by columns or by rows. Those of line i are [begins[i], begins[i + 1]), each
/// with its place in the line.
struct FactorLines {
  const std::uint32_t* begins = nullptr;
  const std::uint32_t* places = nullptr;
  const double* values = nullptr;
};

/// A matrix L D L^T.
struct Factor {
  FactorLines columns;
  FactorLines rows;  // may be left out; the solve is faster with them
  const double* inverse_diagonal = nullptr;
  std::size_t count = 0;
};

struct FactorKernels {
  void (*solve4)(const Factor& factor, FactorRow<4>* rows) = nullptr;
  void (*solve8)(const Factor& factor, FactorRow<8>* rows) = nullptr;
};

enum class Isa;
/// has_isa(isa).
[[nodiscard]] const FactorKernels& factor_kernels(Isa isa);

}  // namespace pneuma::physics
