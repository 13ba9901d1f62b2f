// How rows answer to each other's impulses, number by number: for few rows, or many bodies.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "physics/contact/dense_kernels.h"
#include "physics/contact/row_direction.h"
#include "physics/lanes/isa.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// A symmetric matrix W of 3 x 3 blocks, 1/kg, along the rows' axes.
class DenseRows {
 public:
  /// What impulses make of the rows' velocities: a vector, so that shares of two may be added.
  using Velocities = std::vector<double>;

  explicit DenseRows(std::size_t rows);

  /// Block (row, by) and its transpose.
  void set_block(std::size_t row, std::size_t by, const Eigen::Matrix3d& block_1_kg);
  /// On the diagonal, after its block is set.
  void add_softness(std::size_t row, double softness_1_kg);

  [[nodiscard]] std::size_t count() const { return rows_; }
  [[nodiscard]] double diagonal_1_kg(std::size_t at) const { return w(at, at); }
  [[nodiscard]] Velocities at_rest() const { return Velocities(stride_, 0.0); }
  [[nodiscard]] Vec3d velocity_m_s(std::size_t row, const Velocities& velocities) const {
    return Vec3d::Map(velocities.data() + 3 * row);
  }
  void push(std::size_t row, const Vec3d& impulse_n_s, Velocities& velocities) const;
  /// `impulses_n_s`: three a row.
  void push_all(std::span<const double> impulses_n_s, Velocities& velocities) const;

  /// Takes the part of W that the directions span. False where it is not positive definite.
  bool factor(std::span<const RowDirection> directions);
  /// x with that part times x = b, in the place of b; one number a direction.
  void solve(std::span<double> b);

 private:
  [[nodiscard]] double& w(std::size_t at, std::size_t by) { return w_[by * stride_ + at]; }
  [[nodiscard]] double w(std::size_t at, std::size_t by) const { return w_[by * stride_ + at]; }
  [[nodiscard]] const double* column(std::size_t by) const { return w_.data() + by * stride_; }

  std::size_t rows_;
  std::size_t stride_;
  std::vector<double> w_;  // by columns (dense_kernels.h)
  std::size_t direction_count_ = 0;
  std::vector<double> reduced_;  // its factor
  std::vector<double> padded_;   // scratch of solve
  const DenseKernels* kernels_ = &dense_kernels(isa_in_use());
};

}  // namespace pneuma::physics
