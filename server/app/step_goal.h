// What a StepUntil waits for.
#pragma once

#include "base/status.h"
#include "physics/world.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Refuses a goal that is none, or that names what the world has not. Errors name the field from `step_until` on.
[[nodiscard]] base::Status check_goal(const physics::World& world, const v1::StepUntil& request);

/// Whether it is so, after `tick` ticks. A contact is known only of a world that notes them. What names a body that is
/// gone is never so.
[[nodiscard]] bool is_reached(const physics::World& world, std::uint64_t tick, const v1::StepUntil& request);

}  // namespace pneuma::app
