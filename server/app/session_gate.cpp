#include "app/session_gate.h"

#include <utility>

#include "app/protocol.h"
#include "app/request_kinds.h"
#include "base/version.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

// A nonce, and room for what newer clients may add.
constexpr std::size_t pong_bytes_max = 64;
// Twice as many as the server asks for, and some at once: a client that sends more is read slowly.
constexpr double pongs_a_ping = 2.0;
constexpr double pongs_burst = 64.0;

/// Takes an address as it is counted.
bool is_loopback(const std::string& address) {
  return address.starts_with("127.") || address == "::1";
}

SessionGate::Verdict refuse(std::uint64_t request_id, const Status& why, double retry_after_s = 0.0) {
  SessionGate::Verdict verdict;
  verdict.reply = error_reply(request_id, why, retry_after_s);
  return verdict;
}

SessionGate::Verdict refuse(std::uint64_t request_id, const v1::Error& why) {
  SessionGate::Verdict verdict;
  verdict.reply.emplace().set_request_id(request_id);
  *verdict.reply->mutable_error() = why;
  return verdict;
}

SessionGate::Verdict refuse_by_rate(std::uint64_t request_id, double wait_s) {
  const Status why(StatusCode::limit_exceeded, "more commands than the server takes of a client");
  SessionGate::Verdict verdict = refuse(request_id, why, wait_s);
  verdict.is_over_rate = true;
  return verdict;
}

SessionGate::Verdict shut(Status why) {
  SessionGate::Verdict verdict;
  verdict.close = std::move(why);
  return verdict;
}

SessionGate::Verdict refuse_and_shut(std::uint64_t request_id, const Status& why, double retry_after_s = 0.0) {
  SessionGate::Verdict verdict = refuse(request_id, why, retry_after_s);
  verdict.close = why;
  return verdict;
}

}  // namespace

SessionGate::SessionGate(std::uint64_t session_id, std::string address, Gatekeeper& gatekeeper,
                         const base::Limits& limits, MessageParts& parts)
    : session_id_(session_id),
      address_(std::move(address)),
      gatekeeper_(gatekeeper),
      message_bytes_max_(limits.message_bytes_max),
      is_counted_(limits.limits_loopback || !is_loopback(address_)),
      parts_(parts),
      pongs_(pongs_a_ping / std::chrono::duration<double>(limits.ping_interval).count(), pongs_burst) {}

SessionGate::Verdict SessionGate::receive(net::ReceivedMessage message, TimePoint now) {
  const std::optional<Envelope> envelope = read_envelope(message.bytes);
  if (!envelope) return shut({StatusCode::malformed, "not a ClientMessage"});
  const std::uint64_t id = envelope->request_id;
  if (grant_ == nullptr && envelope->request != v1::ClientMessage::kHello) {
    return shut({StatusCode::unauthenticated, "a " + std::string(kind_of(envelope->request)) + " came before hello"});
  }
  // The server asked for a pong, so it is no command. A hello counts once its client is known.
  const bool is_command = envelope->request != v1::ClientMessage::kPong || message.bytes.size() > pong_bytes_max;
  if (!is_command && pongs_.take(now) > 0.0) {
    Verdict verdict;
    verdict.is_over_rate = true;
    return verdict;
  }
  const double wait_s = is_command && commands_ != nullptr ? commands_->take(now) : 0.0;
  if (envelope->request == v1::ClientMessage::kPart) return take_part(*envelope, wait_s, now);
  if (wait_s > 0.0) return refuse_by_rate(id, wait_s);
  if (is_command && id == 0) return refuse(0, base::invalid("must not be 0", "request_id"));
  if (envelope->request == v1::ClientMessage::REQUEST_NOT_SET) {
    return refuse(id, {StatusCode::unsupported, "no request that this server knows"});
  }
  // What the role alone rules out is not even parsed.
  if (grant_ != nullptr) {
    if (const Denial denial = check_role(*grant_, envelope->request)) return refuse(id, *denial);
  }
  Verdict verdict;
  verdict.unread = Unread{id, std::move(message), false};
  return verdict;
}

SessionGate::Verdict SessionGate::take_part(const Envelope& envelope, double wait_s, TimePoint now) {
  const std::uint64_t id = envelope.request_id;
  const std::optional<PartView> part = read_part(envelope.body);
  if (!part) return shut({StatusCode::malformed, "not a Part"});
  if (parts_.passes_over(session_id_, id, part->last)) {
    Verdict verdict;
    verdict.is_over_rate = wait_s > 0.0;
    return verdict;
  }
  if (wait_s > 0.0) {
    parts_.give_up(session_id_, id, part->last);
    return refuse_by_rate(id, wait_s);
  }
  if (id == 0) return refuse(0, base::invalid("must not be 0", "request_id"));
  MessageParts::Taken taken = parts_.take(session_id_, client_, id, *part, now);
  if (!taken.refused.ok()) return refuse(id, taken.refused, taken.retry_after_s);
  Verdict verdict;
  if (taken.whole) verdict.unread = Unread{id, {std::move(*taken.whole), {}}, true};
  return verdict;
}

SessionGate::Verdict SessionGate::pass(std::uint64_t request_id, base::Result<ReadMessage> read, TimePoint now) {
  if (!read.ok()) {
    if (read.status().code() == StatusCode::malformed) return shut(read.status());
    return refuse(request_id, read.status(), read.status().code() == StatusCode::unavailable ? retry_hint_s : 0.0);
  }
  const v1::ClientMessage& message = *read->message;
  switch (message.request_case()) {
    case v1::ClientMessage::kHello:
      return hello(message, now);
    case v1::ClientMessage::kPing: {
      Verdict verdict;
      verdict.reply.emplace().set_request_id(message.request_id());
      verdict.reply->mutable_pong()->set_nonce(message.ping().nonce());
      return verdict;
    }
    case v1::ClientMessage::kPong: {
      Verdict verdict;
      verdict.pong_nonce = message.pong().nonce();
      return verdict;
    }
    case v1::ClientMessage::REQUEST_NOT_SET:  // in parts
      return refuse(request_id, {StatusCode::unsupported, "no request that this server knows"});
    default: {
      if (const Denial denial = check_permission(*grant_, message)) return refuse(request_id, *denial);
      Verdict verdict;
      verdict.request = std::move(*read);
      return verdict;
    }
  }
}

SessionGate::Verdict SessionGate::hello(const v1::ClientMessage& message, TimePoint now) {
  const v1::Hello& hello = message.hello();
  if (grant_ != nullptr) {
    return refuse(message.request_id(), {StatusCode::failed_precondition, "hello was said already", "hello"});
  }
  if (hello.protocol_version() != base::protocol_version) {
    return refuse_and_shut(
        message.request_id(),
        {StatusCode::unsupported, "this server speaks version " + std::to_string(base::protocol_version),
         "hello.protocol_version"});
  }
  Gatekeeper::Verdict admitted = gatekeeper_.admit(hello.token(), address_, now, wall_clock_now());
  if (admitted.grant == nullptr) {
    return refuse_and_shut(message.request_id(), admitted.refusal.inside("hello.token"), admitted.retry_after_s);
  }
  grant_ = std::move(admitted.grant);
  client_ = client_of(*grant_, address_);
  if (is_counted_) {
    commands_ = gatekeeper_.commands_of(client_, now);
    (void)commands_->take(now);  // the hello; one that finds none left is let in, and can ask for nothing yet
  }
  client_name_ = hello.client_name().substr(0, base::name_bytes_max);

  Verdict verdict;
  verdict.authenticated = true;
  verdict.reply.emplace().set_request_id(message.request_id());
  v1::Welcome& welcome = *verdict.reply->mutable_welcome();
  welcome.set_protocol_version(base::protocol_version);
  welcome.set_server_version(std::string(base::version));
  welcome.set_session_id(session_id_);
  welcome.set_message_bytes_max(static_cast<std::uint32_t>(message_bytes_max_));
  welcome.set_parts_bytes_max(static_cast<std::uint32_t>(parts_.bytes_max()));
  welcome.set_role(to_wire(grant_->role));
  welcome.set_worlds(grant_->worlds.text());
  return verdict;
}

}  // namespace pneuma::app
