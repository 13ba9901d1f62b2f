// Integrators of the particles' motion: step 4 of the paper's algorithm, and its section 3.3. The explicit ones are
// here; the others have files of their own.
#pragma once

#include <optional>
#include <vector>

#include "physics/forces.h"
#include "physics/implicit_solver.h"
#include "physics/xpbd.h"

namespace pneuma::physics {

/// Room for an integrator's intermediate states; kept by the caller between substeps. Holds only what the integrator
/// needs.
template <class Real>
struct IntegratorScratch {
  std::vector<Vec3<Real>> force;
  std::vector<Vec3<Real>> x_stage;
  std::vector<Vec3<Real>> v_stage;
  std::vector<Vec3<Real>> x_slope_sum;  // RK4 only
  std::vector<Vec3<Real>> v_slope_sum;
  std::optional<ImplicitSolver<Real>> implicit;  // implicit Euler and TR-BDF2 only
  XpbdScratch<Real> xpbd;

  [[nodiscard]] std::size_t bytes() const;
};

/// How a world's bodies are stepped. `integrator` is none that is yet to be chosen.
struct Method {
  Integrator integrator = Integrator::midpoint;
  StageAccuracy accuracy;
};

/// Advances body.v by dt_s and sets body.dr to the move that belongs to it; body.x stays, for contact to cut the move
/// first. Pinned particles keep still. Where an
/// implicit solve fails, the body says so in solve_failed.
template <class Real>
void integrate(SoftState<Real>& body, const Method& method, const Surroundings& surroundings, double dt_s,
               IntegratorScratch<Real>& scratch, Profile* profile);

}  // namespace pneuma::physics
