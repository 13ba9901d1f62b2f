// The linear ball run through the engine: how its small motions grow or fade.
#pragma once

#include "numerics/report/linear_ball.h"

namespace pneuma::report {

struct SmallRun {
  physics::Integrator integrator = physics::Integrator::rk4;
  double stiffness_n_m = 0.0;
  double damping_n_s_m = 0.0;
  double step_s = 0.0;
};

/// The longest and the shortest step that a world can be given here: 1 Hz, and 1,000 Hz by 4,096 substeps.
inline constexpr double step_max_s = 1.0;
inline constexpr double step_min_s = 1e-3 / 4096.0;

/// The rate at which the ball's motion grows (its amplitude, e-fold; negative where it fades) once displaced along
/// `direction`: half of that of the largest energy in the last quarter of duration_s over that in the first. Infinite
/// where the motion left what is small.
[[nodiscard]] double growth_1_s(const LinearBall& ball, const SmallRun& run, const Eigen::VectorXd& direction,
                                double duration_s);

inline constexpr double breathing_periods = 3.0;
/// The share of its energy that the ball's breathing has left after breathing_periods, at the first step past them, or
/// up to a millisecond later where steps are shorter than that.
[[nodiscard]] double breathing_left(const LinearBall& ball, const SmallRun& run);

/// Every motion at once: a displacement without pattern.
[[nodiscard]] Eigen::VectorXd every_motion(const LinearBall& ball);

}  // namespace pneuma::report
