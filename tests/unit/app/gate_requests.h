// What tests say to the gate of a session, and when.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "app/session_gate.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

inline const SessionGate::TimePoint start = SessionGate::TimePoint() + std::chrono::hours(1);

inline std::string list_worlds(std::uint64_t request_id) {
  v1::ClientMessage message;
  message.set_request_id(request_id);
  message.mutable_list_worlds();
  return message.SerializeAsString();
}

}  // namespace pneuma::app
