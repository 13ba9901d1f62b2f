// XPBD in small substeps: springs, bending and gas as compliant constraints, one symmetric Gauss-Seidel pass a substep.
#pragma once

#include <vector>

#include "physics/forces/forces.h"

namespace pneuma::physics {

/// Room for a step, kept by the caller.
template <class Real>
struct XpbdScratch {
  std::vector<Vec3<Real>> position;
  std::vector<Vec3<Real>> gradient;  // of the volume; also outer forces
  std::vector<Real> spring_pull;     // the multipliers, of the substep so far: h^2 times the force, over the length
  std::vector<double> hinge_turn;
  std::vector<Vec3d> grab_pull;

  [[nodiscard]] std::size_t bytes() const {
    return (position.capacity() + gradient.capacity()) * sizeof(Vec3<Real>) + spring_pull.capacity() * sizeof(Real) +
           hinge_turn.capacity() * sizeof(double) + grab_pull.capacity() * sizeof(Vec3d);
  }
};

/// Advances body.v and sets body.dr, as solve_step() does. Macklin, Mueller and Chentanez, "XPBD" (2016), and Macklin
/// et al., "Small Steps in Physics Simulation" (2019): one pass a substep, there and back, its multipliers begun anew;
/// the springs' damping acts on the velocities after it. The volume at rest is too large by a share that falls with the
/// square of the step (step_choice.cpp). The gas is one constraint whose multiplier meets P(V) exactly at the volume
/// that it makes.
template <class Real>
void xpbd(SoftState<Real>& body, const SubstepContext& context, XpbdScratch<Real>& scratch);

}  // namespace pneuma::physics
