// What a stream tells of how its bodies move: the mechanics that codec/simulated_motion.h predicts frames by.
#pragma once

#include <cstddef>
#include <optional>

#include "codec/simulated_motion.h"
#include "physics/world.h"
#include "pneuma/v1/frame.pb.h"

namespace pneuma::app {

/// Those of a soft body, for frames that are frame_s apart. Nothing where it is moved by forces that a prediction does
/// not know (bending, wind, gas that flows), is solved for at steps past its own motion, or would take too many
/// substeps.
[[nodiscard]] std::optional<codec::Mechanics> mechanics_of(const physics::World& world, std::size_t soft_index,
                                                           const codec::MeshOrder& order, double frame_s);

[[nodiscard]] v1::Mechanics to_proto(const codec::Mechanics& mechanics);

}  // namespace pneuma::app
