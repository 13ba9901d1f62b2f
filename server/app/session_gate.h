// What one session may say and when: hello first, a request id always, no more often than its rate; a message in parts
// once it is whole.
// Takes bytes and a time, returns what to do; owns no socket.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "app/message_parts.h"
#include "app/token_bucket.h"
#include "base/limits.h"
#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

class SessionGate {
 public:
  using TimePoint = TokenBucket::TimePoint;

  struct Verdict {
    std::optional<v1::ServerMessage> reply;    // to be sent at once
    std::optional<v1::ClientMessage> request;  // to be carried out
    std::optional<std::uint64_t> pong_nonce;   // the client answered a ping
    bool authenticated = false;                // this message was a good hello
    std::optional<base::Status> close;         // say goodbye with this reason, after `reply`
  };

  /// An empty `token`: the server asks for none. `token` and `parts`, all sessions' together, must outlive the gate.
  SessionGate(std::uint64_t session_id, std::string_view token, const base::Limits& limits, MessageParts& parts);

  [[nodiscard]] Verdict receive(std::string_view bytes, TimePoint now);

  [[nodiscard]] bool is_open() const { return open_; }  // a good hello came
  [[nodiscard]] const std::string& client_name() const { return client_name_; }

 private:
  [[nodiscard]] Verdict pass(v1::ClientMessage message, TimePoint now);
  [[nodiscard]] Verdict hello(const v1::ClientMessage& message);

  std::uint64_t session_id_;
  std::string_view token_;
  std::size_t message_bytes_max_;
  MessageParts& parts_;
  TokenBucket commands_;
  bool open_ = false;
  std::string client_name_;
};

}  // namespace pneuma::app
