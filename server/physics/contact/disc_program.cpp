#include "physics/contact/disc_program.h"

#include <algorithm>
#include <cmath>

namespace pneuma::physics {
namespace {

constexpr int steps_max = 20;
constexpr int sweeps_a_step = 4;
constexpr int line_searches_max = 12;
// Of the diagonal: rows that say the same twice must not make the matrix singular.
constexpr double regularisation = 1e-9;
// Of a disc's radius: what is nearer to its edge slides.
constexpr double edge_share = 1e-9;

}  // namespace

DiscProgram::DiscProgram(std::size_t rows) : rows_(static_cast<Eigen::Index>(rows)) {
  w_.setZero(3 * rows_, 3 * rows_);
  q_.setZero(3 * rows_);
  f_.setZero(3 * rows_);
  radii_n_s_.assign(rows, 0.0);
  across_1_kg_.assign(rows, 0.0);
  kinds_.assign(rows, Kind::contact);
}

void DiscProgram::set_row(std::size_t row, const Vec3d& wanted_m_s, const Vec3d& start_n_s, double across_1_kg) {
  q_.segment<3>(3 * static_cast<Eigen::Index>(row)) = wanted_m_s;
  f_.segment<3>(3 * static_cast<Eigen::Index>(row)) = start_n_s;
  across_1_kg_[row] = across_1_kg;
}

void DiscProgram::set_block(std::size_t row, std::size_t by, const Eigen::Matrix3d& block_1_kg) {
  const auto i = 3 * static_cast<Eigen::Index>(row);
  const auto j = 3 * static_cast<Eigen::Index>(by);
  w_.block<3, 3>(i, j) = block_1_kg;
  if (i != j) w_.block<3, 3>(j, i) = block_1_kg.transpose();
}

void DiscProgram::set_free(std::size_t row, bool also_along) {
  if (kinds_[row] != Kind::given) kinds_[row] = also_along ? Kind::tie : Kind::guide;
}

void DiscProgram::set_given(std::size_t row) {
  kinds_[row] = Kind::given;
}

void DiscProgram::add_softness(std::size_t row, double softness_1_kg) {
  const auto i = 3 * static_cast<Eigen::Index>(row);
  for (Eigen::Index axis = 0; axis < 3; ++axis) w_(i + axis, i + axis) += softness_1_kg;
}

double DiscProgram::set_disc(std::size_t row, double radius_n_s) {
  const double change_n_s = std::abs(radius_n_s - radii_n_s_[row]);
  radii_n_s_[row] = radius_n_s;
  return change_n_s * across_1_kg_[row];
}

void DiscProgram::project(Eigen::VectorXd& f) const {
  for (Eigen::Index row = 0; row < rows_; ++row) {
    const Kind kind = kind_of(row);
    if (kind == Kind::guide) f[3 * row] = 0.0;
    if (kind != Kind::contact) continue;
    f[3 * row] = std::max(0.0, f[3 * row]);
    const double radius = radii_n_s_[static_cast<std::size_t>(row)];
    const double length = std::hypot(f[3 * row + 1], f[3 * row + 2]);
    if (length > radius) f.segment<2>(3 * row + 1) *= radius / length;
  }
}

double DiscProgram::stop(Eigen::Index at) {
  if (!(w_(at, at) > 0.0)) return 0.0;
  const double change = -gradient_[at] / w_(at, at);
  f_[at] += change;
  gradient_ += change * w_.col(at);
  return std::abs(change) * w_(at, at);
}

double DiscProgram::sweep() {
  double largest_m_s = 0.0;
  for (Eigen::Index row = 0; row < rows_; ++row) {
    const Eigen::Index n = 3 * row;
    if (const Kind kind = kind_of(row); kind != Kind::contact) {
      if (kind == Kind::tie) largest_m_s = std::max(largest_m_s, stop(n));
      if (kind != Kind::given) largest_m_s = std::max({largest_m_s, stop(n + 1), stop(n + 2)});
      continue;
    }
    if (w_(n, n) > 0.0) {
      const double change = std::max(0.0, f_[n] - gradient_[n] / w_(n, n)) - f_[n];
      if (change != 0.0) {
        f_[n] += change;
        gradient_ += change * w_.col(n);
        largest_m_s = std::max(largest_m_s, std::abs(change) * w_(n, n));
      }
    }
    const double radius = radii_n_s_[static_cast<std::size_t>(row)];
    const double across = across_1_kg_[static_cast<std::size_t>(row)];
    if (!(across > 0.0) || (radius <= 0.0 && f_[n + 1] == 0.0 && f_[n + 2] == 0.0)) continue;
    Eigen::Vector2d rubbed = f_.segment<2>(n + 1) - gradient_.segment<2>(n + 1) / across;
    const double length = rubbed.norm();
    if (length > radius) rubbed *= radius / length;
    const Eigen::Vector2d change = rubbed - f_.segment<2>(n + 1);
    if (change.isZero(0.0)) continue;
    f_.segment<2>(n + 1) = rubbed;
    gradient_ += change[0] * w_.col(n + 1) + change[1] * w_.col(n + 2);
    largest_m_s = std::max(largest_m_s, change.norm() * across);
  }
  return largest_m_s;
}

void DiscProgram::find_directions() {
  directions_.clear();
  for (Eigen::Index row = 0; row < rows_; ++row) {
    const Eigen::Index n = 3 * row;
    if (const Kind kind = kind_of(row); kind != Kind::contact) {
      if (kind == Kind::tie) directions_.push_back({.at = n});
      if (kind == Kind::given) continue;
      directions_.push_back({.at = n + 1});
      directions_.push_back({.at = n + 2});
      continue;
    }
    if (f_[n] > 0.0) directions_.push_back({.at = n});
    const double radius = radii_n_s_[static_cast<std::size_t>(row)];
    if (!(radius > 0.0)) continue;
    const double length = std::hypot(f_[n + 1], f_[n + 2]);
    if (length < radius * (1.0 - edge_share)) {
      directions_.push_back({.at = n + 1});
      directions_.push_back({.at = n + 2});
    } else {
      const double inwards = -(gradient_[n + 1] * f_[n + 1] + gradient_[n + 2] * f_[n + 2]) / (length * length);
      directions_.push_back({.at = n + 1,
                             .share = -f_[n + 2] / length,
                             .next_share = f_[n + 1] / length,
                             .bend_1_kg = std::max(0.0, inwards)});
    }
  }
}

// The share of the step at which the first normal impulse ends or the first disc's edge is reached.
double DiscProgram::longest_inside(const Eigen::VectorXd& step) const {
  double longest = 1.0;
  for (Eigen::Index row = 0; row < rows_; ++row) {
    const Eigen::Index n = 3 * row;
    if (kind_of(row) != Kind::contact) continue;
    if (step[n] < 0.0 && f_[n] > 0.0) longest = std::min(longest, -f_[n] / step[n]);
    const double radius = radii_n_s_[static_cast<std::size_t>(row)];
    const double squared = step.segment<2>(n + 1).squaredNorm();
    if (!(squared > 0.0) || !(radius > 0.0)) continue;
    const double along = f_.segment<2>(n + 1).dot(step.segment<2>(n + 1));
    const double room = f_.segment<2>(n + 1).squaredNorm() - radius * radius;
    if (room < -1e-6 * radius * radius) {
      longest = std::min(longest, (-along + std::sqrt(along * along - squared * room)) / squared);
    }
  }
  return longest;
}

bool DiscProgram::step_together() {
  find_directions();
  const auto count = static_cast<Eigen::Index>(directions_.size());
  if (count == 0) return false;
  Eigen::MatrixXd reduced(count, count);
  Eigen::VectorXd right(count);
  for (Eigen::Index b = 0; b < count; ++b) {
    const Direction& by = directions_[static_cast<std::size_t>(b)];
    for (Eigen::Index a = b; a < count; ++a) {
      const Direction& of = directions_[static_cast<std::size_t>(a)];
      double value = by.share * of.share * w_(of.at, by.at);
      if (of.next_share != 0.0) value += by.share * of.next_share * w_(of.at + 1, by.at);
      if (by.next_share != 0.0) {
        value += by.next_share * of.share * w_(of.at, by.at + 1);
        if (of.next_share != 0.0) value += by.next_share * of.next_share * w_(of.at + 1, by.at + 1);
      }
      reduced(a, b) = value;
    }
    reduced(b, b) = reduced(b, b) * (1.0 + regularisation) + by.bend_1_kg;
    right[b] = -(gradient_[by.at] * by.share);
    if (by.next_share != 0.0) right[b] -= gradient_[by.at + 1] * by.next_share;
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(reduced);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::VectorXd found = factor.solve(right);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(3 * rows_);
  for (Eigen::Index a = 0; a < count; ++a) {
    const Direction& of = directions_[static_cast<std::size_t>(a)];
    step[of.at] += of.share * found[a];
    if (of.next_share != 0.0) step[of.at + 1] += of.next_share * found[a];
  }
  const double before = 0.5 * f_.dot(gradient_ + q_);
  double length = 1.0;
  for (int shortening = 0; shortening < line_searches_max; ++shortening) {
    Eigen::VectorXd f = f_ + length * step;
    project(f);
    Eigen::VectorXd gradient = q_ + w_ * f;
    if (0.5 * f.dot(gradient + q_) < before) {
      f_.swap(f);
      gradient_.swap(gradient);
      return true;
    }
    length = shortening + 2 == line_searches_max ? longest_inside(step) : 0.5 * length;
  }
  return false;
}

bool DiscProgram::solve(double enough_m_s, std::uint32_t& factorisations) {
  project(f_);
  gradient_ = q_ + w_ * f_;
  for (int step = 0; step < steps_max; ++step) {
    for (int i = 0; i < sweeps_a_step; ++i) {
      if (sweep() <= enough_m_s) return true;
    }
    ++factorisations;
    if (step_together()) continue;
    for (int i = 0; i < 2 * sweeps_a_step; ++i) {
      if (sweep() <= enough_m_s) return true;
    }
  }
  return false;
}

}  // namespace pneuma::physics
