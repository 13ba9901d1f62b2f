// What a layout tells of how a body moves, as the codec takes it.
#pragma once

#include "base/status.h"
#include "codec/simulated_motion.h"
#include "pneuma/v1/frame.pb.h"

namespace pneuma::client {

/// Checked for the mesh that the order was made of, and the stream's grid. Errors name the field.
[[nodiscard]] base::Result<codec::Mechanics> mechanics_of(const v1::Mechanics& message, const codec::MeshOrder& order,
                                                          double grid_step_m);

}  // namespace pneuma::client
