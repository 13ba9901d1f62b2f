// The kinds of requests: which role each asks for, and which world it names. One table.
#pragma once

#include <string>

#include "app/grant.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// The least role that may ask it; admin for what is in no table.
[[nodiscard]] Role role_for(v1::ClientMessage::RequestCase request);

/// Whether it asks for the places of a world's bodies: what may take a long time, and changes nothing.
[[nodiscard]] bool looks_at_bodies(v1::ClientMessage::RequestCase request);

/// The world that the request names; null for requests that name none.
[[nodiscard]] const std::string* world_of(const v1::ClientMessage& request);

/// Where the role is not enough for such a request. Needs no more than its kind.
[[nodiscard]] Denial check_role(const Grant& grant, v1::ClientMessage::RequestCase request);
/// The same, and where the grant is not for the world that the request names. Whether there is such a world does not
/// show. The name of a new world is checked where it is settled.
[[nodiscard]] Denial check_permission(const Grant& grant, const v1::ClientMessage& request);

}  // namespace pneuma::app
