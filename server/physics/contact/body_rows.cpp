#include "physics/contact/body_rows.h"

#include <algorithm>

namespace pneuma::physics {

BodyRows::BodyRows(std::size_t rows, std::size_t bodies)
    : rows_(rows),
      stride_(dense_stride(rows)),
      numbers_(stride_ * stride_, 0.0),
      columns_(columns_a_body * bodies * 3 * stride_, 0.0),
      signs_(columns_a_body * bodies, 1.0) {}

void BodyRows::set_number(std::size_t row, std::size_t by, double number_1_kg) {
  numbers_[by * stride_ + row] = number_1_kg;
  numbers_[row * stride_ + by] = number_1_kg;
}

// A body that meets itself has one part in the row, of both supports.
void BodyRows::add_part(std::size_t row, std::uint32_t body, double sign, const LowRankColumns& columns) {
  for (std::size_t k = 0; k < columns_a_body; ++k) {
    const auto of = static_cast<Eigen::Index>(k);
    const std::size_t column = columns_a_body * body + k;
    signs_[column] = columns.signs[of];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      columns_[(3 * column + axis) * stride_ + row] += sign * columns.columns(static_cast<Eigen::Index>(axis), of);
    }
  }
}

// Adds them times x.
void BodyRows::multiply_numbers(const std::vector<double>& numbers, std::span<const double> x,
                                std::span<double> sums) const {
  for (std::size_t row = 0; row < rows_; ++row) {
    const Vec3d shares = at_row(x, row);
    kernels_->add_column(numbers.data() + row * stride_, shares.data(), stride_, sums.data());
  }
}

void BodyRows::multiply(std::span<const double> f_n_s, std::span<double> v_m_s) const {
  std::ranges::fill(v_m_s, 0.0);
  multiply_numbers(numbers_, f_n_s, v_m_s);
  for (std::size_t k = 0; k < signs_.size(); ++k) {
    const std::span<const double> of = column(columns_, k);
    const double share = signs_[k] * dot(of, f_n_s);
    for (std::size_t i = 0; i < of.size(); ++i) v_m_s[i] += share * of[i];
  }
}

bool BodyRows::factor(std::span<const double> penalties_1_kg) {
  drop_empty_columns();
  std::vector<double> factor = numbers_;
  for (std::size_t row = 0; row < rows_; ++row) factor[row * stride_ + row] += penalties_1_kg[row];
  if (!kernels_->factor(factor.data(), rows_, stride_)) return false;
  inverse_.assign(stride_ * stride_, 0.0);
  for (std::size_t row = 0; row < rows_; ++row) inverse_[row * stride_ + row] = 1.0;
  kernels_->solve_many(factor.data(), rows_, stride_, inverse_.data(), stride_);
  return factor_columns();
}

// A guided body has one column in place of six, and one without gas none for it.
void BodyRows::drop_empty_columns() {
  if (!has_all_columns_) return;
  has_all_columns_ = false;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < signs_.size(); ++k) {
    const std::span<const double> of = column(columns_, k);
    if (std::ranges::all_of(of, [](double value) { return value == 0.0; })) continue;
    std::ranges::copy(of, columns_.begin() + static_cast<std::ptrdiff_t>(3 * stride_ * kept));
    signs_[kept++] = signs_[k];
  }
  signs_.resize(kept);
  columns_.resize(3 * stride_ * kept);
}

bool BodyRows::factor_columns() {
  const std::size_t width = signs_.size();
  answered_.assign(columns_.size(), 0.0);
  for (std::size_t k = 0; k < width; ++k) {
    multiply_numbers(inverse_, column(columns_, k), std::span(answered_).subspan(3 * stride_ * k, 3 * stride_));
  }
  const auto size = static_cast<Eigen::Index>(width);
  Eigen::MatrixXd capacitance(size, size);
  for (std::size_t k = 0; k < width; ++k) {
    for (std::size_t j = 0; j < width; ++j) {
      const double sign = j == k ? signs_[k] : 0.0;
      capacitance(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(k)) =
          sign + dot(column(columns_, j), column(answered_, k));
    }
  }
  if (width > 0) capacitance_inverse_ = Eigen::PartialPivLU<Eigen::MatrixXd>(capacitance).inverse();
  return width == 0 || capacitance_inverse_.allFinite();
}

void BodyRows::solve(std::span<double> b) {
  right_.assign(b.begin(), b.end());
  std::ranges::fill(b, 0.0);
  multiply_numbers(inverse_, right_, b);
  const std::size_t width = signs_.size();
  if (width == 0) return;
  shares_.resize(static_cast<Eigen::Index>(width));
  for (std::size_t k = 0; k < width; ++k) {
    shares_[static_cast<Eigen::Index>(k)] = dot(column(answered_, k), right_);
  }
  answers_.noalias() = capacitance_inverse_ * shares_;
  for (std::size_t k = 0; k < width; ++k) {
    const std::span<const double> of = column(answered_, k);
    const double share = answers_[static_cast<Eigen::Index>(k)];
    for (std::size_t i = 0; i < of.size(); ++i) b[i] -= share * of[i];
  }
}

}  // namespace pneuma::physics
