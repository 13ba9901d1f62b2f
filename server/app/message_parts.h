// Messages that come in parts, until they are whole. Bounded in memory for a session and in all. Takes parts and a
// time; the network thread's alone.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/limits.h"
#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// The largest message that is taken in parts: one of that size passes the rate of a client that asked for little else
/// lately.
[[nodiscard]] std::size_t parts_bytes_max(const base::Limits& limits);

/// A message that is not whole yet.
struct PartAssembly {
  std::uint64_t request_id = 0;
  std::vector<std::string> parts;
  std::size_t bytes = 0;
  std::chrono::steady_clock::time_point last_part{};
};

class MessageParts {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  explicit MessageParts(const base::Limits& limits) : bytes_max_(parts_bytes_max(limits)) {}

  struct Taken {
    base::Status refused;  // the message is given up, and its later parts are passed over
    double retry_after_s = 0.0;
    std::optional<v1::ClientMessage> whole;  // of the request id that its parts had
  };
  /// Takes the next part of a session's message.
  [[nodiscard]] Taken take(std::uint64_t session_id, std::uint64_t request_id, v1::Part part, TimePoint now);

  /// The part belongs to a message that was answered by an error already.
  [[nodiscard]] bool passes_over(std::uint64_t session_id, std::uint64_t request_id, bool is_last);
  /// The part was answered by an error: its message will not become whole.
  void give_up(std::uint64_t session_id, std::uint64_t request_id, bool is_last);
  void session_ended(std::uint64_t session_id);

 private:
  struct Sender {
    std::optional<PartAssembly> assembly;
    std::optional<std::uint64_t> given_up;  // request id
  };

  [[nodiscard]] Taken append(Sender& sender, std::uint64_t request_id, v1::Part part, TimePoint now);
  [[nodiscard]] bool has_room(std::size_t bytes, TimePoint now);
  [[nodiscard]] static bool is_late(const PartAssembly& assembly, TimePoint now);
  void drop(Sender& sender);

  std::size_t bytes_max_;
  std::map<std::uint64_t, Sender> senders_;  // by session
  std::size_t bytes_ = 0;                    // of all that waits
};

}  // namespace pneuma::app
