// Where a body's single-precision positions are seen from: a place of its own near it, so that they keep their digits
// anywhere in the world. In double precision it is the world's origin, always.
#pragma once

#include "physics/state/state.h"

namespace pneuma::physics {

/// The nearest place to `centre_m` on a lattice of the body's own: its edge is the power of two at or above length_m.
[[nodiscard]] Vec3d origin_near(const Vec3d& centre_m, double length_m);

/// Between two ticks: moves the origin of a body that has gone more than a few of its lengths from it, by steps of the
/// lattice. No vertex moves by a bit for it: an axis on which the body has come to be as long as it is far off waits.
/// Nothing in double precision.
template <class Real>
void recentre(SoftState<Real>& body);

}  // namespace pneuma::physics
