// No move crosses a surface: what would is cut short, vertex by vertex.
#pragma once

#include <span>
#include <vector>

#include "physics/contact/surface_body.h"

namespace pneuma::physics {

/// Lowers the bodies' `cuts`, from those that they have, so that no two features of the pairs come nearer than a share
/// of the distance that they keep, or of the one that they have. A vertex takes the smallest cut of all its pairs,
/// which depends on no order. Of free vertices only what they move by among themselves is cut: those that stop each
/// other are taken along by their mean move, `drifts`, unless one of them is not free. The pairs' candidates are of
/// these moves, and know how far apart they are.
/// Returns the features that would have come nearer, in no order, and some of them twice.
std::vector<FeatureCorners> cut_moves(std::span<const SurfacePair> pairs, std::span<SurfaceBody> bodies);

}  // namespace pneuma::physics
