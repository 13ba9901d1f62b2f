// What a world's physics has to tell, as the wire says it.
#pragma once

#include "physics/world.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Fills what the world itself knows: hash, time, stepping, stages and bodies.
void describe(const physics::World& world, v1::Stats& out);

}  // namespace pneuma::app
