// Events as `pneuma` prints them.
#pragma once

#include <string>

#include "command/json.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::client {

/// "BODY_BURST five-balls ball-1 at tick 512: detail"
[[nodiscard]] std::string event_text(const v1::Event& event);
[[nodiscard]] JsonObject event_json(const v1::Event& event);

}  // namespace pneuma::client
