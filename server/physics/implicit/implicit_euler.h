// Implicit (backward) Euler: order 1, stable at any step, damps what it does not resolve.
#pragma once

#include "physics/implicit/implicit_solver.h"

namespace pneuma::physics {

/// Advances body.v and sets body.dr, as solve_step() does. With one Newton iteration it is the linearised method of
/// Baraff and Witkin, "Large Steps in Cloth Simulation" (1998). False, and the body unmoved, where the solve failed.
template <class Real>
[[nodiscard]] bool implicit_euler(SoftState<Real>& body, ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
                                  const Surroundings& surroundings, double dt_s, ImplicitSolver<Real>& solver,
                                  Profile* profile);

}  // namespace pneuma::physics
