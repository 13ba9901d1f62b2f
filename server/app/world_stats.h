// What a world's physics has to tell, as the wire says it.
#pragma once

#include <cstddef>

#include "physics/world.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Fills what the world itself knows: hash, time, stepping, stages and bodies.
void describe(const physics::World& world, v1::Stats& out);
/// Of a soft body, and of a rigid one.
void describe(const physics::World& world, std::size_t soft_index, v1::Stats::Body& body);
void describe(const physics::RigidState& state, v1::Stats::Rigid& body);

}  // namespace pneuma::app
