// How rows answer to each other's impulses, number by number: for few rows, or many bodies.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "physics/contact/row_matrix.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {

/// A symmetric matrix W of 3 x 3 blocks, 1/kg.
class DenseRows {
 public:
  explicit DenseRows(std::size_t rows);

  /// Block (row, by) and its transpose.
  void set_block(std::size_t row, std::size_t by, const Eigen::Matrix3d& block_1_kg);
  /// On the diagonal, after its block is set.
  void add_softness(std::size_t row, double softness_1_kg);

  [[nodiscard]] std::size_t count() const { return rows_; }
  [[nodiscard]] std::size_t stride() const { return stride_; }
  /// v = W f, each as in row_matrix.h.
  void multiply(std::span<const double> f_n_s, std::span<double> v_m_s) const;

  /// Factors W + R, where R has a row's penalty at each of its three places. False where that is not positive definite.
  bool factor(std::span<const double> penalties_1_kg);
  /// x with (W + R) x = b, in the place of b.
  void solve(std::span<double> b) const;

 private:
  [[nodiscard]] double& w(std::size_t at, std::size_t by) { return w_[by * 3 * stride_ + at]; }

  std::size_t rows_;
  std::size_t stride_;
  std::vector<double> w_;  // by columns, 3 * stride_ a side
  std::vector<double> factor_;
  const DenseKernels* kernels_ = &dense_kernels(isa_in_use());
};

}  // namespace pneuma::physics
