// How far a body's vertices reach, many numbers at a time.
#pragma once

#include "physics/state/extents.h"
#include "physics/state/state.h"

namespace pneuma::physics {

template <class Real>
[[nodiscard]] Extents<Real> extents_of(const SoftState<Real>& body);

}  // namespace pneuma::physics
