// The volume inside a closed skin by sampling its bounding box: the two methods that the paper leaves to future work
// (section 5). Along each of a set of lines parallel to z, a face that looks up adds the height at which it is met and
// one that looks down takes it off: what is left is how much of the line is inside, each point counted as often as the
// skin goes round it, as the exact volume counts it.
//
// Faces are scan-converted row by row, so the time goes with the faces and with the lines that each covers. No memory
// is used. A line through an edge or a vertex meets one of the faces there, whichever way they look: the two faces at
// an edge compute where it crosses a row from the same numbers, and half-open intervals share out what lies between.
// Both are 0 where that takes more than base::volume_crossings_max crossings: of a skin in very many layers.
#pragma once

#include <cstdint>
#include <span>

#include "physics/mesh/mesh.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// The box cut into resolution^3 cells; a cell counts as far as its middle line along z is inside. Of the cells in one
/// column only the sum is needed, which is the length of the line inside.
template <class Real>
[[nodiscard]] double subdivided_volume_m3(std::span<const Vec3<Real>> x, std::span<const Face> faces,
                                          std::uint32_t resolution);

/// `samples` points of the box, a point counts where it is inside. They are stratified: one in each cell of a grid in
/// x and y, at a place that a hash of its number gives, and at heights of a sequence of low discrepancy. They move and
/// stretch with the box, and are the same on every machine.
template <class Real>
[[nodiscard]] double monte_carlo_volume_m3(std::span<const Vec3<Real>> x, std::span<const Face> faces,
                                           std::uint32_t samples);

}  // namespace pneuma::physics
