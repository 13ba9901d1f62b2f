// Where everything is at one tick, as the wire says it, and back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "base/status.h"
#include "physics/world.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// What positions and velocities take of a State.
[[nodiscard]] std::size_t observed_bytes(const physics::World& world, const v1::Observe& asked);
/// Refuses bodies that the world has not, and more than a reply holds. Errors name the field within Observe.
[[nodiscard]] base::Status check_observed(const physics::World& world, const v1::Observe& asked);
/// Of a world that is called `name` and has done `tick` ticks. Bodies that it has not are left out.
[[nodiscard]] v1::State state_of(const physics::World& world, const v1::Observe& asked, const std::string& name,
                                 std::uint64_t tick);

/// Puts bodies where the request says. Errors name the field from `set_state` on, and nothing has changed then.
[[nodiscard]] base::Status set_state(physics::World& world, const v1::SetState& request);

}  // namespace pneuma::app
