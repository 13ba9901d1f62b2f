// How long a step of each method may be, from how fast a body moves.
#pragma once

#include <limits>

#include "physics/choice/stability.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// A step that nothing limits.
inline constexpr double unlimited = std::numeric_limits<double>::infinity();

/// By XPBD a given step may leave a volume that much too large; past that it is wrong, and no mere error.
inline constexpr double xpbd_given_rest_error_max = 0.05;

/// The step at which one motion of this frequency and decay grows out of bounds.
[[nodiscard]] double limit_of_one_s(Integrator integrator, double rad_s, double decay_1_s);

/// Past this step the motion grows out of bounds: no margin, except that explicit Euler and midpoint, which grow at any
/// step without damping, may grow e-fold in a second. Infinite for the implicit methods and XPBD.
[[nodiscard]] double stability_limit_s(Integrator integrator, const Frequencies& frequencies);

/// The longest step that keeps a motion of these frequencies from growing, with a margin (see the source for each
/// method's condition), and the breathing motion within error_target a period. Breathing that takes less than two ticks
/// is not seen at all: of it the implicit methods and XPBD keep the mean alone, and symplectic Euler is four times as
/// far off where springs are damped.
[[nodiscard]] double longest_step_s(Integrator integrator, const Frequencies& frequencies, double error_target,
                                    double tick_period_s);

/// The longest step of an explicit method that holds a gas of this frequency; infinite for explicit Euler, which holds
/// none without damping, and for those that solve.
[[nodiscard]] double longest_gas_step_s(Integrator integrator, double gas_rad_s);

/// Past this a given step is not to be taken unasked: stability_limit_s, or by XPBD where a gas rests at too large a
/// volume.
[[nodiscard]] double given_limit_s(Integrator integrator, const Frequencies& frequencies);

}  // namespace pneuma::physics
