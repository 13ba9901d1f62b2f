// Explicit integrators of the particles' motion: step 4 of the paper's algorithm, and its section 3.3.
#pragma once

#include <vector>

#include "physics/forces.h"

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

  [[nodiscard]] std::size_t bytes() const;
};

/// Advances body.v by dt_s and sets body.dr to the move that belongs to it; body.x stays, for contact to cut the move
/// first. Pinned particles keep still.
template <class Real>
void integrate(SoftState<Real>& body, Integrator integrator, const Surroundings& surroundings, double dt_s,
               IntegratorScratch<Real>& scratch, Profile* profile);

}  // namespace pneuma::physics
