#include "physics/contact/disc_program.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace pneuma::physics {
namespace {

constexpr int steps_max = 20;
constexpr int sweeps_a_step = 3;
constexpr int line_searches_max = 12;
// Of Newton's steps with friction. Solves that end take 6 of them, of stiff bodies 3.
constexpr int friction_steps_max = 16;
// A step that does not bring the rows nearer by a tenth is tried at this share of its length, and then given up.
// Shorter ones lead no further.
constexpr double friction_gain = 0.9;
constexpr double friction_shortening = 0.4;
constexpr int friction_shortenings_max = 2;
// After so many steps that were given up, the rest would be too.
constexpr int friction_stalls_max = 3;
// Within a step, the friction of rows that slide follows their normal impulses in rounds, to this share of the largest.
constexpr int slide_rounds_max = 10;
constexpr double slide_rounds_share = 1e-3;
// Of the diagonal: rows that say the same twice must not make the matrix singular.
constexpr double regularisation = 1e-9;
// Of a disc's radius: what is nearer to its edge slides.
constexpr double edge_share = 1e-9;

}  // namespace

DiscProgram::DiscProgram(std::size_t rows) : rows_(rows), stride_(dense_stride(3 * rows)) {
  w_.assign(stride_ * stride_, 0.0);
  for (Vector* vector : {&q_, &f_, &gradient_, &step_, &by_step_, &straight_f_, &next_f_, &next_gradient_})
    vector->assign(stride_, 0.0);
  radii_n_s_.assign(rows, 0.0);
  across_1_kg_.assign(rows, 0.0);
  friction_.assign(rows, 0.0);
  kinds_.assign(rows, Kind::contact);
}

void DiscProgram::set_row(std::size_t row, const Vec3d& wanted_m_s, const Vec3d& start_n_s, double across_1_kg) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    q_[3 * row + axis] = wanted_m_s[static_cast<Eigen::Index>(axis)];
    f_[3 * row + axis] = start_n_s[static_cast<Eigen::Index>(axis)];
  }
  across_1_kg_[row] = across_1_kg;
}

void DiscProgram::set_block(std::size_t row, std::size_t by, const Eigen::Matrix3d& block_1_kg) {
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double value = block_1_kg(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      w(3 * row + i, 3 * by + j) = value;
      if (row != by) w(3 * by + j, 3 * row + i) = value;
    }
  }
}

void DiscProgram::set_free(std::size_t row, bool also_along) {
  kinds_[row] = also_along ? Kind::tie : Kind::guide;
}

void DiscProgram::add_softness(std::size_t row, double softness_1_kg) {
  for (std::size_t axis = 0; axis < 3; ++axis) w(3 * row + axis, 3 * row + axis) += softness_1_kg;
}

double DiscProgram::set_disc(std::size_t row, double radius_n_s) {
  const double change_n_s = std::abs(radius_n_s - radii_n_s_[row]);
  radii_n_s_[row] = radius_n_s;
  return change_n_s * across_1_kg_[row];
}

void DiscProgram::project(Vector& f) const {
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::size_t n = 3 * row;
    if (kinds_[row] == Kind::guide) f[n] = 0.0;
    if (kinds_[row] != Kind::contact) continue;
    f[n] = std::max(0.0, f[n]);
    const double length = std::sqrt(f[n + 1] * f[n + 1] + f[n + 2] * f[n + 2]);
    if (length <= radii_n_s_[row]) continue;
    f[n + 1] *= radii_n_s_[row] / length;
    f[n + 2] *= radii_n_s_[row] / length;
  }
}

void DiscProgram::find_gradient(const Vector& f, Vector& gradient) const {
  gradient = q_;
  kernels_->add_product(w_.data(), 3 * rows_, stride_, f.data(), gradient.data());
}

double DiscProgram::energy(const Vector& f, const Vector& gradient, const Vector& q) {
  double sum = 0.0;
  for (std::size_t i = 0; i < f.size(); ++i) sum += f[i] * (gradient[i] + q[i]);
  return 0.5 * sum;
}

void DiscProgram::push(std::size_t at, double change_n_s) {
  f_[at] += change_n_s;
  kernels_->add_columns(column(at), change_n_s, column(at), 0.0, stride_, gradient_.data());
}

double DiscProgram::stop(std::size_t at) {
  const double inverse_mass_1_kg = w(at, at);
  if (!(inverse_mass_1_kg > 0.0)) return 0.0;
  const double change_n_s = -gradient_[at] / inverse_mass_1_kg;
  push(at, change_n_s);
  return std::abs(change_n_s) * inverse_mass_1_kg;
}

double DiscProgram::sweep(Radii radii) {
  double largest_m_s = 0.0;
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::size_t n = 3 * row;
    if (const Kind kind = kinds_[row]; kind != Kind::contact) {
      if (kind == Kind::tie) largest_m_s = std::max(largest_m_s, stop(n));
      largest_m_s = std::max({largest_m_s, stop(n + 1), stop(n + 2)});
      continue;
    }
    if (const double inverse_mass_1_kg = w(n, n); inverse_mass_1_kg > 0.0) {
      const double change_n_s = std::max(0.0, f_[n] - gradient_[n] / inverse_mass_1_kg) - f_[n];
      if (change_n_s != 0.0) {
        push(n, change_n_s);
        largest_m_s = std::max(largest_m_s, std::abs(change_n_s) * inverse_mass_1_kg);
      }
    }
    if (radii == Radii::follow_normals) radii_n_s_[row] = friction_[row] * f_[n];
    const double radius = radii_n_s_[row];
    const double across = across_1_kg_[row];
    if (!(across > 0.0) || (radius <= 0.0 && f_[n + 1] == 0.0 && f_[n + 2] == 0.0)) continue;
    const Eigen::Vector2d before(f_[n + 1], f_[n + 2]);
    Eigen::Vector2d rubbed = before - Eigen::Vector2d(gradient_[n + 1], gradient_[n + 2]) / across;
    const double length = rubbed.norm();
    if (length > radius) rubbed *= radius / length;
    const Eigen::Vector2d change = rubbed - before;
    if (change.isZero(0.0)) continue;
    f_[n + 1] = rubbed[0];
    f_[n + 2] = rubbed[1];
    kernels_->add_columns(column(n + 1), change[0], column(n + 2), change[1], stride_, gradient_.data());
    largest_m_s = std::max(largest_m_s, change.norm() * across);
  }
  return largest_m_s;
}

void DiscProgram::find_directions() {
  directions_.clear();
  slides_.clear();
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::size_t n = 3 * row;
    if (const Kind kind = kinds_[row]; kind != Kind::contact) {
      if (kind == Kind::tie) directions_.push_back({.at = n});
      directions_.push_back({.at = n + 1});
      directions_.push_back({.at = n + 2});
      continue;
    }
    if (f_[n] > 0.0) directions_.push_back({.at = n});
    const double radius = radii_n_s_[row];
    if (!(radius > 0.0)) continue;
    const double length = std::sqrt(f_[n + 1] * f_[n + 1] + f_[n + 2] * f_[n + 2]);
    if (length < radius * (1.0 - edge_share)) {
      directions_.push_back({.at = n + 1});
      directions_.push_back({.at = n + 2});
    } else {
      const double inwards = -(gradient_[n + 1] * f_[n + 1] + gradient_[n + 2] * f_[n + 2]) / (length * length);
      if (f_[n] > 0.0) {
        const double share = friction_[row] / length;
        slides_.push_back({row, directions_.size() - 1, share * f_[n + 1], share * f_[n + 2]});
      }
      directions_.push_back({.at = n + 1,
                             .share = -f_[n + 2] / length,
                             .next_share = f_[n + 1] / length,
                             .bend_1_kg = std::max(0.0, inwards)});
    }
  }
}

// The share of the step at which the first normal impulse ends or the first disc's edge is reached.
double DiscProgram::longest_inside(const Vector& step) const {
  double longest = 1.0;
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::size_t n = 3 * row;
    if (kinds_[row] != Kind::contact) continue;
    if (step[n] < 0.0 && f_[n] > 0.0) longest = std::min(longest, -f_[n] / step[n]);
    const double radius = radii_n_s_[row];
    const double squared = step[n + 1] * step[n + 1] + step[n + 2] * step[n + 2];
    if (!(squared > 0.0) || !(radius > 0.0)) continue;
    const double along = f_[n + 1] * step[n + 1] + f_[n + 2] * step[n + 2];
    const double room = f_[n + 1] * f_[n + 1] + f_[n + 2] * f_[n + 2] - radius * radius;
    if (room < -1e-6 * radius * radius) {
      longest = std::min(longest, (-along + std::sqrt(along * along - squared * room)) / squared);
    }
  }
  return longest;
}

// The matrix of the free directions, its lower half, and what is to be solved for with it.
void DiscProgram::reduce() {
  const std::size_t count = directions_.size();
  const std::size_t stride = dense_stride(count);
  reduced_.assign(stride * stride, 0.0);
  found_.assign(stride, 0.0);
  for (std::size_t b = 0; b < count; ++b) {
    const Direction& by = directions_[b];
    const double* first = column(by.at);
    double* to = reduced_.data() + b * stride;
    if (by.next_share == 0.0) {
      for (std::size_t a = b; a < count; ++a) {
        const Direction& of = directions_[a];
        to[a] = by.share * of.share * first[of.at];
        if (of.next_share != 0.0) to[a] += by.share * of.next_share * first[of.at + 1];
      }
    } else {
      const double* second = column(by.at + 1);
      for (std::size_t a = b; a < count; ++a) {
        const Direction& of = directions_[a];
        to[a] = of.share * (by.share * first[of.at] + by.next_share * second[of.at]);
        if (of.next_share == 0.0) continue;
        to[a] += of.next_share * (by.share * first[of.at + 1] + by.next_share * second[of.at + 1]);
      }
    }
    to[b] = to[b] * (1.0 + regularisation) + by.bend_1_kg;
    found_[b] = -(gradient_[by.at] * by.share);
    if (by.next_share != 0.0) found_[b] -= gradient_[by.at + 1] * by.next_share;
  }
}

// A step that leaves the bounds comes back to them at few rows: theirs are the columns to add, not all of the product.
void DiscProgram::add_differences(const Vector& from, const Vector& to, Vector& gradient) const {
  std::size_t first = 0;
  bool has_first = false;
  for (std::size_t i = 0; i < 3 * rows_; ++i) {
    if (to[i] == from[i]) continue;
    if (!std::exchange(has_first, !has_first)) {
      first = i;
      continue;
    }
    kernels_->add_columns(column(first), to[first] - from[first], column(i), to[i] - from[i], stride_, gradient.data());
  }
  if (has_first) {
    kernels_->add_columns(column(first), to[first] - from[first], column(first), 0.0, stride_, gradient.data());
  }
}

// Of a step along the free directions: what is to be solved for, and the matrix's factor.
bool DiscProgram::solve_for_directions() {
  find_directions();
  const std::size_t count = directions_.size();
  if (count == 0) return false;
  reduce();
  return kernels_->factor(reduced_.data(), count, dense_stride(count));
}

// What was found along the free directions, as a step of all coordinates.
void DiscProgram::spread_found() {
  std::ranges::fill(step_, 0.0);
  for (std::size_t a = 0; a < directions_.size(); ++a) {
    const Direction& of = directions_[a];
    step_[of.at] += of.share * found_[a];
    if (of.next_share != 0.0) step_[of.at + 1] += of.next_share * found_[a];
  }
}

// What the rows that slide add to the free directions by a normal impulse of 1.
void DiscProgram::find_slide_columns() {
  const std::size_t count = directions_.size();
  const std::size_t stride = dense_stride(count);
  slide_columns_.assign(stride * slides_.size(), 0.0);
  for (std::size_t k = 0; k < slides_.size(); ++k) {
    const double* first = column(3 * slides_[k].row + 1);
    const double* second = column(3 * slides_[k].row + 2);
    double* to = slide_columns_.data() + k * stride;
    for (std::size_t a = 0; a < count; ++a) {
      const Direction& of = directions_[a];
      to[a] = of.share * (slides_[k].share * first[of.at] + slides_[k].next_share * second[of.at]);
      if (of.next_share == 0.0) continue;
      to[a] += of.next_share * (slides_[k].share * first[of.at + 1] + slides_[k].next_share * second[of.at + 1]);
    }
  }
}

// The friction of a row that slides goes with its normal impulse, which makes the matrix unsymmetric. What that adds is
// put on the other side in rounds, which need the one factor. Where they lead away, friction stays as it is.
bool DiscProgram::aim_with_friction() {
  if (!solve_for_directions()) return false;
  find_slide_columns();
  const std::size_t count = directions_.size();
  const std::size_t stride = dense_stride(count);
  wanted_ = found_;
  kernels_->solve(reduced_.data(), count, stride, found_.data());
  without_ = found_;
  normals_n_s_.assign(slides_.size(), 0.0);
  double last_change = std::numeric_limits<double>::infinity();
  for (int round = 0; round < slide_rounds_max; ++round) {
    double change = 0.0;
    double largest = 0.0;
    for (std::size_t k = 0; k < slides_.size(); ++k) {
      const double normal_n_s = found_[slides_[k].normal];
      change = std::max(change, std::abs(normal_n_s - normals_n_s_[k]));
      largest = std::max(largest, std::abs(normal_n_s));
      normals_n_s_[k] = normal_n_s;
    }
    if (change <= slide_rounds_share * largest) break;
    if (change > last_change) {
      found_ = without_;
      normals_n_s_.assign(slides_.size(), 0.0);
      break;
    }
    last_change = change;
    found_ = wanted_;
    for (std::size_t k = 0; k < slides_.size(); ++k) {
      const double* from = slide_columns_.data() + k * stride;
      kernels_->add_columns(from, -normals_n_s_[k], from, 0.0, stride, found_.data());
    }
    kernels_->solve(reduced_.data(), count, stride, found_.data());
  }
  spread_found();
  for (std::size_t k = 0; k < slides_.size(); ++k) {
    const std::size_t n = 3 * slides_[k].row;
    step_[n + 1] += slides_[k].share * normals_n_s_[k];
    step_[n + 2] += slides_[k].next_share * normals_n_s_[k];
  }
  return true;
}

// Goes along the step; rows that slide go on sliding.
void DiscProgram::go(double length) {
  for (std::size_t i = 0; i < f_.size(); ++i) f_[i] += length * step_[i];
  follow_normals();
  for (const Slide& slide : slides_) {
    const std::size_t n = 3 * slide.row;
    const double rubbed_n_s = std::sqrt(f_[n + 1] * f_[n + 1] + f_[n + 2] * f_[n + 2]);
    if (!(rubbed_n_s > 0.0)) continue;
    f_[n + 1] *= radii_n_s_[slide.row] / rubbed_n_s;
    f_[n + 2] *= radii_n_s_[slide.row] / rubbed_n_s;
  }
  find_gradient(f_, gradient_);
}

void DiscProgram::follow_normals() {
  for (std::size_t row = 0; row < rows_; ++row) {
    if (kinds_[row] == Kind::contact) radii_n_s_[row] = friction_[row] * std::max(0.0, f_[3 * row]);
  }
  project(f_);
}

bool DiscProgram::step_with_friction() {
  if (!aim_with_friction()) return false;
  start_f_ = f_;
  start_gradient_ = gradient_;
  double length = 1.0;
  for (int shortening = 0; shortening < friction_shortenings_max; ++shortening) {
    go(length);
    double left_m_s = 0.0;
    for (int i = 0; i < sweeps_a_step; ++i) left_m_s = sweep(Radii::follow_normals);
    if (left_m_s < friction_gain * off_m_s_) {
      off_m_s_ = left_m_s;
      return true;
    }
    f_ = start_f_;
    gradient_ = start_gradient_;
    length *= friction_shortening;
  }
  return false;
}

bool DiscProgram::solve_with_friction(double enough_m_s, std::uint32_t& factorisations) {
  follow_normals();
  find_gradient(f_, gradient_);
  off_m_s_ = sweep(Radii::follow_normals);
  best_f_ = f_;
  double best_m_s = off_m_s_;
  int stalls = 0;
  for (int step = 0; step < friction_steps_max && off_m_s_ > enough_m_s && stalls < friction_stalls_max; ++step) {
    ++factorisations;
    if (!step_with_friction()) {
      ++stalls;
      for (int i = 0; i < 2 * sweeps_a_step; ++i) off_m_s_ = sweep(Radii::follow_normals);
    }
    if (off_m_s_ >= best_m_s) continue;
    best_m_s = off_m_s_;
    best_f_ = f_;
  }
  if (off_m_s_ <= enough_m_s) return true;
  f_ = best_f_;
  off_m_s_ = best_m_s;
  return false;
}

bool DiscProgram::step_together() {
  if (!solve_for_directions()) return false;
  kernels_->solve(reduced_.data(), directions_.size(), dense_stride(directions_.size()), found_.data());
  spread_found();
  std::ranges::fill(by_step_, 0.0);
  kernels_->add_product(w_.data(), 3 * rows_, stride_, step_.data(), by_step_.data());
  const double before = energy(f_, gradient_, q_);
  double length = 1.0;
  for (int shortening = 0; shortening < line_searches_max; ++shortening) {
    for (std::size_t i = 0; i < f_.size(); ++i) {
      straight_f_[i] = f_[i] + length * step_[i];
      next_gradient_[i] = gradient_[i] + length * by_step_[i];
    }
    next_f_ = straight_f_;
    project(next_f_);
    add_differences(straight_f_, next_f_, next_gradient_);
    if (energy(next_f_, next_gradient_, q_) < before) {
      f_.swap(next_f_);
      find_gradient(f_, gradient_);  // anew: a long step that was projected away would leave its rounding
      return true;
    }
    length = shortening + 2 == line_searches_max ? longest_inside(step_) : 0.5 * length;
  }
  return false;
}

bool DiscProgram::sweep_until(double enough_m_s, int sweeps) {
  for (int i = 0; i < sweeps; ++i) {
    off_m_s_ = sweep();
    if (off_m_s_ <= enough_m_s) return true;
  }
  return false;
}

bool DiscProgram::solve(double enough_m_s, std::uint32_t& factorisations) {
  project(f_);
  find_gradient(f_, gradient_);
  for (int step = 0; step < steps_max; ++step) {
    if (sweep_until(enough_m_s, sweeps_a_step)) return true;
    ++factorisations;
    if (!step_together() && sweep_until(enough_m_s, 2 * sweeps_a_step)) return true;
  }
  return false;
}

}  // namespace pneuma::physics
