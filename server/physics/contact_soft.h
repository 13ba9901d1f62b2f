// Soft bodies against each other's bounding volumes: the paper's way (section 3.5).
#pragma once

#include "physics/contact_bounds.h"

namespace pneuma::physics {

/// Stops the vertices of pair.a at the bounds of pair.b, and sums in the pair what b gets in return; b itself is not
/// touched. A vertex and the free vertices of the other body share each change by their masses, so that momentum, and
/// the common centre of mass, are kept to round-off.
template <class Real>
void meet_bounds(SoftState<Real>& a, const BodyBounds& bounds_a, const SoftState<Real>& b, const BodyBounds& bounds_b,
                 double resting_m_s, double dt_s, SoftPair& pair);

/// Gives a body its sum of reactions, spread evenly over its free vertices.
template <class Real>
void take_reactions(SoftState<Real>& body, BodyBounds& bounds);

}  // namespace pneuma::physics
