// XPBD in small substeps: forces as compliant constraints, one symmetric Gauss-Seidel pass a substep.
#pragma once

#include <vector>

#include "physics/forces/xpbd_terms.h"

namespace pneuma::physics {

/// Room for a step, kept by the caller.
template <class Real>
struct XpbdScratch {
  XpbdTerms<Real> terms;
  std::vector<Real> inverse_masses_1_kg;

  [[nodiscard]] std::size_t bytes() const { return terms.bytes() + inverse_masses_1_kg.capacity() * sizeof(Real); }
};

/// Advances body.v and sets body.dr, as solve_step() does. Macklin, Mueller and Chentanez, "XPBD" (2016), and Macklin
/// et al., "Small Steps in Physics Simulation" (2019): one pass a substep, there and back, its multipliers begun anew;
/// the springs' damping acts on the velocities after it. The volume at rest is too large by a share that falls with the
/// square of the step (step_choice.cpp).
template <class Real>
void xpbd(SoftState<Real>& body, const SubstepContext& context, XpbdScratch<Real>& scratch);

}  // namespace pneuma::physics
