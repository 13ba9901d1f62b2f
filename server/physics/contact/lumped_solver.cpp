#include "physics/contact/lumped_solver.h"

#include <algorithm>
#include <cmath>

namespace pneuma::physics {

void LumpedSolver::load(std::span<const ContactRow> rows, std::span<const SurfaceBody> bodies) {
  for (const Slot& slot : slots_) slot_of_[first_of_[slot.body] + slot.vertex] = 0;
  slots_.clear();
  first_of_.resize(bodies.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    first_of_[i] = count;
    count += bodies[i].inverse_masses_1_kg.size();
  }
  slot_of_.resize(count);

  rows_.clear();
  for (const ContactRow& from : rows) {
    Row& row = rows_.emplace_back();
    row.normal.head<3>() = from.normal;
    row.friction = from.friction;
    std::size_t corner = 0;
    const auto take = [&](const Support& support, double sign) {
      for (std::uint32_t i = 0; i < support.count; ++i, ++corner) {
        const double weight = sign * support.weights[i];
        const double inverse_mass_1_kg = bodies[support.body].inverse_masses_1_kg[support.vertices[i]];
        row.slots[corner] = slot_of(support.body, support.vertices[i]);
        row.weights[corner] = weight;
        row.pushes_1_kg[corner] = weight * inverse_mass_1_kg;
        row.inverse_mass_1_kg += weight * weight * inverse_mass_1_kg;
      }
    };
    take(from.first, 1.0);
    take(from.second, -1.0);
    for (; corner < 4; ++corner) row.slots[corner] = row.slots[0];
  }
}

std::uint32_t LumpedSolver::slot_of(std::uint32_t body, std::uint32_t vertex) {
  std::uint32_t& known = slot_of_[first_of_[body] + vertex];
  if (known == 0) {
    Slot& slot = slots_.emplace_back();
    slot.body = body;
    slot.vertex = vertex;
    known = static_cast<std::uint32_t>(slots_.size());
  }
  return known - 1;
}

void LumpedSolver::push(const Row& row, const Eigen::Vector4d& impulse_n_s) {
  for (std::size_t i = 0; i < 4; ++i) slots_[row.slots[i]].change_m_s += row.pushes_1_kg[i] * impulse_n_s;
}

// The same answer as in solver.cpp, where the inverse mass is one number.
double LumpedSolver::answer(Row& row, bool with_friction) {
  if (!(row.inverse_mass_1_kg > 0.0)) return 0.0;
  Eigen::Vector4d velocity = row.free_m_s;
  for (std::size_t i = 0; i < 4; ++i) velocity += row.weights[i] * slots_[row.slots[i]].change_m_s;
  const double approach_m_s = velocity.dot(row.normal);
  const double pressed_n_s = row.impulse_n_s.dot(row.normal);
  const double normal_n_s = std::max(0.0, pressed_n_s + (row.least_m_s - approach_m_s) / row.inverse_mass_1_kg);
  if (normal_n_s == 0.0 && pressed_n_s == 0.0) return 0.0;
  Eigen::Vector4d impulse_n_s = normal_n_s * row.normal;
  if (with_friction && row.friction > 0.0) {
    Eigen::Vector4d rubbed_n_s =
        row.impulse_n_s - pressed_n_s * row.normal - (velocity - approach_m_s * row.normal) / row.inverse_mass_1_kg;
    const double most_n_s = row.friction * normal_n_s;
    const double rubbed_n2_s2 = rubbed_n_s.squaredNorm();
    if (rubbed_n2_s2 > most_n_s * most_n_s) rubbed_n_s *= most_n_s / std::sqrt(rubbed_n2_s2);
    impulse_n_s += rubbed_n_s;
  }
  const Eigen::Vector4d change_n_s = impulse_n_s - row.impulse_n_s;
  row.impulse_n_s = impulse_n_s;
  push(row, change_n_s);
  return change_n_s.squaredNorm() * row.inverse_mass_1_kg * row.inverse_mass_1_kg;
}

SolveOutcome LumpedSolver::solve(std::span<ContactRow> rows, const SolveLimits& limits, bool with_friction) {
  for (Slot& slot : slots_) slot.change_m_s.setZero();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Row& row = rows_[i];
    row.free_m_s.head<3>() = rows[i].free_m_s;
    row.least_m_s = rows[i].least_m_s;
    row.impulse_n_s.head<3>() = rows[i].impulse_n_s;
    if (!rows[i].impulse_n_s.isZero(0.0)) push(row, row.impulse_n_s);
  }
  SolveOutcome outcome;
  outcome.converged = false;
  while (!outcome.converged && outcome.sweeps < limits.sweeps_max) {
    ++outcome.sweeps;
    double largest_m2_s2 = 0.0;
    for (Row& row : rows_) largest_m2_s2 = std::max(largest_m2_s2, answer(row, with_friction));
    outcome.converged = largest_m2_s2 <= limits.enough_m_s * limits.enough_m_s;
  }
  for (std::size_t i = 0; i < rows_.size(); ++i) rows[i].impulse_n_s = rows_[i].impulse_n_s.head<3>();
  return outcome;
}

}  // namespace pneuma::physics
