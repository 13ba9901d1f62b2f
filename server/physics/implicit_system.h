// The linear system of an implicit step of length s: (M + s D + s^2 K) du = b, with the tangents of springs, damping,
// bending, gas, wind and grabs.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "physics/forces.h"
#include "physics/sparse_cholesky.h"
#include "physics/state.h"

namespace pneuma::physics {

/// Solved by conjugate gradients on a product that forms no matrix. The preconditioner is one N x N matrix, the same
/// for x, y and z: M + (s d + s^2 k) L with the graph Laplacian L, which is never less than the springs' tangent, and
/// the like of bending, wind and grabs; factored once a body, step and set of constants. The gas's rank-one term goes
/// into it by the Sherman-Morrison-Woodbury formula.
class ImplicitSystem {
 public:
  /// Takes over the body's constants for steps of s; factors where any differs from the last call's. False where the
  /// matrix could not be factored.
  template <class Real>
  [[nodiscard]] bool set_up(const SoftState<Real>& body, const Surroundings& surroundings, double s);

  /// Where the tangents are taken, and the right-hand side.
  struct Problem {
    std::span<const Vec3d> x;  // m
    std::span<const Vec3d> v;  // m/s
    std::span<const Vec3d> b;  // N s
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
  double solve(const SoftState<Real>& body, const Surroundings& surroundings, const Problem& problem,
               const Tolerance& tolerance, std::vector<Vec3d>& step);

  /// dV/dx . step: by how much a move of `step` changes the volume.
  [[nodiscard]] double volume_change_m3(std::span<const Vec3d> step) const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  // What the factored matrix depends on besides the mesh, which a body keeps.
  struct Constants {
    double s = 0.0;
    double vertex_mass_kg = 0.0;
    double stiffness_n_m = 0.0;
    double damping_n_s_m = 0.0;
    double bend_stiffness_n_m = 0.0;
    double drag_n_s_m3 = 0.0;   // times a vertex's area, of wind
    std::vector<double> grabs;  // vertex, stiffness and damping of each
    std::vector<std::uint8_t> pinned;
    bool operator==(const Constants&) const = default;
  };
  struct EdgeTangent {
    Vec3d direction = Vec3d::Zero();
    double along = 0.0;          // N s^2/m, of springs and damping
    double across = 0.0;         // of stretched springs; a compressed one's is negative, and left out
    Vec3d turn = Vec3d::Zero();  // of -P grad^2 V
  };
  struct HingeTangent {
    std::array<std::uint32_t, 4> vertices{};
    std::array<Vec3d, 4> gradient{};
    double stiffness = 0.0;
  };

  [[nodiscard]] Eigen::SparseMatrix<double> preconditioner(std::span<const Hinge> hinges) const;
  template <class Real>
  void linearise_gas(const SoftState<Real>& body, std::span<const Vec3d> x);
  template <class Real>
  void linearise_rest(const SoftState<Real>& body, const Surroundings& surroundings, const Problem& problem);
  void linearise_edges(std::span<const Vec3d> x, double turn);
  void linearise_bending(std::span<const Hinge> hinges, std::span<const Vec3d> x);
  void linearise_wind(const SoftBody& body, const Atmosphere& atmosphere, std::span<const Vec3d> x,
                      std::span<const Vec3d> v);
  void multiply(std::span<const Vec3d> u, std::vector<Vec3d>& product) const;
  void precondition(std::span<const Vec3d> b, std::vector<Vec3d>& z);
  void solve_with_gas(std::span<const Vec3d> b, std::vector<Vec3d>& z);
  [[nodiscard]] bool has_gas() const { return !volume_gradient_.empty() && gas_stiffness_ > 0.0; }
  void add_gas(std::vector<Vec3d>& z) const;
  void iterate(double enough, std::vector<Vec3d>& step);
  void clear_pinned(std::vector<Vec3d>& points) const;

  std::shared_ptr<const Mesh> mesh_;
  Constants constants_;
  std::vector<double> rest_lengths_m_;
  std::vector<std::array<std::uint32_t, 2>> opposite_;  // of bodies with gas
  SparseCholesky factor_;
  bool factored_ = false;
  std::vector<double> diagonal_;  // mass and grabs

  std::vector<EdgeTangent> edges_;
  std::vector<Eigen::Matrix3d> drags_;  // a face, where there is wind
  std::vector<HingeTangent> bends_;     // where there is bending
  std::vector<Vec3d> volume_gradient_;  // where there is gas
  std::vector<Vec3d> gas_answer_;       // the preconditioner's to the gradient
  double gas_stiffness_ = 0.0;          // s^2 times -dP/dV
  double gas_share_ = 0.0;

  std::vector<Vec3d> residual_, direction_, product_, conditioned_;
  std::vector<std::array<double, 4>> rows4_;
  std::vector<std::array<double, 6>> rows6_;
};

}  // namespace pneuma::physics
