// The messages that the server says, and what requests are called.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "net/server.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// When a client that was refused for want of room, in memory or on the disk, may try again.
inline constexpr double retry_hint_s = 1.0;

[[nodiscard]] v1::Error to_error(const base::Status& status, double retry_after_s = 0.0);

[[nodiscard]] v1::ServerMessage error_reply(std::uint64_t request_id, const base::Status& status,
                                            double retry_after_s = 0.0);
[[nodiscard]] v1::ServerMessage done_reply(std::uint64_t request_id, std::uint64_t tick, const std::string& world,
                                           const std::string& detail = {},
                                           const std::vector<v1::MendedMesh>& mended = {});
[[nodiscard]] v1::ServerMessage event_message(v1::Event::Kind kind, const std::string& world, std::uint64_t tick,
                                              const std::string& body = {}, const std::string& detail = {});

[[nodiscard]] net::SharedBytes serialise(const v1::ServerMessage& message);

// What the session logic of net sends by itself (net::Callbacks).
[[nodiscard]] std::string make_ping(std::uint64_t nonce);
[[nodiscard]] std::string make_goodbye(const base::Status& why);
[[nodiscard]] std::string make_gap(std::uint32_t stream_id, std::uint64_t from_tick, std::uint64_t to_tick);

/// The name of the request's field, "move_grab"; "unknown" where there is none.
[[nodiscard]] std::string_view kind_of(v1::ClientMessage::RequestCase request);
[[nodiscard]] inline std::string_view kind_of(const v1::ClientMessage& request) {
  return kind_of(request.request_case());
}

}  // namespace pneuma::app
