#include "physics/contact/body_rows.h"

#include <algorithm>

namespace pneuma::physics {

BodyRows::BodyRows(std::size_t rows, std::size_t bodies)
    : rows_(rows),
      stride_(dense_stride(rows)),
      numbers_(stride_ * stride_, 0.0),
      axes_(rows, Eigen::Matrix3d::Identity()),
      parts_(rows),
      signs_(bodies, LowRankColumns::Signs::Ones()) {}

void BodyRows::set_number(std::size_t row, std::size_t by, double number_1_kg) {
  number(row, by) = number_1_kg;
  number(by, row) = number_1_kg;
}

// A body that meets itself has one part in the row, of both supports.
void BodyRows::add_part(std::size_t row, std::uint32_t body, double sign, const LowRankColumns& columns) {
  RowParts& parts = parts_[row];
  signs_[body] = columns.signs;
  const bool is_known = parts.count > 0 && parts.sides[0].body == body;
  Part& part = is_known ? parts.sides[0] : parts.sides[parts.count++];
  part.body = body;
  part.taken += sign * columns.columns;
  part.given = part.taken * columns.signs.asDiagonal();
}

double BodyRows::diagonal_1_kg(std::size_t at) const {
  const std::size_t row = at / 3;
  const Vec3d axis = axes_[row].col(static_cast<Eigen::Index>(at % 3));
  double sum = number(row, row);
  for (std::size_t i = 0; i < parts_[row].count; ++i) {
    const Part& part = parts_[row].sides[i];
    sum += (part.taken.transpose() * axis).dot(part.given.transpose() * axis);
  }
  return sum;
}

Vec3d BodyRows::velocity_m_s(std::size_t row, const Velocities& velocities) const {
  Vec3d sum(velocities[row], velocities[stride_ + row], velocities[2 * stride_ + row]);
  for (std::size_t i = 0; i < parts_[row].count; ++i) {
    const Part& part = parts_[row].sides[i];
    const double* shares = velocities.data() + 3 * stride_ + columns_a_body * part.body;
    sum += part.given * Eigen::Map<const Shares>(shares);
  }
  return axes_[row].transpose() * sum;
}

void BodyRows::push(std::size_t row, const Vec3d& impulse_n_s, Velocities& velocities) const {
  const Vec3d impulse = axes_[row] * impulse_n_s;
  kernels_->add_column(numbers_.data() + row * stride_, impulse.data(), stride_, velocities.data());
  for (std::size_t i = 0; i < parts_[row].count; ++i) {
    const Part& part = parts_[row].sides[i];
    double* shares = velocities.data() + 3 * stride_ + columns_a_body * part.body;
    Eigen::Map<Shares>(shares) += part.taken.transpose() * impulse;
  }
}

void BodyRows::push_all(std::span<const double> impulses_n_s, Velocities& velocities) const {
  for (std::size_t row = 0; row < rows_; ++row) {
    const Vec3d impulse = Vec3d::Map(impulses_n_s.data() + 3 * row);
    if (!impulse.isZero(0.0)) push(row, impulse, velocities);
  }
}

bool BodyRows::factor(std::span<const RowDirection> directions) {
  place(directions);
  return factor_numbers() && factor_sliding(directions) && factor_columns();
}

// A row sticks where its three directions follow each other.
void BodyRows::place(std::span<const RowDirection> directions) {
  placed_.clear();
  sticking_.clear();
  sliding_.clear();
  slid_.clear();
  const auto is_plain = [&](std::size_t a, std::size_t at) {
    return a < directions.size() && directions[a].at == at && directions[a].share == 1.0 &&
           directions[a].next_share == 0.0 && directions[a].bend_1_kg == 0.0;
  };
  for (std::size_t a = 0; a < directions.size(); ++a) {
    const RowDirection& direction = directions[a];
    const std::size_t row = direction.row();
    const Eigen::Matrix3d& axes = axes_[row];
    if (direction.axis() == 0 && is_plain(a, 3 * row) && is_plain(a + 1, 3 * row + 1) && is_plain(a + 2, 3 * row + 2)) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) placed_.push_back({row, sticking_.size(), axes.col(axis), true});
      sticking_.push_back(row);
      a += 2;
      continue;
    }
    if (sliding_.empty() || sliding_.back() != row) sliding_.push_back(row);
    const auto axis = static_cast<Eigen::Index>(direction.axis());
    Vec3d along = direction.share * axes.col(axis);
    if (direction.next_share != 0.0) along += direction.next_share * axes.col(axis + 1);
    slid_.push_back(a);
    placed_.push_back({row, sliding_.size() - 1, along, false});
  }
  leading_ = dense_stride(sticking_.size());
  for (const std::size_t a : slid_) placed_[a].slot += leading_;
}

bool BodyRows::factor_numbers() {
  const std::size_t total = leading_ + sliding_.size();
  const std::size_t stride = dense_stride(total);
  factor_.resize(stride * stride);
  for (std::size_t c = 0; c < stride; ++c) {
    double* to = factor_.data() + c * stride;
    std::fill(to + c / dense_block * dense_block, to + stride, 0.0);
    const bool sticks = c < leading_;
    if (sticks && c >= sticking_.size()) to[c] = 1.0;  // of a block that is not full
    if (c >= total || (sticks && c >= sticking_.size())) continue;
    const double* from = numbers_.data() + (sticks ? sticking_[c] : sliding_[c - leading_]) * stride_;
    for (std::size_t r = c; sticks && r < sticking_.size(); ++r) to[r] = from[sticking_[r]];
    for (std::size_t r = sticks ? 0 : c - leading_; r < sliding_.size(); ++r) to[leading_ + r] = from[sliding_[r]];
    if (sticks) to[c] *= 1.0 + row_regularisation;
  }
  return kernels_->factor(factor_.data(), leading_, total, stride);
}

bool BodyRows::factor_sliding(std::span<const RowDirection> directions) {
  const std::size_t count = slid_.size();
  const std::size_t stride = dense_stride(count);
  const std::size_t from_stride = dense_stride(leading_ + sliding_.size());
  slid_factor_.resize(stride * stride);
  for (std::size_t b = 0; b < stride; ++b) {
    double* to = slid_factor_.data() + b * stride;
    std::fill(to + b / dense_block * dense_block, to + stride, 0.0);
    if (b >= count) continue;
    const Placed& by = placed_[slid_[b]];
    const double* from = factor_.data() + by.slot * from_stride;
    for (std::size_t a = b; a < count; ++a) {
      const Placed& of = placed_[slid_[a]];
      to[a] = from[of.slot] * of.along.dot(by.along);
    }
    to[b] = to[b] * (1.0 + row_regularisation) + directions[slid_[b]].bend_1_kg;
  }
  return count == 0 || kernels_->factor(slid_factor_.data(), count, count, stride);
}

// A guided body has one column in place of six, and one without gas none for it.
void BodyRows::list_columns() {
  if (!used_.empty()) return;
  std::vector<std::uint8_t> is_used(shares(), 0);
  for (const RowParts& parts : parts_) {
    for (std::size_t i = 0; i < parts.count; ++i) {
      for (std::size_t k = 0; k < columns_a_body; ++k) {
        if (parts.sides[i].taken.col(static_cast<Eigen::Index>(k)).isZero(0.0)) continue;
        is_used[columns_a_body * parts.sides[i].body + k] = 1;
      }
    }
  }
  for (std::size_t k = 0; k < is_used.size(); ++k) {
    if (is_used[k] != 0) used_.push_back(k);
  }
}

bool BodyRows::factor_columns() {
  list_columns();
  const std::size_t width = used_.size();
  if (width == 0) return true;
  taken_.assign(placed_.size() * width, 0.0);
  std::vector<double> along(shares(), 0.0);
  for (std::size_t a = 0; a < placed_.size(); ++a) {
    const RowParts& parts = parts_[placed_[a].row];
    for (std::size_t i = 0; i < parts.count; ++i) {
      Eigen::Map<Shares>(along.data() + columns_a_body * parts.sides[i].body) =
          parts.sides[i].taken.transpose() * placed_[a].along;
    }
    for (std::size_t k = 0; k < width; ++k) taken_[a * width + k] = along[used_[k]];
    for (std::size_t i = 0; i < parts.count; ++i) {
      Eigen::Map<Shares>(along.data() + columns_a_body * parts.sides[i].body).setZero();
    }
  }
  answered_ = taken_;
  solve_without_columns(answered_, width);
  const auto size = static_cast<Eigen::Index>(width);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t a = 0; a < placed_.size(); ++a) {
    const double* taken = taken_.data() + a * width;
    const double* answered = answered_.data() + a * width;
    for (std::size_t k = 0; k < width; ++k) {
      if (taken[k] == 0.0) continue;
      sum.col(static_cast<Eigen::Index>(k)) += taken[k] * Eigen::Map<const Eigen::VectorXd>(answered, size);
    }
  }
  for (std::size_t k = 0; k < width; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    sum(at, at) += signs_[used_[k] / columns_a_body][static_cast<Eigen::Index>(used_[k] % columns_a_body)];
  }
  capacitance_.compute(sum);  // symmetric but for its rounding
  return sum.allFinite();
}

void BodyRows::solve(std::span<double> b) {
  solve_without_columns(b, 1);
  const std::size_t width = used_.size();
  if (width == 0) return;
  const auto size = static_cast<Eigen::Index>(width);
  share_.setZero(size);
  for (std::size_t a = 0; a < b.size(); ++a) {
    share_ += b[a] * Eigen::Map<const Eigen::VectorXd>(taken_.data() + a * width, size);
  }
  share_ = capacitance_.solve(share_).eval();
  for (std::size_t a = 0; a < b.size(); ++a) {
    b[a] -= share_.dot(Eigen::Map<const Eigen::VectorXd>(answered_.data() + a * width, size));
  }
}

// Solves for `width` right-hand sides, side by side for each direction. Rows that stick come first and last, in the
// world's axes; between the two, what they leave of those that slide.
void BodyRows::solve_without_columns(std::span<double> b, std::size_t width) {
  const std::size_t total = leading_ + sliding_.size();
  const std::size_t stride = dense_stride(total);
  const std::size_t row_width = dense_stride(3 * width);
  const std::size_t slid_width = dense_stride(width);
  by_row_.assign(total * row_width, 0.0);
  const auto add_along = [&](const Placed& placed, const double* values) {
    double* to = by_row_.data() + placed.slot * row_width;
    for (std::size_t j = 0; j < width; ++j) Vec3d::Map(to + 3 * j) += values[j] * placed.along;
  };
  for (std::size_t a = 0; a < placed_.size(); ++a) {
    if (placed_[a].sticks) add_along(placed_[a], b.data() + a * width);
  }
  kernels_->solve_forward(factor_.data(), leading_, total, stride, by_row_.data(), row_width);
  by_slid_.assign(slid_.size() * slid_width, 0.0);
  for (std::size_t k = 0; k < slid_.size(); ++k) {
    const Placed& placed = placed_[slid_[k]];
    const double* left = by_row_.data() + placed.slot * row_width;
    for (std::size_t j = 0; j < width; ++j) {
      by_slid_[k * slid_width + j] = b[slid_[k] * width + j] + placed.along.dot(Vec3d::Map(left + 3 * j));
    }
  }
  const std::size_t slid_stride = dense_stride(slid_.size());
  kernels_->solve_forward(slid_factor_.data(), slid_.size(), slid_.size(), slid_stride, by_slid_.data(), slid_width);
  kernels_->solve_backward(slid_factor_.data(), slid_.size(), slid_.size(), slid_stride, by_slid_.data(), slid_width);
  std::fill(by_row_.begin() + static_cast<std::ptrdiff_t>(leading_ * row_width), by_row_.end(), 0.0);
  for (std::size_t k = 0; k < slid_.size(); ++k) add_along(placed_[slid_[k]], by_slid_.data() + k * slid_width);
  kernels_->solve_backward(factor_.data(), leading_, total, stride, by_row_.data(), row_width);
  auto slid = by_slid_.begin();
  for (std::size_t a = 0; a < placed_.size(); ++a) {
    const Placed& placed = placed_[a];
    if (!placed.sticks) {
      std::copy_n(slid, width, b.begin() + static_cast<std::ptrdiff_t>(a * width));
      slid += static_cast<std::ptrdiff_t>(slid_width);
      continue;
    }
    const double* from = by_row_.data() + placed.slot * row_width;
    for (std::size_t j = 0; j < width; ++j) b[a * width + j] = placed.along.dot(Vec3d::Map(from + 3 * j));
  }
}

}  // namespace pneuma::physics
