#include "physics/contact/dense_rows.h"

#include <algorithm>

namespace pneuma::physics {

DenseRows::DenseRows(std::size_t rows) : rows_(rows), stride_(dense_stride(rows)), w_(3 * stride_ * 3 * stride_, 0.0) {}

void DenseRows::set_block(std::size_t row, std::size_t by, const Eigen::Matrix3d& block_1_kg) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double value = block_1_kg(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      w(i * stride_ + row, j * stride_ + by) = value;
      w(j * stride_ + by, i * stride_ + row) = value;
    }
  }
}

void DenseRows::add_softness(std::size_t row, double softness_1_kg) {
  for (std::size_t axis = 0; axis < 3; ++axis) w(axis * stride_ + row, axis * stride_ + row) += softness_1_kg;
}

void DenseRows::multiply(std::span<const double> f_n_s, std::span<double> v_m_s) const {
  std::ranges::fill(v_m_s, 0.0);
  kernels_->add_product(w_.data(), 3 * stride_, 3 * stride_, f_n_s.data(), v_m_s.data());
}

bool DenseRows::factor(std::span<const double> penalties_1_kg) {
  factor_ = w_;
  const std::size_t side = 3 * stride_;
  for (std::size_t at = 0; at < side; ++at) {
    const std::size_t row = at % stride_;
    factor_[at * side + at] += row < rows_ ? penalties_1_kg[row] : 1.0;
  }
  return kernels_->factor(factor_.data(), side, side);
}

void DenseRows::solve(std::span<double> b) const {
  kernels_->solve(factor_.data(), 3 * stride_, 3 * stride_, b.data());
}

}  // namespace pneuma::physics
