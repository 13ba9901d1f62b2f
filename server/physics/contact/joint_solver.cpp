#include "physics/contact/joint_solver.h"

#include <algorithm>
#include <utility>
#include <vector>

#include <Eigen/SparseCholesky>

namespace pneuma::physics {
namespace {

// Of the diagonal: joints that say the same twice must not make the matrix singular.
constexpr double joint_row_regularisation = 1e-11;
// Rounds in which all ropes change sides at once; then one a round does, the last (Murty), and that ends.
constexpr std::uint32_t whole_rounds = 8;
// Past it, what is taut stays as the last round has it.
constexpr std::size_t rounds_most = 64;

class JointProgram {
 public:
  JointProgram(std::span<ContactRow> rows, std::span<Response> responses) : rows_(rows), responses_(responses) {
    for (const ContactRow& row : rows_) {
      axes_.push_back(axes_of(row));
      is_taut_.push_back(row.kind != RowKind::contact || row.free_m_s.dot(row.normal) < row.least_m_s ? 1 : 0);
    }
    find_couplings();
  }

  SolveOutcome solve(double enough_m_s) {
    SolveOutcome outcome;
    const auto rounds_max = static_cast<std::uint32_t>(std::min(whole_rounds + 4 * rows_.size(), rounds_most));
    do {
      outcome.converged = false;
      for (std::uint32_t round = 0; round < rounds_max && !outcome.converged; ++round) {
        ++outcome.factorisations;
        if (!solve_taut()) {
          for (ContactRow& row : rows_) row.impulse_n_s.setZero();  // none was found
          return outcome;
        }
        outcome.converged = !change_sides(enough_m_s, round < whole_rounds);
      }
    } while (give_way());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!rows_[i].impulse_n_s.isZero(0.0)) push_both(responses_, rows_[i], rows_[i].impulse_n_s);
    }
    return outcome;
  }

 private:
  struct Coupling {
    std::uint32_t row = 0;
    std::uint32_t by = 0;  // at most row
    Eigen::Matrix3d inverse_mass_1_kg;
  };

  /// The directions that a row holds come first.
  static Eigen::Matrix3d axes_of(const ContactRow& row) {
    if (row.kind == RowKind::tie) return Eigen::Matrix3d::Identity();
    const Vec3d u = row.normal.unitOrthogonal();
    Eigen::Matrix3d axes;
    if (row.kind == RowKind::guide) {
      axes << u, row.normal.cross(u), row.normal;
    } else {
      axes << row.normal, u, row.normal.cross(u);
    }
    return axes;
  }
  static int held_of(const ContactRow& row) {
    return row.kind == RowKind::tie ? 3 : row.kind == RowKind::guide ? 2 : 1;
  }

  void find_couplings() {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_body;  // body, row
    for (std::uint32_t i = 0; i < rows_.size(); ++i) {
      for (const Support* side : {&rows_[i].first, &rows_[i].second}) {
        if (!std::holds_alternative<FixedResponse>(responses_[side->body])) by_body.emplace_back(side->body, i);
      }
    }
    std::ranges::sort(by_body);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (std::size_t begin = 0; begin < by_body.size();) {
      std::size_t end = begin;
      while (end < by_body.size() && by_body[end].first == by_body[begin].first) ++end;
      for (std::size_t i = begin; i < end; ++i) {
        for (std::size_t j = begin; j <= i; ++j) pairs.emplace_back(by_body[i].second, by_body[j].second);
      }
      begin = end;
    }
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    for (const auto& [row, by] : pairs) {
      const Eigen::Matrix3d coupling = coupling_1_kg(responses_, rows_[row], rows_[by]);
      if (row == by || !coupling.isZero(0.0)) couplings_.push_back({row, by, coupling});
    }
  }

  [[nodiscard]] bool is_unknown(std::size_t row) const { return is_taut_[row] != 0 && !rows_[row].is_given; }

  // The impulses of all that is taut; none of the others.
  bool solve_taut() {
    std::vector<int> first(rows_.size(), -1);
    int count = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!is_unknown(i)) continue;
      first[i] = count;
      count += held_of(rows_[i]);
    }
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (first[i] < 0) continue;
      const ContactRow& row = rows_[i];
      const Vec3d local = axes_[i].transpose() * row.free_m_s;
      for (int a = 0; a < held_of(row); ++a) right[first[i] + a] = -local[a];
      if (row.kind == RowKind::contact) right[first[i]] += row.least_m_s;
    }
    std::vector<Eigen::Triplet<double>> entries;
    std::vector<std::uint8_t> has_diagonal(rows_.size(), 0);
    for (const Coupling& coupling : couplings_) {
      const auto [i, j, inverse] = coupling;
      if (i != j) {
        add_given(i, first[i], inverse, j, right);
        add_given(j, first[j], inverse.transpose(), i, right);
      }
      if (first[i] < 0 || first[j] < 0) continue;
      const Eigen::Matrix3d local = axes_[i].transpose() * inverse * axes_[j];
      const double more =
          i == j ? rows_[i].softness_1_kg + joint_row_regularisation * std::max(local.trace(), 0.0) : 0.0;
      if (i == j && local.trace() + more > 0.0) has_diagonal[i] = 1;
      for (int a = 0; a < held_of(rows_[i]); ++a) {
        for (int b = 0; b < held_of(rows_[j]); ++b) {
          if (i == j && b > a) continue;
          const double value = local(a, b) + (i == j && a == b ? more : 0.0);
          const int row = first[i] + a;
          const int column = first[j] + b;
          entries.emplace_back(std::max(row, column), std::min(row, column), value);
        }
      }
    }
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (first[i] < 0 || has_diagonal[i] != 0) continue;  // nothing that it holds gives way
      for (int a = 0; a < held_of(rows_[i]); ++a) {
        entries.emplace_back(first[i] + a, first[i] + a, 1.0);
        right[first[i] + a] = 0.0;
      }
    }
    Eigen::VectorXd found;
    if (count > 0) {
      Eigen::SparseMatrix<double> matrix(count, count);
      matrix.setFromTriplets(entries.begin(), entries.end());
      factor_.compute(matrix);
      if (factor_.info() != Eigen::Success) return false;
      found = factor_.solve(right);
      if (!found.allFinite()) return false;
    }
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (rows_[i].is_given) continue;
      Vec3d local = Vec3d::Zero();
      for (int a = 0; first[i] >= 0 && a < held_of(rows_[i]); ++a) local[a] = found[first[i] + a];
      rows_[i].impulse_n_s = axes_[i] * local;
    }
    return true;
  }

  void add_given(std::uint32_t row, int first, const Eigen::Matrix3d& inverse_mass_1_kg, std::uint32_t by,
                 Eigen::VectorXd& right) const {
    if (first < 0 || !rows_[by].is_given) return;
    const Vec3d local = axes_[row].transpose() * (inverse_mass_1_kg * rows_[by].impulse_n_s);
    for (int a = 0; a < held_of(rows_[row]); ++a) right[first + a] -= local[a];
  }

  // Ropes that pushed become slack, and slack ones that would become too long become taut.
  bool change_sides(double enough_m_s, bool all) {
    changes_m_s_.assign(rows_.size(), Vec3d::Zero());
    for (const Coupling& coupling : couplings_) {
      const auto [i, j, inverse] = coupling;
      changes_m_s_[i] += inverse * rows_[j].impulse_n_s;
      if (i != j) changes_m_s_[j] += inverse.transpose() * rows_[i].impulse_n_s;
    }
    bool changed = false;
    for (std::size_t k = rows_.size(); k-- > 0 && (all || !changed);) {
      const ContactRow& row = rows_[k];
      if (row.kind != RowKind::contact || row.is_given) continue;
      const double pulled_n_s = row.impulse_n_s.dot(row.normal);
      const double parts_m_s = (row.free_m_s + changes_m_s_[k]).dot(row.normal) - row.least_m_s;
      const bool changes = is_taut_[k] != 0 ? pulled_n_s < 0.0 : parts_m_s < -enough_m_s;
      if (!changes) continue;
      is_taut_[k] = is_taut_[k] != 0 ? 0 : 1;
      changed = true;
    }
    return changed;
  }

  bool give_way() {
    ContactRow* most = most_overtaxed(rows_);
    if (most == nullptr) return false;
    most->impulse_n_s = most->most_n_s * most->impulse_n_s.normalized();
    most->is_given = true;
    return true;
  }

  std::span<ContactRow> rows_;
  std::span<Response> responses_;
  std::vector<Eigen::Matrix3d> axes_;
  std::vector<std::uint8_t> is_taut_;
  std::vector<Coupling> couplings_;
  std::vector<Vec3d> changes_m_s_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
};

}  // namespace

SolveOutcome solve_joint_rows(std::span<ContactRow> rows, std::span<Response> responses, double enough_m_s) {
  if (rows.empty()) return {};
  return JointProgram(rows, responses).solve(enough_m_s);
}

}  // namespace pneuma::physics
