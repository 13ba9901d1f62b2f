#include "numerics/report/methods.h"

namespace pneuma::report {

using physics::Integrator;

std::string title_of(Integrator integrator) {
  switch (integrator) {
    case Integrator::explicit_euler:
      return "explicit Euler";
    case Integrator::midpoint:
      return "midpoint";
    case Integrator::rk4:
      return "RK4";
    case Integrator::symplectic_euler:
      return "symplectic Euler";
    case Integrator::implicit_euler:
      return "implicit Euler";
    case Integrator::tr_bdf2:
      return "TR-BDF2";
    case Integrator::xpbd:
      return "XPBD";
    case Integrator::automatic:
      return "AUTO";
  }
  return "";
}

int style_of(Integrator integrator) {
  switch (integrator) {
    case Integrator::symplectic_euler:
      return 1;
    case Integrator::implicit_euler:
      return 2;
    case Integrator::rk4:
      return 3;
    case Integrator::tr_bdf2:
      return 4;
    case Integrator::explicit_euler:
      return 5;
    case Integrator::midpoint:
      return 6;
    case Integrator::xpbd:
      return 7;
    case Integrator::automatic:
      return 0;
  }
  return 0;
}

}  // namespace pneuma::report
