// The linear system of an implicit step of length s: (M + s D + s^2 K) du = b, with the tangents of all forces.
#pragma once

#include <span>
#include <vector>

#include "physics/implicit/implicit_matrix.h"

namespace pneuma::physics {

/// Over all vertices; the two are of one size.
[[nodiscard]] double dot(std::span<const Vec3d> a, std::span<const Vec3d> b);

/// One a vertex, in the order of the factor's rows.
using MotionRows = std::vector<MotionRow>;

void to_rows(std::span<const Vec3d> points, std::span<const std::uint32_t> places, MotionRows& rows);
void from_rows(const MotionRows& rows, std::span<const std::uint32_t> places, std::vector<Vec3d>& points);

/// Adds s D + s^2 K times u, but for what is on the diagonal and along the volume's gradient.
void add_tangent_products(const Tangents& tangents, const ImplicitMatrix& matrix, const MotionRows& u,
                          MotionRows& product);

/// Solved by conjugate gradients on a product that forms no matrix, with the body's ImplicitMatrix for a
/// preconditioner. The gas's rank-one term goes into it by the Sherman-Morrison-Woodbury formula. Room for one solve at
/// a time, of any body.
class ImplicitSystem {
 public:
  /// Where the tangents are taken, and the right-hand side.
  struct Problem {
    std::span<const Vec3d> x;                   // m
    std::span<const Vec3d> v;                   // m/s
    std::span<const Vec3d> b;                   // N s
    std::span<const Vec3d> volume_gradient_m2;  // at x, of bodies with gas; 0 on pinned particles
  };
  struct Tolerance {
    double relative = 0.0;
    double absolute_m_s = 0.0;
  };

  /// Solves for `step`, until the error is below `relative` of it or its mean square over the vertices below
  /// absolute_m_s^2, both in the preconditioner's norm. `body` gives the gas and its volume at x. The first guess is
  /// the preconditioner's own answer: it keeps the total momentum of b to round-off however few iterations follow.
  /// Returns b . step, the rate at which the step goes down.
  template <class Real>
  double solve(const SoftState<Real>& body, const ImplicitMatrix& matrix, const Surroundings& surroundings,
               const Problem& problem, const Tolerance& tolerance, std::vector<Vec3d>& step);

  /// dV/dx . step: by how much a move of `step` changes the volume. With the last problem's gradient.
  [[nodiscard]] double volume_change_m3(std::span<const Vec3d> step) const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  template <class Real>
  void begin(const SoftState<Real>& body, const ImplicitMatrix& matrix, const Surroundings& surroundings,
             const Problem& problem);
  void multiply(const MotionRows& u, MotionRows& product) const;
  void solve_with_gas();
  [[nodiscard]] bool has_gas() const { return !volume_gradient_.empty() && gas_stiffness_ > 0.0; }
  void add_gas(MotionRows& z) const;
  void iterate(double enough);
  [[nodiscard]] double dot(const MotionRows& a, const MotionRows& b) const;
  [[nodiscard]] double inertia(const MotionRows& u) const;
  void remove_sum(MotionRows& impulses_n_s) const;
  void clear_pinned(MotionRows& rows) const;

  // Of the solve under way.
  const SystemKernels* kernels_ = nullptr;
  const ImplicitMatrix* matrix_ = nullptr;
  std::span<const Vec3d> volume_gradient_;  // where there is gas
  double gas_stiffness_ = 0.0;              // s^2 times -dP/dV
  double gas_share_ = 0.0;
  bool is_free_ = false;  // nothing holds the body

  Tangents tangents_;
  MotionRows b_, step_, residual_, direction_, product_, conditioned_;
  MotionRows gradient_, gas_answer_;  // of the volume, and the preconditioner's answer to it
  std::vector<FactorRow<8>> rows8_;
};

}  // namespace pneuma::physics
