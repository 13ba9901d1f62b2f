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
                           const StageAccuracy& accuracy, const Surroundings& surroundings, std::vector<Vec3d>& u,
                           Profile* profile);

  /// Whether a solve since the last forget_turns() turned edges so far that its linear systems may have added energy.
  [[nodiscard]] bool has_turned() const { return has_turned_; }
  void forget_turns() { has_turned_ = false; }

  /// One Newton step from `u` that gives held vertices the velocities they are held to. False where it is not finite.
  [[nodiscard]] bool correct_held(SoftState<Real>& body, ImplicitTables<Real>& tables, const ImplicitStage& stage,
                                  std::span<const Hold> holds, const StageAccuracy& accuracy,
                                  const Surroundings& surroundings, std::vector<Vec3d>& u, Profile* profile);
  /// The impulse, N s, by which correct_held() held a vertex; in held directions.
  [[nodiscard]] Vec3d holding_n_s(std::uint32_t vertex) const { return -system_.residual_n_s()[vertex]; }

  /// By how much correct_held() moved any vertex as seen from the body.
  [[nodiscard]] double last_move_m() const { return last_move_m_; }

  /// f(x, v), N; zero on pinned particles. Until the next call of either.
  [[nodiscard]] std::span<const Vec3d> force(SoftState<Real>& body, const ImplicitTables<Real>& tables,
                                             std::span<const Vec3d> x, std::span<const Vec3d> v,
                                             const Surroundings& surroundings, Profile* profile);

  [[nodiscard]] std::size_t bytes() const;

 private:
  bool find_residual(SoftState<Real>& body, const ImplicitTables<Real>& tables, const ImplicitStage& stage,
                     const Surroundings& surroundings, std::span<const Vec3d> u, Profile* profile);
  bool take_step(SoftState<Real>& body, const ImplicitTables<Real>& tables, const ImplicitStage& stage,
                 const Surroundings& surroundings, double slope, double spread_m, const Vec3d& whole,
                 std::vector<Vec3d>& u, Profile* profile);

  void move_volume(SoftState<Real>& body, const ImplicitStage& stage, const Surroundings& surroundings) const;

  ImplicitSystem system_;
  BodyForces<Real> forces_;
  std::vector<Vec3d> x_, residual_, step_, trial_;
  double last_move_m_ = 0.0;
  bool has_turned_ = false;
};

}  // namespace pneuma::physics
