// What tests say to the gate of a session, and when.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>

#include "app/session_gate.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

inline const SessionGate::TimePoint start = SessionGate::TimePoint() + std::chrono::hours(1);

/// Another one each time, that asks for no token.
inline Gatekeeper& open_house(const base::Limits& limits = {}) {
  static std::deque<Gatekeeper> houses;
  return houses.emplace_back(limits);
}

inline std::string list_worlds(std::uint64_t request_id) {
  v1::ClientMessage message;
  message.set_request_id(request_id);
  message.mutable_list_worlds();
  return message.SerializeAsString();
}

/// The gate takes a message and what is read of it, as the service has it do.
inline SessionGate::Verdict say(SessionGate& gate, const std::string& bytes, SessionGate::TimePoint now = start) {
  SessionGate::Verdict verdict = gate.receive({bytes, {}}, now);
  if (!verdict.unread) return verdict;
  const base::MemoryBudget plenty(std::size_t{1} << 30U);
  return gate.pass(verdict.unread->request_id, read_request(*verdict.unread, plenty), now);
}

}  // namespace pneuma::app
