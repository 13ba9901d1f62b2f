// What cuts (filter.h) do to the energy of soft bodies.
#pragma once

#include <cstdint>
#include <span>

#include "physics/contact/surface_body.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What the body's springs and hinges hold with its cuts, over what they hold without (J). `missed_m`: one a vertex,
/// from where it ends to where it would.
template <class Real>
[[nodiscard]] double stretched_by_cuts_j(const SoftState<Real>& state, const SurfaceBody& body,
                                         std::span<const Vec3d> missed_m);

/// What the bodies' vertices move by among themselves (J).
template <class Real>
[[nodiscard]] double kinetic_among_j(std::span<const SoftState<Real>> soft, std::span<const std::uint32_t> bodies);

}  // namespace pneuma::physics
