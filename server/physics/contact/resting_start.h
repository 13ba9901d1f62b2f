// Where the passes of a coupled step (coupled_step.h) begin for a body that rests on another.
#pragma once

#include <cstdint>
#include <vector>

#include "physics/contact/coupled_passes.h"

namespace pneuma::physics {

/// Sets a flag for each soft body that rests on another as the step begins. Call once the first rows are found.
void list_resting(const CoupledPasses& passes, double dt_s, std::vector<std::uint8_t>& rests);

/// For a body that is awake and rests: begins from where its velocities take it, where its free step, in `body.u`,
/// would bend it by more than that of a skin that has lost its load.
template <class Real>
void choose_start(const SoftState<Real>& state, double spacing_m, double dt_s, CoupledBody& body);

}  // namespace pneuma::physics
