#include "physics/contact/friction_program.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace pneuma::physics {
namespace {

// Penalties as shares of a row's own inverse mass: of rows that hold, that slip, and that are open. A row that holds
// ends the sooner for a small one, one that is open for a large one. Of loads, nearly all rows hold. Where that does
// not end, shares follow what the rows do. Small ones for all are for masses that differ a thousandfold, and for rows
// that all pull at nearly one number.
struct Phase {
  int first_step = 0;
  double holds = 0.0, slips = 0.0, opens = 0.0;
};
constexpr Phase phases[] = {
    {0, 0.03, 0.03, 0.03},   {40, 0.03, 0.2, 1.0},  {80, 0.001, 0.001, 0.001}, {120, 1e-4, 1e-4, 1e-4},
    {160, 0.01, 0.01, 0.01}, {400, 0.03, 0.2, 1.0}, {600, 0.03, 0.2, 1.0},
};
// Most problems take 5 to 60 steps.
constexpr int steps_max = 800;
// Of what a row may be off by: what is aimed at, for at most so many more steps.
constexpr double aim_share = 1e-4;
constexpr int steps_past_enough = 60;
// Of friction: what is nearer to its bound slips.
constexpr double slips_share = 1.0 - 1e-9;
// Steps go past where they would end by this much: the usual choice.
constexpr double relaxation = 1.6;
// Of a row's own inverse mass: what it has in one direction at least, for a look.
constexpr double least_share = 1e-6;
// A look costs as much as a step.
constexpr int steps_a_look = 5;

}  // namespace

template <class Rows>
FrictionProgram<Rows>::FrictionProgram(Rows& rows) : w_(rows), rows_(rows.count()) {
  for (Vector* vector : {&free_m_s_, &sums_n_s_, &impulses_n_s_, &multipliers_m_s_, &roots_, &change_, &next_, &moved_,
                         &velocities_m_s_}) {
    vector->assign(3 * w_.stride(), 0.0);
  }
}

template <class Rows>
void FrictionProgram<Rows>::set_contact(std::size_t row, const Vec3d& normal, double friction, const Own& own,
                                        const Vec3d& free_m_s, const Vec3d& start_n_s) {
  set(row, {Kind::contact, normal, friction, own}, free_m_s, start_n_s);
}

template <class Rows>
void FrictionProgram<Rows>::set_tie(std::size_t row, const Own& own, const Vec3d& free_m_s, const Vec3d& start_n_s) {
  set(row, {Kind::tie, Vec3d::Zero(), 0.0, own}, free_m_s, start_n_s);
}

template <class Rows>
void FrictionProgram<Rows>::set_guide(std::size_t row, const Vec3d& guide, const Own& own, const Vec3d& free_m_s,
                                      const Vec3d& start_n_s) {
  set(row, {Kind::guide, guide, 0.0, own}, free_m_s, start_n_s);
}

template <class Rows>
void FrictionProgram<Rows>::set(std::size_t row, const Row& as, const Vec3d& free_m_s, const Vec3d& start_n_s) {
  rows_[row] = as;
  if (!(as.own.mean_1_kg > 0.0)) rows_[row].kind = Kind::still;
  set_row(free_m_s_, row, free_m_s);
  set_row(impulses_n_s_, row, within(rows_[row], start_n_s));
}

// The nearest that the row may have.
template <class Rows>
Vec3d FrictionProgram<Rows>::within(const Row& row, const Vec3d& impulse_n_s) {
  if (row.kind == Kind::still) return Vec3d::Zero();
  if (row.kind == Kind::tie) return impulse_n_s;
  const double along_n_s = impulse_n_s.dot(row.normal);
  const Vec3d across_n_s = impulse_n_s - along_n_s * row.normal;
  if (row.kind == Kind::guide) return across_n_s;
  const double rubbed_n_s = across_n_s.norm();
  if (rubbed_n_s <= row.friction * along_n_s) return impulse_n_s;
  if (row.friction * rubbed_n_s <= -along_n_s) return Vec3d::Zero();
  const double pressed_n_s = (along_n_s + row.friction * rubbed_n_s) / (1.0 + row.friction * row.friction);
  return pressed_n_s * row.normal + pressed_n_s * row.friction / rubbed_n_s * across_n_s;
}

// What an answer to the row alone would change, as a sweep has it (solver.h).
template <class Rows>
double FrictionProgram<Rows>::off_m_s(const Row& row, const Vec3d& impulse_n_s, const Vec3d& velocity_m_s) {
  if (row.kind == Kind::still) return 0.0;
  if (row.kind == Kind::tie) return velocity_m_s.norm();
  const double opens_m_s = velocity_m_s.dot(row.normal);
  const Vec3d slip_m_s = velocity_m_s - opens_m_s * row.normal;
  if (row.kind == Kind::guide) return slip_m_s.norm();
  const double along_1_kg = std::max(row.own.along_1_kg, least_share * row.own.mean_1_kg);
  const double across_1_kg = std::max(row.own.across_1_kg, least_share * row.own.mean_1_kg);
  const double pressed_n_s = impulse_n_s.dot(row.normal);
  const double wanted_n_s = std::max(0.0, pressed_n_s - opens_m_s / along_1_kg);
  const double normal_off_m_s = std::abs(wanted_n_s - pressed_n_s) * along_1_kg;
  const Vec3d rubbed_n_s = impulse_n_s - pressed_n_s * row.normal;
  Vec3d rubs_n_s = rubbed_n_s - slip_m_s / across_1_kg;
  const double length_n_s = rubs_n_s.norm();
  const double most_n_s = row.friction * pressed_n_s;
  if (length_n_s > most_n_s) rubs_n_s *= most_n_s / length_n_s;
  return std::max(normal_off_m_s, (rubs_n_s - rubbed_n_s).norm() * across_1_kg);
}

// Asked of a contact, by the slip that the multiplier stands for.
template <class Rows>
Vec3d FrictionProgram<Rows>::opening_m_s(const Row& row, const Vec3d& multiplier_m_s) {
  if (row.kind != Kind::contact || row.friction == 0.0) return Vec3d::Zero();
  const double slips_m_s = (multiplier_m_s - multiplier_m_s.dot(row.normal) * row.normal).norm();
  return row.friction * slips_m_s * row.normal;
}

template <class Rows>
void FrictionProgram<Rows>::begin() {
  look();
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    const Vec3d against_m_s = -at_row(velocities_m_s_, row);
    set_row(multipliers_m_s_, row, against_m_s - opening_m_s(rows_[row], against_m_s));
  }
}

// Each row's impulse within its cone, and its multiplier.
template <class Rows>
void FrictionProgram<Rows>::split() {
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    const Vec3d sum_n_s = at_row(sums_n_s_, row);
    const Vec3d impulse_n_s = within(rows_[row], sum_n_s);
    set_row(impulses_n_s_, row, impulse_n_s);
    set_row(multipliers_m_s_, row, penalties_1_kg_[row] * (sum_n_s - impulse_n_s));
  }
}

// Impulses with the least energy for all rows at once, near where each row has its own; the sums take over what the two
// differ by.
template <class Rows>
void FrictionProgram<Rows>::step() {
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    const Vec3d multiplier_m_s = at_row(multipliers_m_s_, row);
    const Vec3d right = penalties_1_kg_[row] * at_row(impulses_n_s_, row) - at_row(free_m_s_, row) -
                        opening_m_s(rows_[row], multiplier_m_s) - multiplier_m_s;
    set_row(moved_, row, right);
  }
  w_.solve(moved_);
  for (std::size_t i = 0; i < moved_.size(); ++i) {
    const double change_n_s = relaxation * (moved_[i] - impulses_n_s_[i]);
    change_[i] = roots_[i] * change_n_s;
    next_[i] = sums_n_s_[i] + change_n_s;
  }
  mix_.go_on(change_, next_);
  sums_n_s_.swap(next_);
  split();
}

// Keeps the impulses where they are the nearest so far.
template <class Rows>
void FrictionProgram<Rows>::look() {
  w_.multiply(impulses_n_s_, velocities_m_s_);
  double most_m_s = 0.0;
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    const Vec3d velocity_m_s = at_row(velocities_m_s_, row) + at_row(free_m_s_, row);
    set_row(velocities_m_s_, row, velocity_m_s);
    const double off = off_m_s(rows_[row], at_row(impulses_n_s_, row), velocity_m_s);
    most_m_s = std::isfinite(off) ? std::max(most_m_s, off) : std::numeric_limits<double>::infinity();
  }
  if (!best_n_s_.empty() && !(most_m_s < off_m_s_)) return;
  off_m_s_ = most_m_s;
  best_n_s_ = impulses_n_s_;
}

// False where the matrix with them has no factor.
template <class Rows>
bool FrictionProgram<Rows>::set_penalties(double holds, double slips, double opens) {
  bool any_new = false;
  penalties_1_kg_.resize(rows_.size(), 0.0);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    double share = holds;
    if (row.kind == Kind::contact) {
      const Vec3d impulse_n_s = at_row(impulses_n_s_, i);
      const double pressed_n_s = impulse_n_s.dot(row.normal);
      const double rubbed_n_s = (impulse_n_s - pressed_n_s * row.normal).norm();
      share = pressed_n_s <= 0.0 ? opens : rubbed_n_s >= slips_share * row.friction * pressed_n_s ? slips : holds;
    }
    const double penalty_1_kg = row.kind == Kind::still ? 1.0 : share * row.own.mean_1_kg;
    any_new = any_new || penalty_1_kg != penalties_1_kg_[i];
    penalties_1_kg_[i] = penalty_1_kg;
  }
  if (!any_new) return true;
  mix_.forget();
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    set_row(sums_n_s_, row, at_row(impulses_n_s_, row) + at_row(multipliers_m_s_, row) / penalties_1_kg_[row]);
    set_row(roots_, row, Vec3d::Constant(std::sqrt(penalties_1_kg_[row])));
  }
  ++factorisations_;
  return w_.factor(penalties_1_kg_);
}

// Steps past what is enough cost little, and each step of a body adds what this one leaves.
template <class Rows>
bool FrictionProgram<Rows>::solve(double enough_m_s) {
  begin();
  const Phase* next = std::begin(phases);
  int last = steps_max;
  for (int taken = 0; off_m_s_ > aim_share * enough_m_s && taken < last;) {
    if (next != std::end(phases) && taken == next->first_step) {
      if (!set_penalties(next->holds, next->slips, next->opens)) break;
      ++next;
    }
    step();
    if (++taken % steps_a_look != 0) continue;
    look();
    if (off_m_s_ <= enough_m_s) last = std::min(last, taken + steps_past_enough);
  }
  return off_m_s_ <= enough_m_s;
}

template class FrictionProgram<DenseRows>;
template class FrictionProgram<BodyRows>;

}  // namespace pneuma::physics
