// The rows of surfaces against each other and themselves.
#pragma once

#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/contact/surface_body.h"

namespace pneuma::physics {

/// Of the kept distance: what comes no nearer than this much beyond it needs no row.
inline constexpr double row_slack_share = 0.5;

/// Appends a row for each pair of features that is within the kept distance, or would be where the substep ends; each
/// once, in the order of the keys, with the bodies' indices for those of their responses. What the solver is to reach
/// is left to the caller. The candidates know how far apart they are at least (FeatureBounds).
void find_surface_rows(std::span<SurfacePair> pairs, std::span<const SurfaceBody> bodies,
                       std::vector<ContactRow>& rows);

}  // namespace pneuma::physics
