// Restitution of a coupled step. What a body as a whole came with, and was stopped of within this substep, goes back by
// its restitution. Where springs take longer to stop it, they give it back themselves, as do those of a body that is
// held elsewhere.
#pragma once

#include "physics/contact/coupled_passes.h"

namespace pneuma::physics {

/// Changes u of the bodies and the velocities of the rigid ones, after the passes.
template <class Real>
void rebound(const CoupledWorld<Real>& world, CoupledPasses& passes);

}  // namespace pneuma::physics
