#include "net/session_timers.h"

namespace pneuma::net {

namespace {

// The second ping that finds its predecessor unanswered closes the session.
constexpr std::uint64_t pings_missed_max = 2;

base::Status timed_out(const char* what) {
  return {base::StatusCode::unavailable, what};
}

}  // namespace

SessionTimers::SessionTimers(const base::Limits& limits, TimePoint now)
    : limits_(limits), opened_(now), last_ping_(now) {}

void SessionTimers::authenticated(TimePoint now) {
  authenticated_ = true;
  last_ping_ = now;
}

void SessionTimers::received(TimePoint now, bool in_message) {
  if (!in_message) {
    message_began_.reset();
  } else if (!message_began_) {
    message_began_ = now;
  }
}

void SessionTimers::pong(std::uint64_t nonce) {
  if (nonce != ping_nonce_) return;
  ping_answered_ = true;
  pings_missed_ = 0;
}

void SessionTimers::reading_resumed(TimePoint now) {
  reading_ = true;
  last_ping_ = now;
}

SessionTimers::Action SessionTimers::poll(TimePoint now) {
  if (closing_until_) {
    if (now >= *closing_until_) return timed_out("the client did not take its goodbye");
    return Nothing{};
  }
  if (!authenticated_ && now >= opened_ + limits_.hello_timeout) return timed_out("no hello came in time");
  if (message_began_ && now >= *message_began_ + limits_.partial_message_timeout)
    return timed_out("a message did not end in time");
  if (write_progress_ && now >= *write_progress_ + limits_.write_stall_timeout)
    return timed_out("the client stopped reading");
  if (!authenticated_ || !reading_ || now < last_ping_ + limits_.ping_interval) return Nothing{};
  if (!ping_answered_ && ++pings_missed_ >= pings_missed_max) return timed_out("two pings were not answered");
  last_ping_ = now;
  ping_answered_ = false;
  return SendPing{++ping_nonce_};
}

}  // namespace pneuma::net
