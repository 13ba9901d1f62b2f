// What a stream tells of how its bodies move: the mechanics that codec/simulated_motion.h predicts frames by.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "app/frame_source.h"
#include "codec/simulated_motion.h"
#include "physics/world.h"
#include "pneuma/v1/frame.pb.h"

namespace pneuma::app {

/// Of all bodies of a stream together, of codec::simulated_work(): a quarter of what readers take, a millisecond a
/// frame for the server; a ball of 2,562 vertices over a floor at as many substeps as are offered. The mechanics are
/// found on the thread that steps the world, which also takes time in proportion.
inline constexpr std::uint64_t offered_work_max = 1 << 18;

/// Those of a soft body as it is now. Nothing where it is moved by forces that a prediction does not know (bending,
/// wind, gas that flows), is solved for at steps past its own motion, or would take too many substeps or too much work.
/// Takes from terms.work_left what it takes to find them or to simulate them, whichever is more.
[[nodiscard]] std::optional<codec::Mechanics> mechanics_of(const physics::World& world, std::size_t soft_index,
                                                           const codec::MeshOrder& order, MechanicsTerms& terms);

[[nodiscard]] v1::Mechanics to_proto(const codec::Mechanics& mechanics);

}  // namespace pneuma::app
