// Bodies that run away: motion that is no longer finite, or past the limits of speed, place or size.
#pragma once

#include "physics/state/extents.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// Whether every particle's place, move and velocity are within what freezes a body (base/limits.h). `extents` are the
/// body's.
template <class Real>
[[nodiscard]] bool is_well(const SoftState<Real>& body, const Extents<Real>& extents);

/// Stops a body that has run away, or whose solve failed, where it was last well. Returns what happened, in words.
template <class Real>
[[nodiscard]] const char* freeze(SoftState<Real>& body);

/// The same of a rigid body, which was last well at `position` and `orientation`.
[[nodiscard]] const char* freeze(RigidState& body, const Vec3d& position, const Quatd& orientation);

}  // namespace pneuma::physics
