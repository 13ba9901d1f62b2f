// Messages that come in parts, until they are whole. Bounded in memory for a session and in all. Takes parts and a
// time; the network thread's alone.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "app/envelope.h"
#include "base/limits.h"
#include "base/status.h"

namespace pneuma::app {

/// Puts each session's parts together, one message of a session at a time. A message must come at the pace of
/// Limits::message_bytes_max in base::parts_timeout, and may stand still for so long if it came faster before.
class MessageParts {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit MessageParts(const base::Limits& limits);

  /// The largest message that is taken: one of that size passes the rate of a client that asked for little else lately.
  [[nodiscard]] std::size_t bytes_max() const { return bytes_max_; }

  struct Taken {
    base::Status refused;  // the message is given up, and its later parts are passed over
    double retry_after_s = 0.0;
    std::optional<std::string> whole;
  };
  /// Takes the next part of a message of a session, which is `client`'s. One client has half of the room at most.
  [[nodiscard]] Taken take(std::uint64_t session_id, const std::string& client, std::uint64_t request_id,
                           const PartView& part, TimePoint now);

  /// The part belongs to a message that was answered by an error already.
  [[nodiscard]] bool passes_over(std::uint64_t session_id, std::uint64_t request_id, bool is_last);
  /// The part was answered by an error: its message will not become whole.
  void give_up(std::uint64_t session_id, std::uint64_t request_id, bool is_last);
  void session_ended(std::uint64_t session_id);

 private:
  // A message that is not whole yet.
  struct Assembly {
    Assembly(std::uint64_t id, TimePoint until) : request_id(id), good_until(until) {}
    std::uint64_t request_id;
    std::string bytes;
    std::size_t held = 0;  // with its spare room
    TimePoint good_until;  // a part after that is too late
  };
  struct Sender {
    std::string client;
    std::optional<Assembly> assembly;
    std::deque<std::uint64_t> given_up;  // request ids, the oldest first
  };

  [[nodiscard]] Taken append(Sender& sender, std::uint64_t request_id, const PartView& part, TimePoint now);
  [[nodiscard]] bool has_room(const std::string& client, std::size_t bytes, TimePoint now);
  [[nodiscard]] std::size_t held_by(const std::string& client) const;
  void put_off(Assembly& assembly, std::size_t bytes, TimePoint now) const;
  void drop(Sender& sender);

  std::size_t message_bytes_max_;
  std::size_t bytes_max_;
  std::size_t waiting_bytes_max_;
  std::map<std::uint64_t, Sender> senders_;  // by session
  std::size_t bytes_ = 0;                    // of all that waits
};

}  // namespace pneuma::app
