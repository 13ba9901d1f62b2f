// The room that surfaces keep between each other.
#pragma once

#include <cmath>

#include "physics/state/state.h"

namespace pneuma::physics {

/// Of a body's mean spacing of vertices: the room that its surface keeps beyond its thickness. Wide enough that what
/// single precision rounds off a place does not close it, and narrow enough not to be seen.
inline constexpr double shell_share = 0.02;

template <class Real>
[[nodiscard]] double spacing_m(const SoftState<Real>& body) {
  return static_cast<double>(body.length_m) / std::sqrt(static_cast<double>(body.x.size()));
}

/// What a soft body keeps free around its surface; two that meet keep the sum of theirs.
template <class Real>
[[nodiscard]] double shell_m(const SoftState<Real>& body) {
  return body.body.surface.thickness_m + shell_share * spacing_m(body);
}

}  // namespace pneuma::physics
