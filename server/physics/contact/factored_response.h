// How a body that an implicit step solved for answers to impulses: by the inverse of a metric that is nowhere softer
// than its springs, with its rotations and its gas added.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/implicit/implicit_matrix.h"

namespace pneuma::physics {

/// [a] with [a] b = a x b.
[[nodiscard]] inline Eigen::Matrix3d cross_matrix(const Vec3d& a) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return matrix;
}

/// The columns of a body at a support, by which its inverse mass differs from a number times the identity.
struct LowRankColumns {
  static constexpr int count = 7;
  using Columns = Eigen::Matrix<double, 3, count>;
  using Signs = Eigen::Matrix<double, count, 1>;
  Columns columns = Columns::Zero();
  Signs signs = Signs::Ones();
};

/// The metric of one body where its step has come to. With A = M + s D + s^2 K of the body's matrix:
///
///     B = A^-1 - A^-1 M R (R^T M A^-1 M R)^-1 R^T M A^-1 + R (J + s^2 kappa)^-1 R^T
///     metric^-1 = B - c (B g)(B g)^T
///
/// R are the rotations about the centre of mass, which A takes for stretching: it could not turn a stiff ball by
/// friction. They are answered by the inertia J and the stress stiffness kappa instead; without that, stiff balls that
/// roll over each other gained energy. g is the volume's gradient, c the gas's stiffness by Sherman, Morrison and
/// Woodbury.
class BodyMetric {
 public:
  struct Place {
    std::span<const Vec3d> x;                   // m
    std::span<const Vec3d> volume_gradient_m2;  // of bodies with gas, else empty
    double gas_stiffness = 0.0;                 // s^2 times -dP/dV
    double stress_n_m = 0.0;                    // kappa
  };

  /// At the first place of a step. `turns`: nothing holds the body.
  void begin(const ImplicitMatrix& matrix, bool turns, std::span<const Vec3d> x);
  /// Moves on to another place of the same step, and answers impulses `b_n_s` on all vertices by velocities.
  void move_to(const Place& place, std::span<const Vec3d> b_n_s, std::vector<Vec3d>& answer_m_s);

  [[nodiscard]] const ImplicitMatrix& matrix() const { return *matrix_; }
  /// The seven columns by which the answer differs from A^-1: three turn it by the inertia, four are taken away.
  using LowRank = LowRankColumns::Columns;
  [[nodiscard]] LowRank low_rank(const Support& at) const;
  static constexpr Eigen::Index added = 3;
  /// The velocities of all vertices by the shares of the low-rank columns.
  [[nodiscard]] Vec3d of_low_rank(std::size_t vertex, const Eigen::Matrix<double, 7, 1>& shares) const;

 private:
  void solve_with_gradient(std::span<const Vec3d> b, std::vector<Vec3d>& z);
  void add_rotations(std::span<const Vec3d> b, std::vector<Vec3d>& z) const;

  const ImplicitMatrix* matrix_ = nullptr;
  bool turns_ = false;
  std::vector<Vec3d> arms_, slow_arms_;  // X, and A^-1 M X
  Eigen::Matrix3d inertia_ = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d by_inertia_ = Eigen::Matrix3d::Zero();  // factors of the inverses
  Eigen::Matrix3d by_metric_ = Eigen::Matrix3d::Zero();
  std::vector<Vec3d> gas_answer_;  // sqrt(c) times B g; empty without gas
  std::vector<FactorRow<4>> rows4_;
  std::vector<FactorRow<8>> rows8_;
};

/// The metric's inverse at the vertices that rows name.
class FactoredResponse {
 public:
  explicit FactoredResponse(const BodyMetric& metric) : metric_(&metric) {}

  /// Makes room for a support and gives it its slot. All of them before finish().
  void add(Support& at);
  void finish();

  [[nodiscard]] Vec3d change_m_s(const Support& at) const;
  [[nodiscard]] double number_1_kg(const Support& at, const Support& by) const;
  [[nodiscard]] LowRankColumns columns(const Support& at) const;
  [[nodiscard]] Eigen::Matrix3d inverse_mass_1_kg(const Support& at, const Support& by) const;
  void push(const Support& at, const Vec3d& impulse_n_s);

  /// The sum of what was pushed so far.
  [[nodiscard]] Vec3d impulse_n_s() const;
  /// Adds to the velocities of all vertices what the impulses pushed so far do, but for their rounding.
  void add_changes(std::span<Vec3d> u_m_s) const;

 private:
  struct Side {
    std::array<std::uint32_t, 3> locals{};
    std::size_t column = 0;  // in columns_
    BodyMetric::LowRank low_rank = BodyMetric::LowRank::Zero();
  };
  [[nodiscard]] const double* column_of(const Side& side) const { return columns_.data() + side.column; }

  const BodyMetric* metric_;
  std::vector<std::uint32_t> vertices_;  // that rows name
  std::vector<std::int32_t> local_of_;   // one a vertex; -1 of others
  std::vector<Side> sides_;
  std::vector<Support> supports_;    // one a side
  std::vector<double> columns_;      // A^-1 of a side, at vertices_
  std::vector<double> changes_;      // x of vertices_, then y, then z
  std::vector<Vec3d> impulses_n_s_;  // on vertices_
  Eigen::Matrix<double, 7, 1> shares_ = Eigen::Matrix<double, 7, 1>::Zero();
};

}  // namespace pneuma::physics
