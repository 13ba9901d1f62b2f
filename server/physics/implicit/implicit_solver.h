// One stage of an implicit integrator: the velocities u that satisfy M (u - u0) = s f(x0 + s u, u).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/implicit/implicit_system.h"
#include "physics/lanes/body_forces.h"

namespace pneuma::physics {

/// The furthest that any point is from their mean.
[[nodiscard]] double spread(std::span<const Vec3d> points);

/// What a body's solves need besides the body. The matrices are kept between steps.
template <class Real>
struct ImplicitTables {
  LaneTables<Real> lanes;
  ImplicitMatrices* matrices = nullptr;  // the world's
  HeldMatrices held;
};

/// How exactly a stage is solved.
struct StageAccuracy {
  std::uint32_t newton_iterations = 1;
  double error_target = 0.01;
  std::uint32_t turned_iterations = 1;  // of a stage in which edges turn far, if that is more
};

struct ImplicitStage {
  std::span<const Vec3d> x0;  // m
  std::span<const Vec3d> u0;  // m/s
  double s = 0.0;             // s
};

/// A body's stages, in double whatever the body steps in. Newton's iterations with the tangent of implicit_system.h;
/// a correction that moves particles by more than a fraction of their spacing is shortened (but for its mean, where
/// nothing holds the body: that falls freely) until the force along it no longer turns back harder than it pushed. Room
/// for one body at a time.
template <class Real>
class ImplicitSolver {
 public:
  /// Improves the guess `u`. False where no finite answer was found. Leaves the body's volume and pressure at what they
  /// are at x0 + s u.
  [[nodiscard]] bool solve(SoftState<Real>& body, ImplicitTables<Real>& tables, const ImplicitStage& stage,
                           const StageAccuracy& accuracy, const SubstepContext& context, std::vector<Vec3d>& u);

  /// f(x, v), N; zero on pinned particles. Until the next call of either.
  [[nodiscard]] std::span<const Vec3d> force(SoftState<Real>& body, const ImplicitTables<Real>& tables,
                                             std::span<const Vec3d> x, std::span<const Vec3d> v,
                                             const SubstepContext& context);

  /// Of the last force(); empty without gas.
  [[nodiscard]] std::span<const Vec3d> volume_gradient_m2() const { return forces_.volume_gradient_m2(); }

  [[nodiscard]] std::size_t bytes() const;

 private:
  /// Newton's, in step_.
  struct Correction {
    double slope_j = 0.0;
    double spread_m = 0.0;
    Vec3d whole_m_s = Vec3d::Zero();  // what of it is not to be shortened
  };

  bool find_residual(SoftState<Real>& body, const ImplicitTables<Real>& tables, const ImplicitStage& stage,
                     const SubstepContext& context, std::span<const Vec3d> u);
  bool take_step(SoftState<Real>& body, const ImplicitTables<Real>& tables, const ImplicitStage& stage,
                 const SubstepContext& context, const Correction& correction, std::vector<Vec3d>& u);

  void move_volume(SoftState<Real>& body, const ImplicitStage& stage, const SubstepContext& context) const;

  ImplicitSystem system_;
  BodyForces<Real> forces_;
  std::vector<Vec3d> x_, residual_, step_, trial_;
};

}  // namespace pneuma::physics
