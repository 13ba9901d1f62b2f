// No move crosses a surface: what would is cut short, vertex by vertex.
#pragma once

#include <span>

#include "physics/contact/surface_body.h"

namespace pneuma::physics {

/// Lowers the bodies' `cuts`, from those that they have, so that no two features of the pairs come nearer than a share
/// of the distance that they keep, or of the one that they have. A vertex takes the smallest cut of all its pairs,
/// which depends on no order. The pairs' candidates are of these moves, and know how far apart they are.
void cut_moves(std::span<const SurfacePair> pairs, std::span<SurfaceBody> bodies);

}  // namespace pneuma::physics
