// A session's time limits: takes what happened and when, and says what to do. Reads no clock and owns no socket.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <variant>

#include "base/limits.h"
#include "base/status.h"

namespace pneuma::net {

class SessionTimers {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  SessionTimers(const base::Limits& limits, TimePoint now);

  void authenticated(TimePoint now);
  /// Bytes came in; `in_message`: they ended in the middle of a message.
  void received(TimePoint now, bool in_message);
  void pong(std::uint64_t nonce);
  /// Nothing is read for now, pongs neither: no ping is sent and none counts as missed.
  void reading_paused() { reading_ = false; }
  void reading_resumed(TimePoint now);
  /// A write began, or took some bytes on.
  void write_progressed(TimePoint now) { write_progress_ = now; }
  void write_done() { write_progress_.reset(); }
  [[nodiscard]] bool is_writing() const { return write_progress_.has_value(); }
  /// The session says goodbye: from here on only this time counts.
  void closing_until(TimePoint end) { closing_until_ = end; }

  struct Nothing {};
  struct SendPing {
    std::uint64_t nonce = 0;
  };
  using Action = std::variant<Nothing, SendPing, base::Status>;  // a status: close, with this reason
  [[nodiscard]] Action poll(TimePoint now);

 private:
  base::Limits limits_;
  TimePoint opened_;
  bool authenticated_ = false;
  std::optional<TimePoint> message_began_;
  std::optional<TimePoint> write_progress_;
  std::optional<TimePoint> closing_until_;
  TimePoint last_ping_;
  std::uint64_t ping_nonce_ = 0;  // of the last ping sent
  std::uint64_t pings_missed_ = 0;
  bool ping_answered_ = true;
  bool reading_ = true;
};

}  // namespace pneuma::net
