// The longest step of each method, for bodies that move so fast.
#include "physics/choice/longest_step.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pneuma::physics {

namespace {

// The fastest growth of a motion that a method cannot damp (explicit Euler and midpoint grow at any step): in a step
// that we choose, and in one that we are given.
constexpr double chosen_growth_max_1_s = 0.01;
constexpr double given_growth_max_1_s = 1.0;

// XPBD with one pass a substep rests at a volume too large by this times (w h)^2, w the gas's frequency, whatever the
// springs: measured on a ball of 162 vertices, 1 kg, nRT = 100 J and 1e5 J, k from 1e3 to 1e9 N/m, 4 to 160 substeps.
constexpr double xpbd_rest_error = 3.0;
// Of other loads the error is not known beforehand; small steps are what makes one pass enough.
constexpr double xpbd_substeps_min = 20.0;

// The step at which symplectic Euler grows out of bounds: (wh)^2 + 2 c h = 4.
double symplectic_limit_s(double w, double c) {
  return 4.0 / (c + std::sqrt(c * c + 4.0 * w * w));
}

// The step at which one motion (frequency w, decay c) stops being damped. From each method's amplification factor:
double longest_stable_step_s(Integrator integrator, double w, double c) {
  if (!is_explicit(integrator)) return unlimited;
  const double by_decay = c > 0.0 ? 1.0 / c : unlimited;  // half of what the real axis allows (2/c)
  if (!(w > 0.0)) return by_decay;
  switch (integrator) {
    case Integrator::explicit_euler:  // |1 + iwh|: grows at w^2 h / 2, damping takes c / 2
      return std::min(by_decay, (c + 2.0 * chosen_growth_max_1_s) / (w * w));
    case Integrator::midpoint:  // grows at w (wh)^3 / 8
      return std::min({by_decay, 0.5 / w, std::cbrt(8.0 * (0.5 * c + chosen_growth_max_1_s) / w) / w});
    case Integrator::rk4:
      return std::min(by_decay, 2.0 / w);  // limit 2.83 / w
    case Integrator::symplectic_euler:
      return std::min(by_decay, 1.0 / w);  // limit 2 / w
    default:
      return unlimited;
  }
}

// Some methods grow but for the decay.
double least_decay_1_s(const Frequencies& frequencies) {
  return frequencies.fastest_decay_1_s - frequencies.decay_lacking_1_s;
}

// A body that beats to some times its volume and back feeds its fastest motions at long steps, and tears. A decay of a
// hundredth of their frequency is enough to keep them down.
bool is_damped(const Frequencies& frequencies) {
  constexpr double damped_share = 0.01;
  return least_decay_1_s(frequencies) >= damped_share * frequencies.fastest_rad_s;
}

// The step at which the fastest motion stops being damped, whatever the body's shape. A gas that is pressed to half its
// volume and a hinge whose faces are crushed have four times their stiffness, which the margins are for. Springs that
// are damped need none: how stiff any shape makes them is known.
double longest_fastest_step_s(Integrator integrator, const Frequencies& frequencies) {
  // Of the limit: at it, a narrow plate of 50 kg went through the ball of 1 kg that it had been thrown on.
  constexpr double limit_share = 0.85;
  const double w = frequencies.fastest_rad_s;
  const double c = frequencies.fastest_decay_1_s;
  const double step_s = std::min(longest_stable_step_s(integrator, w, c),
                                 longest_stable_step_s(integrator, w, least_decay_1_s(frequencies)));
  if (integrator != Integrator::symplectic_euler || !is_damped(frequencies)) return step_s;
  const double stiffest_rad_s =
      std::hypot(frequencies.stretched_rad_s, 2.0 * frequencies.gas_rad_s, 2.0 * frequencies.bending_rad_s);
  const double by_decay_s = longest_stable_step_s(integrator, 0.0, c);
  return std::max(step_s, std::min(by_decay_s, limit_share * symplectic_limit_s(stiffest_rad_s, c)));
}

// The step at which XPBD leaves a gas that much too large a volume.
double xpbd_rest_step_s(const Frequencies& frequencies, double error) {
  return frequencies.gas_rad_s > 0.0 ? std::sqrt(error / xpbd_rest_error) / frequencies.gas_rad_s : unlimited;
}

// The step at which a period of frequency w is off by `error`, from the leading term of each method's phase or
// amplitude error.
double period_step_s(Integrator integrator, double w, double error) {
  constexpr double turn = 2.0 * std::numbers::pi;
  if (!(w > 0.0)) return unlimited;
  switch (integrator) {
    case Integrator::explicit_euler:
    case Integrator::implicit_euler:  // |1 / (1 - iwh)|: shrinks by (wh)^2 / 2 a step
    case Integrator::xpbd:
      return 2.0 * error / turn / w;
    case Integrator::midpoint:
      return std::sqrt(6.0 * error / turn) / w;
    case Integrator::rk4:
      return std::sqrt(std::sqrt(120.0 * error / turn)) / w;
    case Integrator::symplectic_euler:
      return std::sqrt(24.0 * error / turn) / w;
    case Integrator::tr_bdf2: {  // error constant (3 g^2 - 4 g + 2) / (12 (2 - g)) at g = 2 - sqrt(2)
      constexpr double error_constant = 0.0404;
      return std::sqrt(error / (turn * error_constant)) / w;
    }
    case Integrator::automatic:
      break;
  }
  return unlimited;
}

// The step at which the breathing's period is off by `error`. Of one that is not seen the explicit methods have to keep
// the energy. Symplectic Euler's swings within the period by half of wh: a ball of 0.6 kg gained 0.08 J at wh = 0.6
// and none at 0.4, which is the step of four times the error.
double longest_accurate_step_s(Integrator integrator, const Frequencies& frequencies, double error,
                               double tick_period_s) {
  constexpr double unseen_errors = 4.0;
  const double w = frequencies.breathing_rad_s;
  const bool is_seen = w * tick_period_s < std::numbers::pi;
  double to_breathe_s = period_step_s(integrator, w, error);
  if (!is_seen && !is_explicit(integrator)) to_breathe_s = unlimited;
  if (!is_seen && integrator == Integrator::symplectic_euler && is_damped(frequencies))
    to_breathe_s = period_step_s(integrator, w, unseen_errors * error);
  if (integrator != Integrator::xpbd) return to_breathe_s;
  return std::min({to_breathe_s, tick_period_s / xpbd_substeps_min, xpbd_rest_step_s(frequencies, error)});
}

}  // namespace

double limit_of_one_s(Integrator integrator, double rad_s, double decay_1_s) {
  const double w = rad_s;
  const double c = decay_1_s;
  if (!is_explicit(integrator)) return unlimited;
  const double by_decay = c > 0.0 ? 2.0 / c : unlimited;
  if (!(w > 0.0)) return by_decay;
  switch (integrator) {
    case Integrator::explicit_euler:
      return std::min(by_decay, (c + 2.0 * given_growth_max_1_s) / (w * w));
    case Integrator::midpoint:
      return std::min(by_decay, std::cbrt(8.0 * (0.5 * c + given_growth_max_1_s) / w) / w);
    case Integrator::rk4:
      return std::min(1.39 * by_decay, 2.0 * std::numbers::sqrt2 / w);
    case Integrator::symplectic_euler:
      return symplectic_limit_s(w, c);
    default:
      return unlimited;
  }
}

double stability_limit_s(Integrator integrator, const Frequencies& frequencies) {
  return std::min({limit_of_one_s(integrator, frequencies.fastest_rad_s, frequencies.fastest_decay_1_s),
                   limit_of_one_s(integrator, frequencies.fastest_rad_s, least_decay_1_s(frequencies)),
                   limit_of_one_s(integrator, frequencies.breathing_rad_s, frequencies.breathing_decay_1_s),
                   limit_of_one_s(integrator, frequencies.bending_rad_s, 0.0)});
}

double longest_step_s(Integrator integrator, const Frequencies& frequencies, double error_target,
                      double tick_period_s) {
  return std::min({longest_fastest_step_s(integrator, frequencies),
                   longest_stable_step_s(integrator, frequencies.breathing_rad_s, frequencies.breathing_decay_1_s),
                   longest_stable_step_s(integrator, frequencies.bending_rad_s, 0.0),
                   longest_accurate_step_s(integrator, frequencies, error_target, tick_period_s)});
}

double longest_gas_step_s(Integrator integrator, double gas_rad_s) {
  const bool holds = is_explicit(integrator) && integrator != Integrator::explicit_euler;
  return holds ? longest_stable_step_s(integrator, gas_rad_s, 0.0) : unlimited;
}

double given_limit_s(Integrator integrator, const Frequencies& frequencies) {
  return integrator == Integrator::xpbd ? xpbd_rest_step_s(frequencies, xpbd_given_rest_error_max)
                                        : stability_limit_s(integrator, frequencies);
}

}  // namespace pneuma::physics
