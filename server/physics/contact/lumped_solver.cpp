#include "physics/contact/lumped_solver.h"

#include <algorithm>
#include <cmath>

namespace pneuma::physics {
namespace {

// How the relative velocity at the end of an arm answers to an impulse there, along a direction.
double inverse_mass_along_1_kg(const LumpedRigid& rigid, const Vec3d& arm, const Vec3d& direction) {
  const Vec3d turning = arm.cross(direction);
  return rigid.inverse_masses_1_kg.dot(direction.cwiseAbs2()) + turning.dot(rigid.inverse_inertia_1_kg_m2 * turning);
}

}  // namespace

void SlotTable::begin(std::span<const SurfaceBody> bodies) {
  first_of.resize(bodies.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    first_of[i] = count;
    count += bodies[i].inverse_masses_1_kg.size();
  }
  slot_of.resize(count);
}

void LumpedSolver::load(std::span<ContactRow* const> rows, std::span<const SurfaceBody> bodies, const Solids& solids,
                        SlotTable& table) {
  slots_.clear();
  rigid_.assign(solids.rigid.size(), {});
  rows_.clear();
  sides_.clear();
  impulses_.clear();
  first_solid_row_ = rows.size();
  for (const ContactRow* each : rows) {
    const ContactRow& from = *each;
    LumpedRow& row = rows_.emplace_back();
    Vec3d::Map(row.normal) = from.normal;
    row.friction = from.friction;
    double inverse_mass_1_kg = 0.0;
    std::uint32_t corners = 0;
    const auto take = [&](const Support& support, double sign) {
      for (std::uint32_t i = 0; i < support.count; ++i, ++corners) {
        const double weight = sign * support.weights[i];
        const double of_corner_1_kg = bodies[support.body].inverse_masses_1_kg[support.vertices[i]];
        row.corners[corners] = slot_of(support.body, support.vertices[i], table);
        row.weights[corners] = weight;
        row.pushes_1_kg[corners] = weight * of_corner_1_kg;
        inverse_mass_1_kg += weight * weight * of_corner_1_kg;
      }
    };
    take(from.first, 1.0);
    const std::size_t solid = from.second.body - std::min<std::size_t>(from.second.body, bodies.size());
    const bool is_of_solid = from.second.body >= bodies.size();
    if (!is_of_solid) take(from.second, -1.0);
    row.pushed_count = corners;
    if (is_of_solid) {
      if (sides_.empty()) first_solid_row_ = rows_.size() - 1;
      SolidSide& side = sides_.emplace_back();
      side.skin_inverse_mass_1_kg = inverse_mass_1_kg;
      for (std::uint32_t i = 0; i < from.first.count; ++i) {
        side.corner_inverse_masses_1_kg[i] = bodies[from.first.body].inverse_masses_1_kg[from.first.vertices[i]];
      }
      if (solid < solids.rigid_count) {
        const auto found = std::ranges::lower_bound(solids.rigid, solid);
        side.rigid = static_cast<std::uint32_t>(found - solids.rigid.begin());
      } else if (solids.is_still[solid - solids.rigid_count] == 0) {
        side.slot = static_cast<std::uint32_t>(slots_.size());
        slots_.push_back({from.second.body, 0});
        row.corners[corners] = side.slot;
        row.weights[corners++] = -1.0;
      }
    }
    row.corner_count = corners <= 2 ? 2 : 4;
    for (; corners < 4; ++corners) row.corners[corners] = row.corners[0];
    row.mass_kg = inverse_mass_1_kg > 0.0 ? 1.0 / inverse_mass_1_kg : 0.0;

    LumpedImpulse& impulse = impulses_.emplace_back();
    impulse.pressed_n_s = std::max(0.0, from.impulse_n_s.dot(from.normal));
    Vec3d::Map(impulse.rubbed_n_s) = from.impulse_n_s - from.impulse_n_s.dot(from.normal) * from.normal;
  }
  for (const Slot& slot : slots_) {
    if (slot.body < bodies.size()) table.slot_of[table.first_of[slot.body] + slot.vertex] = 0;
  }
}

std::uint32_t LumpedSolver::slot_of(std::uint32_t body, std::uint32_t vertex, SlotTable& table) {
  std::uint32_t& known = table.slot_of[table.first_of[body] + vertex];
  if (known == 0) {
    slots_.push_back({body, vertex});
    known = static_cast<std::uint32_t>(slots_.size());
  }
  return known - 1;
}

void LumpedSolver::share(std::size_t index, std::span<const double> weights) {
  LumpedRow& row = rows_[index];
  SolidSide& side = sides_[index - first_solid_row_];
  side.skin_inverse_mass_1_kg = 0.0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double of_corner_1_kg = side.corner_inverse_masses_1_kg[static_cast<Eigen::Index>(i)];
    row.weights[i] = weights[i];
    row.pushes_1_kg[i] = weights[i] * of_corner_1_kg;
    side.skin_inverse_mass_1_kg += weights[i] * weights[i] * of_corner_1_kg;
  }
  row.mass_kg = side.skin_inverse_mass_1_kg > 0.0 ? 1.0 / side.skin_inverse_mass_1_kg : 0.0;
}

void LumpedSolver::turn(std::size_t index, const Vec3d& normal, const Vec3d& arm) {
  LumpedRow& row = rows_[index];
  Vec3d::Map(row.normal) = normal;
  Eigen::Map<Vec3d> rubbed_n_s(impulses_[index].rubbed_n_s);
  rubbed_n_s -= rubbed_n_s.dot(normal) * normal;
  SolidSide& side = sides_[index - first_solid_row_];
  if (side.rigid == none) return;
  side.arm = arm;
  const double inverse_mass_1_kg =
      side.skin_inverse_mass_1_kg + inverse_mass_along_1_kg(rigid_[side.rigid], arm, normal);
  row.mass_kg = inverse_mass_1_kg > 0.0 ? 1.0 / inverse_mass_1_kg : 0.0;
}

Vec3d LumpedSolver::rigid_velocity_m_s(std::size_t row) const {
  const SolidSide& side = sides_[row - first_solid_row_];
  const LumpedRigid& rigid = rigid_[side.rigid];
  return rigid.velocity + rigid.angular_velocity.cross(side.arm);
}

Vec3d LumpedSolver::impulse_n_s(std::size_t row) const {
  return impulses_[row].pressed_n_s * Vec3d::Map(rows_[row].normal) + Vec3d::Map(impulses_[row].rubbed_n_s);
}

Vec3d LumpedSolver::at_vertices(const LumpedRow& row, const Values& values) const {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < row.corner_count; ++i) {
    sum += row.weights[i] * Vec3d::Map(values.data() + std::size_t{4} * row.corners[i]);
  }
  return sum;
}

void LumpedSolver::project(const Values& values, std::size_t count, std::span<double> along) const {
  kernels_->project(rows_.data(), count, values.data(), along.data());
}

void LumpedSolver::push_vertices(const LumpedRow& row, const Vec3d& impulse_n_s, Values& values) const {
  for (std::size_t i = 0; i < row.pushed_count; ++i) {
    Vec3d::Map(values.data() + std::size_t{4} * row.corners[i]) += row.pushes_1_kg[i] * impulse_n_s;
  }
}

void LumpedSolver::push_rigid(const SolidSide& side, const Vec3d& impulse_n_s) {
  LumpedRigid& rigid = rigid_[side.rigid];
  rigid.velocity -= rigid.inverse_masses_1_kg.cwiseProduct(impulse_n_s);
  rigid.angular_velocity -= rigid.inverse_inertia_1_kg_m2 * side.arm.cross(impulse_n_s);
}

void LumpedSolver::push(Values& velocities_m_s) {
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (impulses_[r].pressed_n_s == 0.0) continue;
    const Vec3d all_n_s = impulse_n_s(r);
    push_vertices(rows_[r], all_n_s, velocities_m_s);
    if (r < first_solid_row_) continue;
    const SolidSide& side = sides_[r - first_solid_row_];
    if (side.rigid != none) push_rigid(side, all_n_s);
  }
}

SolveOutcome LumpedSolver::solve(const Due& due, const SolveLimits& limits, Values& velocities_m_s) {
  const auto sweep_of = [&](std::span<const std::uint32_t> which) -> RowSweep {
    return {rows_.data(), impulses_.data(), which.data(), which.size(), velocities_m_s.data(), true};
  };
  SolveOutcome outcome;
  outcome.converged = false;
  while (!outcome.converged && outcome.sweeps < limits.sweeps_max) {
    ++outcome.sweeps;
    double largest_m2_s2 = kernels_->sweep(sweep_of(due.skins));
    largest_m2_s2 = std::max(largest_m2_s2, sweep_rigid(due.rigid, velocities_m_s));
    largest_m2_s2 = std::max(largest_m2_s2, kernels_->sweep(sweep_of(due.fixed)));
    outcome.converged = largest_m2_s2 <= limits.enough_m_s * limits.enough_m_s;
  }
  return outcome;
}

// As sweep_rows (sweep_kernel_source.h), where a push along the normal slides the two as well.
double LumpedSolver::sweep_rigid(std::span<const std::uint32_t> due, Values& velocities_m_s) {
  double largest_m2_s2 = 0.0;
  for (const std::uint32_t r : due) {
    const LumpedRow& row = rows_[r];
    const SolidSide& side = sides_[r - first_solid_row_];
    const LumpedRigid& rigid = rigid_[side.rigid];
    LumpedImpulse& impulse = impulses_[r];
    const auto normal = Vec3d::Map(row.normal);
    const auto relative_m_s = [&]() -> Vec3d {
      return at_vertices(row, velocities_m_s) - rigid.velocity - rigid.angular_velocity.cross(side.arm);
    };
    const auto change = [&](const Vec3d& change_n_s) {
      push_vertices(row, change_n_s, velocities_m_s);
      push_rigid(side, change_n_s);
    };
    const double approach_m_s = relative_m_s().dot(normal);
    const double pressed_n_s = std::max(0.0, impulse.pressed_n_s + (impulse.least_m_s - approach_m_s) * row.mass_kg);
    if (pressed_n_s == 0.0 && impulse.pressed_n_s == 0.0) continue;
    const double change_n_s = pressed_n_s - impulse.pressed_n_s;
    impulse.pressed_n_s = pressed_n_s;
    change(change_n_s * normal);
    const double changed_m_s = change_n_s / row.mass_kg;
    largest_m2_s2 = std::max(largest_m2_s2, changed_m_s * changed_m_s);
    if (row.friction == 0.0) continue;
    const Vec3d relative = relative_m_s();
    const Vec3d slip_m_s = relative - relative.dot(normal) * normal;
    const double speed_m_s = slip_m_s.norm();
    Eigen::Map<Vec3d> rubbed_n_s(impulse.rubbed_n_s);
    const Vec3d before_n_s = rubbed_n_s;
    double inverse_mass_1_kg = 0.0;
    if (speed_m_s > 0.0) {
      inverse_mass_1_kg = side.skin_inverse_mass_1_kg + inverse_mass_along_1_kg(rigid, side.arm, slip_m_s / speed_m_s);
      if (inverse_mass_1_kg > 0.0) rubbed_n_s -= slip_m_s / inverse_mass_1_kg;
    }
    const double most_n_s = row.friction * pressed_n_s;
    const double rubbed = rubbed_n_s.norm();
    if (rubbed > most_n_s) rubbed_n_s *= most_n_s / rubbed;
    const Vec3d across_n_s = rubbed_n_s - before_n_s;
    change(across_n_s);
    largest_m2_s2 = std::max(largest_m2_s2, across_n_s.squaredNorm() * inverse_mass_1_kg * inverse_mass_1_kg);
  }
  return largest_m2_s2;
}

void LumpedSolver::part(const Due& due, std::span<const double> least_m, Values& moves_m) {
  parting_.assign(rows_.size(), {});
  for (const auto* list : {&due.skins, &due.fixed}) {
    for (const std::uint32_t r : *list) parting_[r].least_m_s = least_m[r];
  }
  const auto sweep_of = [&](std::span<const std::uint32_t> which) -> RowSweep {
    return {rows_.data(), parting_.data(), which.data(), which.size(), moves_m.data(), false};
  };
  (void)kernels_->sweep(sweep_of(due.skins));
  part_rigid(due.rigid, least_m, moves_m);
  (void)kernels_->sweep(sweep_of(due.fixed));
}

// A rigid body is shifted, not turned.
void LumpedSolver::part_rigid(std::span<const std::uint32_t> due, std::span<const double> least_m, Values& moves_m) {
  for (const std::uint32_t r : due) {
    const LumpedRow& row = rows_[r];
    const SolidSide& side = sides_[r - first_solid_row_];
    LumpedRigid& rigid = rigid_[side.rigid];
    const auto normal = Vec3d::Map(row.normal);
    const double missing_m = least_m[r] - (at_vertices(row, moves_m) - rigid.shift_m).dot(normal);
    const double inverse_mass_1_kg = side.skin_inverse_mass_1_kg + rigid.inverse_masses_1_kg.dot(normal.cwiseAbs2());
    if (missing_m <= 0.0 || inverse_mass_1_kg == 0.0) continue;
    const Vec3d push_kg_m = missing_m / inverse_mass_1_kg * normal;
    push_vertices(row, push_kg_m, moves_m);
    rigid.shift_m -= rigid.inverse_masses_1_kg.cwiseProduct(push_kg_m);
  }
}

std::size_t LumpedSolver::bytes() const {
  return slots_.capacity() * sizeof(Slot) + rows_.capacity() * sizeof(LumpedRow) +
         sides_.capacity() * sizeof(SolidSide) + rigid_.capacity() * sizeof(LumpedRigid) +
         (impulses_.capacity() + parting_.capacity()) * sizeof(LumpedImpulse);
}

}  // namespace pneuma::physics
