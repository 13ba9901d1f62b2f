// Requests and replies as JSON.
#pragma once

#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::c {

/// By protobuf's JSON mapping. Refuses what is no request.
[[nodiscard]] base::Result<v1::ClientMessage> parse_request(const char* json);

/// Puts the reply, without its request_id, in a text that pneuma_text_free takes; `text` may be null. Of an Error, its
/// status.
[[nodiscard]] base::Status tell_reply(v1::ServerMessage reply, char** text);

}  // namespace pneuma::c
