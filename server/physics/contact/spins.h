// The angular momentum of soft bodies in contact.
#pragma once

#include "physics/contact/coupled_passes.h"

namespace pneuma::physics {

/// Turns each free body of a coupled step, as a whole and by its velocities alone, until its angular momentum is that
/// of the substep's start and of the rows' impulses. A row acts on both of its bodies at one place, so that what bodies
/// have together stays as it was, to round-off of where they are.
template <class Real>
void keep_spins(const CoupledWorld<Real>& world, CoupledPasses& passes);

}  // namespace pneuma::physics
