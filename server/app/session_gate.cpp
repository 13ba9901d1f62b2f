#include "app/session_gate.h"

#include <utility>

#include "app/auth.h"
#include "app/protocol.h"
#include "base/version.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

// A nonce, and room for what newer clients may add.
constexpr std::size_t pong_bytes_max = 64;

SessionGate::Verdict refuse(std::uint64_t request_id, const Status& why, double retry_after_s = 0.0) {
  SessionGate::Verdict verdict;
  verdict.reply = error_reply(request_id, why, retry_after_s);
  return verdict;
}

SessionGate::Verdict refuse_by_rate(std::uint64_t request_id, double wait_s) {
  return refuse(request_id, {StatusCode::limit_exceeded, "more commands than the server takes of a client"}, wait_s);
}

SessionGate::Verdict shut(Status why) {
  SessionGate::Verdict verdict;
  verdict.close = std::move(why);
  return verdict;
}

SessionGate::Verdict refuse_and_shut(std::uint64_t request_id, const Status& why) {
  SessionGate::Verdict verdict = refuse(request_id, why);
  verdict.close = why;
  return verdict;
}

}  // namespace

SessionGate::SessionGate(std::uint64_t session_id, std::string_view token, const base::Limits& limits,
                         MessageParts& parts)
    : session_id_(session_id),
      token_(token),
      message_bytes_max_(limits.message_bytes_max),
      parts_(parts),
      commands_(limits.commands_per_s, limits.commands_burst) {}

SessionGate::Verdict SessionGate::receive(net::ReceivedMessage message, TimePoint now) {
  const std::optional<Envelope> envelope = read_envelope(message.bytes);
  if (!envelope) return shut({StatusCode::malformed, "not a ClientMessage"});
  const std::uint64_t id = envelope->request_id;
  if (!open_ && envelope->request != v1::ClientMessage::kHello) {
    return shut({StatusCode::unauthenticated, "a " + std::string(kind_of(envelope->request)) + " came before hello"});
  }
  // The server asked for a pong, so it is no command.
  if (envelope->request != v1::ClientMessage::kPong || message.bytes.size() > pong_bytes_max) {
    const double wait_s = commands_.take(now);
    if (envelope->request == v1::ClientMessage::kPart) return take_part(*envelope, wait_s, now);
    if (wait_s > 0.0) return refuse_by_rate(id, wait_s);
    if (id == 0) return refuse(0, base::invalid("must not be 0", "request_id"));
  }
  if (envelope->request == v1::ClientMessage::REQUEST_NOT_SET) {
    return refuse(id, {StatusCode::unsupported, "no request that this server knows"});
  }
  Verdict verdict;
  verdict.unread = Unread{id, std::move(message), false};
  return verdict;
}

SessionGate::Verdict SessionGate::take_part(const Envelope& envelope, double wait_s, TimePoint now) {
  const std::uint64_t id = envelope.request_id;
  const std::optional<PartView> part = read_part(envelope.body);
  if (!part) return shut({StatusCode::malformed, "not a Part"});
  if (parts_.passes_over(session_id_, id, part->last)) return {};
  if (wait_s > 0.0) {
    parts_.give_up(session_id_, id, part->last);
    return refuse_by_rate(id, wait_s);
  }
  if (id == 0) return refuse(0, base::invalid("must not be 0", "request_id"));
  MessageParts::Taken taken = parts_.take(session_id_, id, *part, now);
  if (!taken.refused.ok()) return refuse(id, taken.refused, taken.retry_after_s);
  Verdict verdict;
  if (taken.whole) verdict.unread = Unread{id, {std::move(*taken.whole), {}}, true};
  return verdict;
}

SessionGate::Verdict SessionGate::pass(std::uint64_t request_id, base::Result<ReadMessage> read) {
  if (!read.ok()) {
    if (read.status().code() == StatusCode::malformed) return shut(read.status());
    return refuse(request_id, read.status(), read.status().code() == StatusCode::unavailable ? retry_hint_s : 0.0);
  }
  const v1::ClientMessage& message = *read->message;
  switch (message.request_case()) {
    case v1::ClientMessage::kHello:
      return hello(message);
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
      Verdict verdict;
      verdict.request = std::move(*read);
      return verdict;
    }
  }
}

SessionGate::Verdict SessionGate::hello(const v1::ClientMessage& message) {
  const v1::Hello& hello = message.hello();
  if (open_) {
    return refuse(message.request_id(), {StatusCode::failed_precondition, "hello was said already", "hello"});
  }
  if (hello.protocol_version() != base::protocol_version) {
    return refuse_and_shut(
        message.request_id(),
        {StatusCode::unsupported, "this server speaks version " + std::to_string(base::protocol_version),
         "hello.protocol_version"});
  }
  if (!token_.empty() && !same_token(hello.token(), token_)) {
    const char* what = hello.token().empty() ? "is missing: this server asks for a token" : "is not this server's";
    return refuse_and_shut(message.request_id(), {StatusCode::unauthenticated, what, "hello.token"});
  }
  open_ = true;
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
  return verdict;
}

}  // namespace pneuma::app
