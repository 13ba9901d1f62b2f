// What one step of an integrator does to the energy of an undamped oscillator.
#pragma once

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// |R(i wh)|^2, w the frequency and h the step; NaN of XPBD, of which no such factor is known. Symplectic Euler keeps
/// an energy of its own up to wh = 2.
inline double energy_growth(Integrator integrator, double wh) {
  using Complex = std::complex<double>;
  switch (integrator) {
    case Integrator::explicit_euler:
      return 1.0 + wh * wh;
    case Integrator::midpoint:
      return 1.0 + std::pow(wh, 4) / 4.0;
    case Integrator::rk4:
      return std::norm(Complex(1.0 - std::pow(wh, 2) / 2.0 + std::pow(wh, 4) / 24.0, wh - std::pow(wh, 3) / 6.0));
    case Integrator::symplectic_euler:
      return wh <= 2.0 ? 1.0 : std::pow(wh / 2.0 + std::sqrt(wh * wh / 4.0 - 1.0), 4);
    case Integrator::implicit_euler:
      return 1.0 / (1.0 + wh * wh);
    case Integrator::tr_bdf2: {  // a trapezoidal step of part = 2 - sqrt(2), then BDF2 to the end
      const double part = 2.0 - std::numbers::sqrt2;
      const Complex half(0.0, 0.5 * part * wh);
      const Complex middle = (1.0 + half) / (1.0 - half);
      const double late = 1.0 / (part * (2.0 - part));
      return std::norm((late * middle - (late - 1.0)) / (1.0 - half));
    }
    case Integrator::xpbd:
    case Integrator::automatic:
      break;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace pneuma::physics
