#include "physics/contact/solver.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <variant>
#include <vector>

#include "physics/contact/friction_program.h"

namespace pneuma::physics {
namespace {

// Sweeps before the rows are solved together: they find who touches.
constexpr std::uint32_t sweeps_before = 4;
// Of what is enough: sweeps that leave as little as a program would are the last. At what is enough itself, rounding
// decides which of the two it is, and a ball that rocks goes another way.
constexpr double exact_share = 1e-2;
// How often rows that a solution closes are added to it. Once or twice is the rule.
constexpr int additions_max = 6;
// Of a joint's inverse mass: one that two joints hold the same way must not be without bounds.
constexpr double joint_regularisation = 1e-12;

class Sweeps {
 public:
  Sweeps(std::span<ContactRow> rows, std::span<Response> responses) : rows_(rows), responses_(responses) {
    for (const ContactRow& row : rows_) {
      blocks_.push_back(block_of(row));
      if (!row.impulse_n_s.isZero(0.0)) push_both(responses_, row, row.impulse_n_s);
    }
  }

  // The largest change of a row's velocity.
  double sweep() {
    double largest_m_s = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) largest_m_s = std::max(largest_m_s, answer(rows_[i], blocks_[i]));
    return largest_m_s;
  }

  // Lists the rows that are loaded or on their way to be. Those that keep clear without an impulse are left out of
  // what is solved together: half of what is near, or more.
  void begin_loaded() {
    loaded_.clear();
    is_loaded_.assign(rows_.size(), 0);
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const ContactRow& row = rows_[i];
      if (row.is_given) continue;
      if (row.kind != RowKind::contact || !row.impulse_n_s.isZero(0.0)) take_as_loaded(i);
    }
  }
  // Adds the others that close by more than that. Returns by how much one of them does at most.
  double add_closing(double enough_m_s) {
    double most_m_s = 0.0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const ContactRow& row = rows_[i];
      if (is_loaded_[i] != 0 || row.is_given || !(blocks_[i].along_1_kg > 0.0)) continue;
      const double closes_m_s = row.least_m_s - velocity_of(row).dot(row.normal);
      most_m_s = std::max(most_m_s, closes_m_s);
      if (closes_m_s > enough_m_s) take_as_loaded(i);
    }
    return most_m_s;
  }
  [[nodiscard]] std::size_t loaded() const { return loaded_.size(); }

  // The loaded rows at once, by a program that starts from their impulses; then they hold its solution.
  bool solve_together(double enough_m_s, SolveOutcome& outcome) {
    push_loaded(-1.0);
    bool solved = false;
    if (goes_by_bodies()) {
      BodyRows matrix = load_by_bodies();
      solved = solve_with(matrix, enough_m_s, outcome);
    } else {
      DenseRows matrix = load_densely();
      solved = solve_with(matrix, enough_m_s, outcome);
    }
    push_loaded(1.0);
    return solved;
  }

  // Of the rows that took more than they can, the one that did by most takes what it can, and keeps to that. False
  // where there is none.
  bool give_way() {
    ContactRow* most = most_overtaxed(rows_);
    if (most == nullptr) return false;
    const Vec3d taken_n_s = most->most_n_s * most->impulse_n_s.normalized();
    push_both(responses_, *most, taken_n_s - most->impulse_n_s);
    most->impulse_n_s = taken_n_s;
    most->is_given = true;
    return true;
  }

 private:
  void take_as_loaded(std::size_t row) {
    is_loaded_[row] = 1;
    loaded_.push_back(row);
  }

  // Where the bodies' columns are no more than the rows.
  bool goes_by_bodies() {
    bodies_.clear();
    for (const std::size_t i : loaded_) {
      for (const Support* side : {&rows_[i].first, &rows_[i].second}) {
        if (!std::holds_alternative<FixedResponse>(responses_[side->body])) bodies_.push_back(side->body);
      }
    }
    std::ranges::sort(bodies_);
    const auto repeated = std::ranges::unique(bodies_);
    bodies_.erase(repeated.begin(), repeated.end());
    return LowRankColumns::count * bodies_.size() <= loaded_.size();
  }

  BodyRows load_by_bodies() const {
    const std::size_t count = loaded_.size();
    BodyRows matrix(count, bodies_.size());
    for (std::size_t i = 0; i < count; ++i) {
      const ContactRow& row = rows_[loaded_[i]];
      for (std::size_t j = 0; j <= i; ++j) {
        matrix.set_number(i, j, coupling_number_1_kg(responses_, row, rows_[loaded_[j]]));
      }
      matrix.add_softness(i, row.softness_1_kg);
      const auto add = [&](const Support& side, double sign) {
        const auto body = std::ranges::lower_bound(bodies_, side.body);
        if (body == bodies_.end() || *body != side.body) return;
        matrix.add_part(i, static_cast<std::uint32_t>(body - bodies_.begin()), sign,
                        columns(responses_[side.body], side));
      };
      add(row.first, 1.0);
      add(row.second, -1.0);
    }
    return matrix;
  }

  DenseRows load_densely() const {
    DenseRows matrix(loaded_.size());
    for (std::size_t i = 0; i < loaded_.size(); ++i) {
      const ContactRow& row = rows_[loaded_[i]];
      for (std::size_t j = 0; j <= i; ++j) {
        const ContactRow& by = rows_[loaded_[j]];
        if (!tied(row, by)) continue;
        matrix.set_block(i, j, coupling_1_kg(responses_, row, by));
      }
      if (row.softness_1_kg > 0.0) matrix.add_softness(i, row.softness_1_kg);
    }
    return matrix;
  }

  // The loaded rows hold no impulse of theirs in the responses.
  template <class Rows>
  bool solve_with(Rows& matrix, double enough_m_s, SolveOutcome& outcome) {
    FrictionProgram<Rows> program(matrix);
    for (std::size_t i = 0; i < loaded_.size(); ++i) {
      const ContactRow& row = rows_[loaded_[i]];
      const Block& block = blocks_[loaded_[i]];
      const double mean_1_kg = block.inverse_mass_1_kg.trace() / 3.0 + row.softness_1_kg;
      const typename FrictionProgram<Rows>::Own own{block.along_1_kg, block.across_1_kg, mean_1_kg};
      const Vec3d free_m_s = velocity_of(row);
      switch (row.kind) {
        case RowKind::contact:
          program.set_contact(i, row.normal, row.friction, own, free_m_s - row.least_m_s * row.normal, row.impulse_n_s);
          break;
        case RowKind::tie:
          program.set_tie(i, own, free_m_s, row.impulse_n_s);
          break;
        case RowKind::guide:
          program.set_guide(i, row.normal, own, free_m_s, row.impulse_n_s);
          break;
      }
    }
    const bool solved = program.solve(enough_m_s);
    outcome.factorisations += program.factorisations();
    outcome.off_m_s = program.off_m_s();
    for (std::size_t i = 0; i < loaded_.size(); ++i) rows_[loaded_[i]].impulse_n_s = program.impulse(i);
    return solved;
  }

  struct Block {
    Eigen::Matrix3d inverse_mass_1_kg = Eigen::Matrix3d::Zero();
    Eigen::Matrix3d mass_kg = Eigen::Matrix3d::Zero();  // of a joint's row: what stops it
    double along_1_kg = 0.0;                            // along the normal
    double across_1_kg = 0.0;                           // the most of any direction across it
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
    const Eigen::Matrix3d local = axes.transpose() * block.inverse_mass_1_kg * axes;
    block.along_1_kg = local(0, 0);
    const double half_difference = 0.5 * (local(1, 1) - local(2, 2));
    block.across_1_kg = 0.5 * (local(1, 1) + local(2, 2)) + std::hypot(half_difference, local(1, 2));
    if (row.kind == RowKind::contact || !(local.trace() > 0.0)) return block;
    const Eigen::Matrix3d soft =
        local + (row.softness_1_kg + joint_regularisation * local.trace()) * Eigen::Matrix3d::Identity();
    if (row.kind == RowKind::tie) {
      block.mass_kg = axes * soft.inverse() * axes.transpose();
    } else {
      const Eigen::Matrix2d across_axis = soft.bottomRightCorner<2, 2>();
      const Eigen::Matrix<double, 3, 2> directions = axes.rightCols<2>();
      block.mass_kg = directions * across_axis.inverse() * directions.transpose();
    }
    return block;
  }

  double answer_joint(ContactRow& row, const Block& block) {
    const Vec3d velocity = velocity_of(row) + row.softness_1_kg * row.impulse_n_s;
    const Vec3d change_n_s = -(block.mass_kg * velocity);
    row.impulse_n_s += change_n_s;
    push_both(responses_, row, change_n_s);
    return (block.inverse_mass_1_kg * change_n_s).norm() + row.softness_1_kg * change_n_s.norm();
  }

  double answer(ContactRow& row, const Block& block) {
    if (row.is_given) return 0.0;
    if (row.kind != RowKind::contact) return answer_joint(row, block);
    if (!(block.along_1_kg > 0.0)) return 0.0;
    Vec3d velocity = velocity_of(row);
    const double pressed_n_s = row.impulse_n_s.dot(row.normal);
    if (row.softness_1_kg > 0.0) velocity += row.softness_1_kg * row.impulse_n_s;
    const double normal_n_s = std::max(
        0.0, pressed_n_s + (row.least_m_s - velocity.dot(row.normal)) / (block.along_1_kg + row.softness_1_kg));
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
    push_both(responses_, row, change_n_s);
    return largest_m_s;
  }

  [[nodiscard]] Vec3d velocity_of(const ContactRow& row) const {
    return row.free_m_s + change_m_s(responses_[row.first.body], row.first) -
           change_m_s(responses_[row.second.body], row.second);
  }

  void push_loaded(double share) {
    for (const std::size_t i : loaded_) {
      if (!rows_[i].impulse_n_s.isZero(0.0)) push_both(responses_, rows_[i], share * rows_[i].impulse_n_s);
    }
  }

  std::span<ContactRow> rows_;
  std::span<Response> responses_;
  std::vector<Block> blocks_;
  std::vector<std::size_t> loaded_;  // rows that are solved together
  std::vector<std::uint8_t> is_loaded_;
  std::vector<std::uint32_t> bodies_;  // that give way, of the loaded rows
};

// Solves the loaded rows together. Empty where more are loaded than limits.direct_rows_max.
std::optional<bool> solve_loaded(Sweeps& sweeps, const SolveLimits& limits, SolveOutcome& outcome) {
  const double enough_m_s = std::max(limits.enough_m_s, limits.direct_enough_m_s);
  sweeps.begin_loaded();
  (void)sweeps.add_closing(limits.enough_m_s);
  for (int addition = 0; addition < additions_max; ++addition) {
    if (sweeps.loaded() > limits.direct_rows_max) return std::nullopt;
    const bool solved = sweeps.solve_together(enough_m_s, outcome);
    const double closes_m_s = sweeps.add_closing(enough_m_s);
    outcome.off_m_s = std::max(outcome.off_m_s, closes_m_s);
    if (closes_m_s <= enough_m_s) return solved;
  }
  return false;
}

bool solve_once(Sweeps& sweeps, const SolveLimits& limits, SolveOutcome& outcome) {
  const std::uint32_t first = std::min(sweeps_before, limits.sweeps_max);
  const bool may_solve = limits.direct_rows_max > 0;
  for (std::uint32_t i = 0; i < limits.sweeps_max; ++i) {
    ++outcome.sweeps;
    outcome.off_m_s = sweeps.sweep();
    const bool is_before = may_solve && i < first;
    if (outcome.off_m_s <= (is_before ? exact_share : 1.0) * limits.enough_m_s) return true;
    if (i + 1 != first || !may_solve) continue;
    if (const auto solved = solve_loaded(sweeps, limits, outcome)) return *solved;
  }
  return false;
}

}  // namespace

SolveOutcome solve_rows(std::span<ContactRow> rows, std::span<Response> responses, const SolveLimits& limits) {
  SolveOutcome outcome;
  if (rows.empty()) return outcome;
  Sweeps sweeps(rows, responses);
  do {
    outcome.converged = solve_once(sweeps, limits, outcome);
  } while (sweeps.give_way());
  return outcome;
}

}  // namespace pneuma::physics
