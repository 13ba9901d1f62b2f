#include "physics/contact/solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "physics/contact/disc_program.h"

namespace pneuma::physics {
namespace {

// Sweeps before the rows are solved together: they find who touches.
constexpr std::uint32_t sweeps_before = 4;
// The radii of friction's discs follow the normal impulses in so many rounds.
constexpr int friction_rounds = 3;

Vec3d change_m_s(const Response& response, const Support& at) {
  return std::visit([&](const auto& body) { return body.change_m_s(at); }, response);
}

Eigen::Matrix3d inverse_mass_1_kg(const Response& response, const Support& at, const Support& by) {
  return std::visit([&](const auto& body) { return body.inverse_mass_1_kg(at, by); }, response);
}

void push(Response& response, const Support& at, const Vec3d& impulse_n_s) {
  std::visit([&](auto& body) { body.push(at, impulse_n_s); }, response);
}

// How the relative velocity of one row answers to the impulse of another.
Eigen::Matrix3d coupling_1_kg(std::span<const Response> responses, const ContactRow& at, const ContactRow& by) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const auto add = [&](const Support& of, const Support& from, double sign) {
    if (of.body == from.body) sum += sign * inverse_mass_1_kg(responses[of.body], of, from);
  };
  add(at.first, by.first, 1.0);
  add(at.first, by.second, -1.0);
  add(at.second, by.first, -1.0);
  add(at.second, by.second, 1.0);
  return sum;
}

class Sweeps {
 public:
  Sweeps(std::span<ContactRow> rows, std::span<Response> responses) : rows_(rows), responses_(responses) {
    for (const ContactRow& row : rows_) blocks_.push_back(block_of(row));
    push_all();
  }

  // The largest change of a row's velocity.
  double sweep() {
    double largest_m_s = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) largest_m_s = std::max(largest_m_s, answer(rows_[i], blocks_[i]));
    return largest_m_s;
  }

  // All rows at once, by a program that starts from their impulses; then they hold its solution.
  bool solve_together(double enough_m_s, std::uint32_t& factorisations) {
    const std::size_t count = rows_.size();
    DiscProgram program(count);
    for (std::size_t i = 0; i < count; ++i) {
      const ContactRow& row = rows_[i];
      const Vec3d at_rest = row.free_m_s;  // without any impulse
      Vec3d wanted = axes_[i].transpose() * at_rest;
      wanted[0] -= row.least_m_s;
      program.set_row(i, wanted, axes_[i].transpose() * row.impulse_n_s, blocks_[i].across_1_kg);
      for (std::size_t j = 0; j <= i; ++j) {
        if (!tied(row, rows_[j])) continue;
        program.set_block(i, j, axes_[i].transpose() * coupling_1_kg(responses_, row, rows_[j]) * axes_[j]);
      }
    }
    bool solved = false;
    for (int round = 0; round < friction_rounds; ++round) {
      double change_m_s = 0.0;
      for (std::size_t i = 0; i < count; ++i) {
        change_m_s = std::max(change_m_s, program.set_disc(i, rows_[i].friction * program.impulse(i)[0]));
      }
      if (round > 0 && change_m_s <= enough_m_s) return take(program, solved);
      solved = program.solve(enough_m_s, factorisations);
    }
    return take(program, solved && discs_fit(program, enough_m_s));
  }

 private:
  // Whether friction stays within what the last normal impulses allow.
  [[nodiscard]] bool discs_fit(const DiscProgram& program, double enough_m_s) const {
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Vec3d impulse_n_s = program.impulse(i);
      const double past_n_s = impulse_n_s.tail<2>().norm() - rows_[i].friction * impulse_n_s[0];
      if (past_n_s * blocks_[i].across_1_kg > enough_m_s) return false;
    }
    return true;
  }

  bool take(const DiscProgram& program, bool solved) {
    const std::size_t count = rows_.size();
    pull_all();
    for (std::size_t i = 0; i < count; ++i) rows_[i].impulse_n_s = axes_[i] * program.impulse(i);
    push_all();
    return solved;
  }

  struct Block {
    Eigen::Matrix3d inverse_mass_1_kg = Eigen::Matrix3d::Zero();
    double along_1_kg = 0.0;   // along the normal
    double across_1_kg = 0.0;  // the most of any direction across it
  };

  static bool tied(const ContactRow& a, const ContactRow& b) {
    return a.first.body == b.first.body || a.first.body == b.second.body || a.second.body == b.first.body ||
           a.second.body == b.second.body;
  }

  Block block_of(const ContactRow& row) {
    Block block;
    block.inverse_mass_1_kg = coupling_1_kg(responses_, row, row);
    const Vec3d& n = row.normal;
    const Vec3d other = std::abs(n.x()) < 0.7 ? Vec3d::UnitX() : Vec3d::UnitY();
    const Vec3d u = (other - n * n.dot(other)).normalized();
    Eigen::Matrix3d axes;
    axes << n, u, n.cross(u);
    axes_.push_back(axes);
    const Eigen::Matrix3d local = axes.transpose() * block.inverse_mass_1_kg * axes;
    block.along_1_kg = local(0, 0);
    const double half_difference = 0.5 * (local(1, 1) - local(2, 2));
    block.across_1_kg = 0.5 * (local(1, 1) + local(2, 2)) + std::hypot(half_difference, local(1, 2));
    return block;
  }

  double answer(ContactRow& row, const Block& block) {
    if (!(block.along_1_kg > 0.0)) return 0.0;
    Vec3d velocity = row.free_m_s + change_m_s(responses_[row.first.body], row.first) -
                     change_m_s(responses_[row.second.body], row.second);
    const double pressed_n_s = row.impulse_n_s.dot(row.normal);
    const double normal_n_s =
        std::max(0.0, pressed_n_s + (row.least_m_s - velocity.dot(row.normal)) / block.along_1_kg);
    if (normal_n_s == 0.0 && pressed_n_s == 0.0) return 0.0;
    Vec3d change_n_s = (normal_n_s - pressed_n_s) * row.normal;
    double largest_m_s = std::abs(normal_n_s - pressed_n_s) * block.along_1_kg;
    if (row.friction > 0.0) {
      velocity += block.inverse_mass_1_kg * change_n_s;
      const Vec3d before_n_s = row.impulse_n_s - pressed_n_s * row.normal;
      Vec3d rubbed_n_s = before_n_s - (velocity - velocity.dot(row.normal) * row.normal) / block.across_1_kg;
      const double most_n_s = row.friction * normal_n_s;
      const double rubbed = rubbed_n_s.norm();
      if (rubbed > most_n_s) rubbed_n_s *= most_n_s / rubbed;
      largest_m_s = std::max(largest_m_s, (rubbed_n_s - before_n_s).norm() * block.across_1_kg);
      change_n_s += rubbed_n_s - before_n_s;
    }
    row.impulse_n_s += change_n_s;
    push_both(row, change_n_s);
    return largest_m_s;
  }

  void push_both(const ContactRow& row, const Vec3d& impulse_n_s) {
    push(responses_[row.first.body], row.first, impulse_n_s);
    push(responses_[row.second.body], row.second, -impulse_n_s);
  }
  void push_all() {
    for (const ContactRow& row : rows_) {
      if (!row.impulse_n_s.isZero(0.0)) push_both(row, row.impulse_n_s);
    }
  }
  void pull_all() {
    for (const ContactRow& row : rows_) {
      if (!row.impulse_n_s.isZero(0.0)) push_both(row, -row.impulse_n_s);
    }
  }

  std::span<ContactRow> rows_;
  std::span<Response> responses_;
  std::vector<Block> blocks_;
  std::vector<Eigen::Matrix3d> axes_;  // the normal, and two across it
};

}  // namespace

SolveOutcome solve_rows(std::span<ContactRow> rows, std::span<Response> responses, const SolveLimits& limits) {
  SolveOutcome outcome;
  if (rows.empty()) return outcome;
  Sweeps sweeps(rows, responses);
  const bool may_solve = rows.size() <= limits.direct_rows_max;
  const std::uint32_t sweeps_first = may_solve ? std::min(sweeps_before, limits.sweeps_max) : limits.sweeps_max;
  while (outcome.sweeps < sweeps_first) {
    ++outcome.sweeps;
    if (sweeps.sweep() <= limits.enough_m_s) return outcome;
  }
  outcome.converged = may_solve && sweeps.solve_together(limits.enough_m_s, outcome.factorisations);
  return outcome;
}

}  // namespace pneuma::physics
