// Questions about where surfaces and bodies are, as the wire asks them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/status.h"
#include "physics/world.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Each answers without `world` and `tick`. Errors name the field from the request's kind on.
[[nodiscard]] base::Result<v1::SurfacePoints> cast_rays(const physics::World& world, const v1::Raycast& request);
[[nodiscard]] base::Result<v1::SurfacePoints> find_nearest(const physics::World& world,
                                                           const v1::NearestPoint& request);
[[nodiscard]] base::Result<v1::BodyBoxes> find_bodies(const physics::World& world, const v1::BodiesInBox& request);

/// The reply to GetState and to those above, of a world that is called `name` and has done `tick` ticks; nothing of
/// other requests.
[[nodiscard]] std::optional<base::Result<v1::ServerMessage>> answer_question(const physics::World& world,
                                                                             const v1::ClientMessage& request,
                                                                             const std::string& name,
                                                                             std::uint64_t tick);

}  // namespace pneuma::app
