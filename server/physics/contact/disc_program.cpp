#include "physics/contact/disc_program.h"

#include <algorithm>
#include <cmath>
#include <limits>

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
// Of a disc's radius: what is nearer to its edge slides.
constexpr double edge_share = 1e-9;

}  // namespace

template <class Rows>
DiscProgram<Rows>::DiscProgram(Rows& rows) : w_(rows), rows_(rows.count()) {
  const std::size_t padded = dense_stride(3 * rows_);
  for (Vector* vector : {&q_, &f_, &step_, &straight_f_, &next_f_}) vector->assign(padded, 0.0);
  radii_n_s_.assign(rows_, 0.0);
  across_1_kg_.assign(rows_, 0.0);
  friction_.assign(rows_, 0.0);
  kinds_.assign(rows_, Kind::contact);
}

template <class Rows>
void DiscProgram<Rows>::set_row(std::size_t row, const Vec3d& wanted_m_s, const Vec3d& start_n_s, double across_1_kg) {
  Vec3d::Map(q_.data() + 3 * row) = wanted_m_s;
  Vec3d::Map(f_.data() + 3 * row) = start_n_s;
  across_1_kg_[row] = across_1_kg;
}

template <class Rows>
void DiscProgram<Rows>::set_free(std::size_t row, bool also_along) {
  kinds_[row] = also_along ? Kind::tie : Kind::guide;
}

template <class Rows>
double DiscProgram<Rows>::set_disc(std::size_t row, double radius_n_s) {
  const double change_n_s = std::abs(radius_n_s - radii_n_s_[row]);
  radii_n_s_[row] = radius_n_s;
  return change_n_s * across_1_kg_[row];
}

template <class Rows>
void DiscProgram<Rows>::project(Vector& f) const {
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

template <class Rows>
void DiscProgram<Rows>::find_velocities() {
  velocities_ = w_.at_rest();
  w_.push_all(f_, velocities_);
  if (!diagonal_1_kg_.empty()) return;
  for (std::size_t at = 0; at < 3 * rows_; at += 3) {
    diagonal_1_kg_.emplace_back(w_.diagonal_1_kg(at), w_.diagonal_1_kg(at + 1), w_.diagonal_1_kg(at + 2));
  }
}

template <class Rows>
double DiscProgram<Rows>::energy(const Vector& f, const Velocities& velocities) const {
  double sum = 0.0;
  for (std::size_t row = 0; row < rows_; ++row) {
    sum += Vec3d::Map(f.data() + 3 * row).dot(gradient(row, velocities) + Vec3d::Map(q_.data() + 3 * row));
  }
  return 0.5 * sum;
}

template <class Rows>
void DiscProgram<Rows>::push(std::size_t row, const Vec3d& change_n_s) {
  Vec3d::Map(f_.data() + 3 * row) += change_n_s;
  w_.push(row, change_n_s, velocities_);
}

template <class Rows>
double DiscProgram<Rows>::stop(std::size_t row, Eigen::Index axis) {
  const double inverse_mass_1_kg = diagonal_1_kg_[row][axis];
  if (!(inverse_mass_1_kg > 0.0)) return 0.0;
  const double change_n_s = -gradient(row, velocities_)[axis] / inverse_mass_1_kg;
  push(row, change_n_s * Vec3d::Unit(axis));
  return std::abs(change_n_s) * inverse_mass_1_kg;
}

template <class Rows>
double DiscProgram<Rows>::sweep(Radii radii) {
  double largest_m_s = 0.0;
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::size_t n = 3 * row;
    if (const Kind kind = kinds_[row]; kind != Kind::contact) {
      for (Eigen::Index axis = kind == Kind::tie ? 0 : 1; axis < 3; ++axis) {
        largest_m_s = std::max(largest_m_s, stop(row, axis));
      }
      continue;
    }
    Vec3d gradient_m_s = gradient(row, velocities_);
    if (const double inverse_mass_1_kg = diagonal_1_kg_[row][0]; inverse_mass_1_kg > 0.0) {
      const double change_n_s = std::max(0.0, f_[n] - gradient_m_s[0] / inverse_mass_1_kg) - f_[n];
      if (change_n_s != 0.0) {
        push(row, change_n_s * Vec3d::UnitX());
        largest_m_s = std::max(largest_m_s, std::abs(change_n_s) * inverse_mass_1_kg);
        gradient_m_s = gradient(row, velocities_);
      }
    }
    if (radii == Radii::follow_normals) radii_n_s_[row] = friction_[row] * f_[n];
    const double radius = radii_n_s_[row];
    const double across = across_1_kg_[row];
    if (!(across > 0.0) || (radius <= 0.0 && f_[n + 1] == 0.0 && f_[n + 2] == 0.0)) continue;
    const Eigen::Vector2d before(f_[n + 1], f_[n + 2]);
    Eigen::Vector2d rubbed = before - gradient_m_s.tail<2>() / across;
    const double length = rubbed.norm();
    if (length > radius) rubbed *= radius / length;
    const Eigen::Vector2d change = rubbed - before;
    if (change.isZero(0.0)) continue;
    w_.push(row, {0.0, change[0], change[1]}, velocities_);
    f_[n + 1] = rubbed[0];
    f_[n + 2] = rubbed[1];
    largest_m_s = std::max(largest_m_s, change.norm() * across);
  }
  return largest_m_s;
}

template <class Rows>
void DiscProgram<Rows>::find_directions() {
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
      const Vec3d gradient_m_s = gradient(row, velocities_);
      const double inwards = -(gradient_m_s[1] * f_[n + 1] + gradient_m_s[2] * f_[n + 2]) / (length * length);
      if (f_[n] > 0.0) {
        const double share = friction_[row] / length;
        slides_.push_back({row, directions_.size() - 1, {0.0, share * f_[n + 1], share * f_[n + 2]}});
      }
      directions_.push_back({.at = n + 1,
                             .share = -f_[n + 2] / length,
                             .next_share = f_[n + 1] / length,
                             .bend_1_kg = std::max(0.0, inwards)});
    }
  }
}

// The share of the step at which the first normal impulse ends or the first disc's edge is reached.
template <class Rows>
double DiscProgram<Rows>::longest_inside(const Vector& step) const {
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

// A step that leaves the bounds comes back to them at few rows: theirs are the columns to add, not all of the product.
template <class Rows>
void DiscProgram<Rows>::add_differences(const Vector& from, const Vector& to, Velocities& velocities) const {
  for (std::size_t row = 0; row < rows_; ++row) {
    const Vec3d change_n_s = Vec3d::Map(to.data() + 3 * row) - Vec3d::Map(from.data() + 3 * row);
    if (!change_n_s.isZero(0.0)) w_.push(row, change_n_s, velocities);
  }
}

// Of a step along the free directions: what is to be solved for, and the matrix's factor.
template <class Rows>
bool DiscProgram<Rows>::factor_directions() {
  find_directions();
  if (directions_.empty()) return false;
  found_.clear();
  for (const RowDirection& by : directions_) {
    const Vec3d gradient_m_s = gradient(by.row(), velocities_);
    const auto axis = static_cast<Eigen::Index>(by.axis());
    double along_m_s = by.share * gradient_m_s[axis];
    if (by.next_share != 0.0) along_m_s += by.next_share * gradient_m_s[axis + 1];
    found_.push_back(-along_m_s);
  }
  return w_.factor(directions_);
}

// What was found along the free directions, as a step of all coordinates. False where it is not finite.
template <class Rows>
bool DiscProgram<Rows>::spread_found() {
  if (!std::ranges::all_of(found_, [](double value) { return std::isfinite(value); })) return false;
  std::ranges::fill(step_, 0.0);
  for (std::size_t a = 0; a < directions_.size(); ++a) {
    const RowDirection& of = directions_[a];
    step_[of.at] += of.share * found_[a];
    if (of.next_share != 0.0) step_[of.at + 1] += of.next_share * found_[a];
  }
  return true;
}

// The friction of a row that slides goes with its normal impulse, which makes the matrix unsymmetric. What that adds is
// put on the other side in rounds, which need the one factor. Where they lead away, friction stays as it is.
template <class Rows>
bool DiscProgram<Rows>::aim_with_friction() {
  if (!factor_directions()) return false;
  wanted_ = found_;
  w_.solve(found_);
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
    rubbed_ = w_.at_rest();
    for (std::size_t k = 0; k < slides_.size(); ++k) {
      w_.push(slides_[k].row, normals_n_s_[k] * slides_[k].share, rubbed_);
    }
    for (std::size_t a = 0; a < directions_.size(); ++a) {
      const RowDirection& of = directions_[a];
      const Vec3d rubbed_m_s = w_.velocity_m_s(of.row(), rubbed_);
      const auto axis = static_cast<Eigen::Index>(of.axis());
      found_[a] = wanted_[a] - of.share * rubbed_m_s[axis];
      if (of.next_share != 0.0) found_[a] -= of.next_share * rubbed_m_s[axis + 1];
    }
    w_.solve(found_);
  }
  if (!spread_found()) return false;
  for (std::size_t k = 0; k < slides_.size(); ++k) {
    Vec3d::Map(step_.data() + 3 * slides_[k].row) += normals_n_s_[k] * slides_[k].share;
  }
  return true;
}

// Goes along the step; rows that slide go on sliding.
template <class Rows>
void DiscProgram<Rows>::go(double length) {
  for (std::size_t i = 0; i < f_.size(); ++i) f_[i] += length * step_[i];
  follow_normals();
  for (const Slide& slide : slides_) {
    const std::size_t n = 3 * slide.row;
    const double rubbed_n_s = std::sqrt(f_[n + 1] * f_[n + 1] + f_[n + 2] * f_[n + 2]);
    if (!(rubbed_n_s > 0.0)) continue;
    f_[n + 1] *= radii_n_s_[slide.row] / rubbed_n_s;
    f_[n + 2] *= radii_n_s_[slide.row] / rubbed_n_s;
  }
  find_velocities();
}

template <class Rows>
void DiscProgram<Rows>::follow_normals() {
  for (std::size_t row = 0; row < rows_; ++row) {
    if (kinds_[row] == Kind::contact) radii_n_s_[row] = friction_[row] * std::max(0.0, f_[3 * row]);
  }
  project(f_);
}

template <class Rows>
bool DiscProgram<Rows>::step_with_friction() {
  if (!aim_with_friction()) return false;
  start_f_ = f_;
  start_velocities_ = velocities_;
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
    velocities_ = start_velocities_;
    length *= friction_shortening;
  }
  return false;
}

template <class Rows>
bool DiscProgram<Rows>::solve_with_friction(double enough_m_s, std::uint32_t& factorisations) {
  follow_normals();
  find_velocities();
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

template <class Rows>
bool DiscProgram<Rows>::step_together() {
  if (!factor_directions()) return false;
  w_.solve(found_);
  if (!spread_found()) return false;
  by_step_ = w_.at_rest();
  w_.push_all(step_, by_step_);
  next_velocities_.resize(by_step_.size());
  const double before = energy(f_, velocities_);
  double length = 1.0;
  for (int shortening = 0; shortening < line_searches_max; ++shortening) {
    for (std::size_t i = 0; i < f_.size(); ++i) straight_f_[i] = f_[i] + length * step_[i];
    for (std::size_t i = 0; i < by_step_.size(); ++i) next_velocities_[i] = velocities_[i] + length * by_step_[i];
    next_f_ = straight_f_;
    project(next_f_);
    add_differences(straight_f_, next_f_, next_velocities_);
    if (energy(next_f_, next_velocities_) < before) {
      f_.swap(next_f_);
      find_velocities();  // anew: a long step that was projected away would leave its rounding
      return true;
    }
    length = shortening + 2 == line_searches_max ? longest_inside(step_) : 0.5 * length;
  }
  return false;
}

template <class Rows>
bool DiscProgram<Rows>::sweep_until(double enough_m_s, int sweeps) {
  for (int i = 0; i < sweeps; ++i) {
    off_m_s_ = sweep();
    if (off_m_s_ <= enough_m_s) return true;
  }
  return false;
}

template <class Rows>
bool DiscProgram<Rows>::solve(double enough_m_s, std::uint32_t& factorisations) {
  project(f_);
  find_velocities();
  for (int step = 0; step < steps_max; ++step) {
    if (sweep_until(enough_m_s, sweeps_a_step)) return true;
    ++factorisations;
    if (!step_together() && sweep_until(enough_m_s, 2 * sweeps_a_step)) return true;
  }
  return false;
}

template class DiscProgram<DenseRows>;
template class DiscProgram<BodyRows>;

}  // namespace pneuma::physics
