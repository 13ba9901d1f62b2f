// What one session may say and when: hello first, a request id always, what its token allows, no more often than its
// rate; a message in parts once it is whole. Takes bytes and a time, returns what to do; owns no socket and parses
// nothing large.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "app/envelope.h"
#include "app/gatekeeper.h"
#include "app/message_parts.h"
#include "app/request_reader.h"
#include "app/token_bucket.h"
#include "base/limits.h"
#include "base/status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

class SessionGate {
 public:
  using TimePoint = TokenBucket::TimePoint;

  struct Verdict {
    std::optional<v1::ServerMessage> reply;   // to be sent at once
    std::optional<Unread> unread;             // to be parsed, and given to pass()
    std::optional<ReadMessage> request;       // to be carried out
    std::optional<std::uint64_t> pong_nonce;  // the client answered a ping
    bool authenticated = false;               // this message was a good hello
    bool is_over_rate = false;                // the client sends more than the server takes of it
    std::optional<base::Status> close;        // say goodbye with this reason, after `reply`
  };

  /// `address` is whose session it is, as it is counted. `gatekeeper` and `parts`, all sessions' together, must outlive
  /// the gate.
  SessionGate(std::uint64_t session_id, std::string address, Gatekeeper& gatekeeper, const base::Limits& limits,
              MessageParts& parts);

  /// A message as it came.
  [[nodiscard]] Verdict receive(net::ReceivedMessage message, TimePoint now);
  /// The message that was unread, or why it could not be read. The session receives nothing in between.
  [[nodiscard]] Verdict pass(std::uint64_t request_id, base::Result<ReadMessage> read, TimePoint now);

  /// What its token allows; null until a good hello came.
  [[nodiscard]] const GrantPtr& grant() const { return grant_; }
  /// As what it takes is counted (client_of).
  [[nodiscard]] const std::string& client() const { return client_; }
  [[nodiscard]] const std::string& client_name() const { return client_name_; }

 private:
  [[nodiscard]] Verdict take_part(const Envelope& envelope, double wait_s, TimePoint now);
  [[nodiscard]] Verdict hello(const v1::ClientMessage& message, TimePoint now);

  std::uint64_t session_id_;
  std::string address_;
  Gatekeeper& gatekeeper_;
  std::size_t message_bytes_max_;
  bool is_counted_;  // its commands are
  MessageParts& parts_;
  std::shared_ptr<TokenBucket> commands_;  // its client's; null until a good hello came
  TokenBucket pongs_;                      // those that the server may have asked for
  GrantPtr grant_;
  std::string client_;
  std::string client_name_;
};

}  // namespace pneuma::app
