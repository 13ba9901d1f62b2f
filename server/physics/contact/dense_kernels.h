// Dense symmetric matrices of a few hundred numbers a side, as programs of contact have them. One source
// (dense_kernel_source.h), compiled for each instruction set as the lane kernels are; all do the same operations on
// each number in the same order.
#pragma once

#include <cstddef>

namespace pneuma::physics {

/// Matrices lie by columns, each `stride` apart; there are as many columns as that. What is beyond `count` is 0, in
/// vectors too. `stride` is a multiple of dense_block.
inline constexpr std::size_t dense_block = 8;
[[nodiscard]] constexpr std::size_t dense_stride(std::size_t count) {
  return (count + dense_block - 1) / dense_block * dense_block;
}

struct DenseKernels {
  /// Puts L in the place of the lower triangle of L L^T, and anything above it. False where that is not positive
  /// definite.
  bool (*factor)(double* matrix, std::size_t count, std::size_t stride) = nullptr;
  /// x with L L^T x = b, in the place of b.
  void (*solve)(const double* factor, std::size_t count, std::size_t stride, double* b) = nullptr;
  /// The same of many right-hand sides: `count` rows of `width` numbers, a multiple of dense_block.
  void (*solve_many)(const double* factor, std::size_t count, std::size_t stride, double* rows,
                     std::size_t width) = nullptr;
  /// Adds the matrix times x.
  void (*add_product)(const double* matrix, std::size_t count, std::size_t stride, const double* x,
                      double* sum) = nullptr;
  /// Adds three shares of a column, each to a vector of its own: they lie behind each other. `size` is a multiple of
  /// dense_block.
  void (*add_column)(const double* column, const double* shares, std::size_t size, double* sums) = nullptr;
};

enum class Isa;
/// has_isa(isa).
[[nodiscard]] const DenseKernels& dense_kernels(Isa isa);

}  // namespace pneuma::physics
