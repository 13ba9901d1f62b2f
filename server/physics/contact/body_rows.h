// How rows of few bodies answer to each other's impulses: a number for each two rows, and a few columns for each body.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/response.h"
#include "physics/contact/row_matrix.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {

/// W = S x 1 + sum U_b D_b U_b^T, 1/kg. S has one number for each two rows: what the springs of soft bodies make of it,
/// the same in every direction. Each body b adds a few columns: its turning, its gas, all of a rigid body's motion
/// (response.h). So W takes the inverse of a matrix with a number a row, and the columns come by Woodbury's identity.
class BodyRows {
 public:
  BodyRows(std::size_t rows, std::size_t bodies);

  /// In S: (row, by) and (by, row).
  void set_number(std::size_t row, std::size_t by, double number_1_kg);
  /// A body has a part in a row: as its first support, or as its second by a sign of -1.
  void add_part(std::size_t row, std::uint32_t body, double sign, const LowRankColumns& columns);
  /// After all numbers are set.
  void add_softness(std::size_t row, double softness_1_kg) { numbers_[row * stride_ + row] += softness_1_kg; }

  [[nodiscard]] std::size_t count() const { return rows_; }
  [[nodiscard]] std::size_t stride() const { return stride_; }
  /// v = W f, each as in row_matrix.h.
  void multiply(std::span<const double> f_n_s, std::span<double> v_m_s) const;

  /// Factors W + R, where R has a row's penalty at each of its three places. False where S + R is not positive
  /// definite, or W + R has no finite inverse.
  bool factor(std::span<const double> penalties_1_kg);
  /// x with (W + R) x = b, in the place of b.
  void solve(std::span<double> b);

 private:
  static constexpr std::size_t columns_a_body = LowRankColumns::count;
  [[nodiscard]] std::span<const double> column(const std::vector<double>& columns, std::size_t k) const {
    return std::span(columns).subspan(3 * stride_ * k, 3 * stride_);
  }
  void multiply_numbers(const std::vector<double>& numbers, std::span<const double> x, std::span<double> sums) const;
  void drop_empty_columns();
  bool factor_columns();

  std::size_t rows_;
  std::size_t stride_;
  std::vector<double> numbers_;          // S, by columns
  std::vector<double> columns_;          // U, each column as in row_matrix.h
  std::vector<double> signs_;            // D, one a column
  bool has_all_columns_ = true;          // also those that are 0
  std::vector<double> inverse_;          // of S + R, by columns
  std::vector<double> answered_;         // (S + R)^-1 U
  Eigen::MatrixXd capacitance_inverse_;  // (D + U^T (S + R)^-1 U)^-1
  std::vector<double> right_;            // scratch of solve
  Eigen::VectorXd shares_, answers_;     // likewise
  const DenseKernels* kernels_ = &dense_kernels(isa_in_use());
};

}  // namespace pneuma::physics
