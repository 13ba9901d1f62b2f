// TR-BDF2: the trapezoidal rule over part of the step, then the second backward difference formula. Order 2, stable at
// any step, and it damps what it does not resolve.
#pragma once

#include "physics/implicit/implicit_solver.h"

namespace pneuma::physics {

/// Advances body.v and sets body.dr, as solve_step() does. The part is 2 - sqrt(2), for which both stages have the same
/// matrix (Bank et al., "Transient Simulation of Silicon Devices and Circuits", 1985; Hosea and Shampine, "Analysis and
/// Implementation of TR-BDF2", 1996). A step
/// that would throw the body about is taken by implicit Euler instead. False, and the body unmoved, where a solve
/// failed.
template <class Real>
[[nodiscard]] bool tr_bdf2(SoftState<Real>& body, ImplicitTables<Real>& tables, const StageAccuracy& accuracy,
                           const SubstepContext& context, ImplicitSolver<Real>& solver);

}  // namespace pneuma::physics
