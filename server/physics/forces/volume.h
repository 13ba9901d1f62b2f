// A body's volume, by its own method.
#pragma once

#include <span>

#include "physics/state/state.h"

namespace pneuma::physics {

/// At positions `x`. That of a body that is not flat is greater than 0 by every method, but for one turned inside out:
/// by those that follow the skin it is not (gas.h takes it from there).
template <class Real>
[[nodiscard]] double body_volume_m3(const SoftBody& body, std::span<const Vec3<Real>> x);

}  // namespace pneuma::physics
