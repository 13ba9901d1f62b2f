// The integrators as the report shows them: names, styles, and how a scene is set up for each.
#pragma once

#include <array>
#include <string>

#include "physics/scene/scene.h"

namespace pneuma::report {

inline constexpr std::array<physics::Integrator, 7> every_integrator{physics::Integrator::explicit_euler,
                                                                     physics::Integrator::midpoint,
                                                                     physics::Integrator::rk4,
                                                                     physics::Integrator::symplectic_euler,
                                                                     physics::Integrator::implicit_euler,
                                                                     physics::Integrator::tr_bdf2,
                                                                     physics::Integrator::xpbd};

/// "implicit Euler".
[[nodiscard]] std::string title_of(physics::Integrator integrator);
/// Its style in every plot.
[[nodiscard]] int style_of(physics::Integrator integrator);

}  // namespace pneuma::report
