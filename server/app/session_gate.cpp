#include "app/session_gate.h"

#include "app/auth.h"
#include "app/protocol.h"
#include "base/version.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

SessionGate::Verdict refuse(std::uint64_t request_id, const Status& why, double retry_after_s = 0.0) {
  SessionGate::Verdict verdict;
  verdict.reply = error_reply(request_id, why, retry_after_s);
  return verdict;
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

SessionGate::Verdict SessionGate::receive(std::string_view bytes, TimePoint now) {
  v1::ClientMessage message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return shut({StatusCode::malformed, "not a ClientMessage"});
  }
  if (!open_ && !message.has_hello()) {
    return shut({StatusCode::unauthenticated, "a " + std::string(kind_of(message)) + " came before hello"});
  }
  if (message.has_pong()) return pass(std::move(message), now);  // the server asked for it; it is no command
  const double wait_s = commands_.take(now);                     // each part takes its own
  if (message.has_part() && parts_.passes_over(session_id_, message.request_id(), message.part().last())) return {};
  if (wait_s > 0.0) {
    if (message.has_part()) parts_.give_up(session_id_, message.request_id(), message.part().last());
    return refuse(message.request_id(), {StatusCode::limit_exceeded, "more commands than the server takes of a client"},
                  wait_s);
  }
  if (message.request_id() == 0) return refuse(0, base::invalid("must not be 0", "request_id"));
  return pass(std::move(message), now);
}

SessionGate::Verdict SessionGate::pass(v1::ClientMessage message, TimePoint now) {
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
    case v1::ClientMessage::kPart: {
      const std::uint64_t id = message.request_id();
      MessageParts::Taken taken = parts_.take(session_id_, id, message.part(), now);
      if (!taken.refused.ok()) return refuse(id, taken.refused, taken.retry_after_s);
      return taken.whole ? pass(std::move(*taken.whole), now) : Verdict();
    }
    case v1::ClientMessage::REQUEST_NOT_SET:
      return refuse(message.request_id(), {StatusCode::unsupported, "no request that this server knows"});
    default: {
      Verdict verdict;
      verdict.request = std::move(message);
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
