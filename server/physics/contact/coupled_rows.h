// The rows of a pass of a coupled step: surfaces, solids and joints, at the place that the pass has reached.
#pragma once

#include "physics/contact/coupled_passes.h"
#include "physics/contact/surface_contacts.h"

namespace pneuma::physics {

/// Finds passes.rows anew.
template <class Real>
void find_coupled_rows(const CoupledWorld<Real>& world, SurfaceContacts<Real>& surfaces, CoupledPasses& passes);

}  // namespace pneuma::physics
