#include "physics/contact/dense_rows.h"

#include <algorithm>

namespace pneuma::physics {

DenseRows::DenseRows(std::size_t rows) : rows_(rows), stride_(dense_stride(3 * rows)), w_(stride_ * stride_, 0.0) {}

void DenseRows::set_block(std::size_t row, std::size_t by, const Eigen::Matrix3d& block_1_kg) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double value = block_1_kg(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      w(3 * row + i, 3 * by + j) = value;
      if (row != by) w(3 * by + j, 3 * row + i) = value;
    }
  }
}

void DenseRows::add_softness(std::size_t row, double softness_1_kg) {
  for (std::size_t axis = 0; axis < 3; ++axis) w(3 * row + axis, 3 * row + axis) += softness_1_kg;
}

void DenseRows::push(std::size_t row, const Vec3d& impulse_n_s, Velocities& velocities) const {
  const std::size_t n = 3 * row;
  if (impulse_n_s[0] != 0.0) {
    kernels_->add_columns(column(n), impulse_n_s[0], column(n), 0.0, stride_, velocities.data());
  }
  if (impulse_n_s[1] == 0.0 && impulse_n_s[2] == 0.0) return;
  kernels_->add_columns(column(n + 1), impulse_n_s[1], column(n + 2), impulse_n_s[2], stride_, velocities.data());
}

void DenseRows::push_all(std::span<const double> impulses_n_s, Velocities& velocities) const {
  kernels_->add_product(w_.data(), 3 * rows_, stride_, impulses_n_s.data(), velocities.data());
}

bool DenseRows::factor(std::span<const RowDirection> directions) {
  direction_count_ = directions.size();
  const std::size_t stride = dense_stride(direction_count_);
  reduced_.resize(stride * stride);
  for (std::size_t b = 0; b < stride; ++b) {
    double* to = reduced_.data() + b * stride;
    std::fill(to + b / dense_block * dense_block, to + stride, 0.0);
    if (b >= direction_count_) continue;
    const RowDirection& by = directions[b];
    const double* first = column(by.at);
    if (by.next_share == 0.0) {
      for (std::size_t a = b; a < direction_count_; ++a) {
        const RowDirection& of = directions[a];
        to[a] = by.share * of.share * first[of.at];
        if (of.next_share != 0.0) to[a] += by.share * of.next_share * first[of.at + 1];
      }
    } else {
      const double* second = column(by.at + 1);
      for (std::size_t a = b; a < direction_count_; ++a) {
        const RowDirection& of = directions[a];
        to[a] = of.share * (by.share * first[of.at] + by.next_share * second[of.at]);
        if (of.next_share == 0.0) continue;
        to[a] += of.next_share * (by.share * first[of.at + 1] + by.next_share * second[of.at + 1]);
      }
    }
    to[b] = to[b] * (1.0 + row_regularisation) + by.bend_1_kg;
  }
  return kernels_->factor(reduced_.data(), direction_count_, direction_count_, stride);
}

void DenseRows::solve(std::span<double> b) {
  padded_.assign(dense_stride(direction_count_), 0.0);
  std::ranges::copy(b, padded_.begin());
  kernels_->solve(reduced_.data(), direction_count_, dense_stride(direction_count_), padded_.data());
  std::copy_n(padded_.begin(), b.size(), b.begin());
}

}  // namespace pneuma::physics
