#include "app/protocol.h"

#include <memory>

namespace pneuma::app {

namespace {

v1::Error::Code to_code(base::StatusCode code) {
  switch (code) {
    case base::StatusCode::ok:
      return v1::Error::CODE_UNSPECIFIED;
    case base::StatusCode::invalid_argument:
      return v1::Error::INVALID_ARGUMENT;
    case base::StatusCode::not_found:
      return v1::Error::NOT_FOUND;
    case base::StatusCode::already_exists:
      return v1::Error::ALREADY_EXISTS;
    case base::StatusCode::limit_exceeded:
      return v1::Error::LIMIT_EXCEEDED;
    case base::StatusCode::unauthenticated:
      return v1::Error::UNAUTHENTICATED;
    case base::StatusCode::failed_precondition:
      return v1::Error::FAILED_PRECONDITION;
    case base::StatusCode::unsupported:
      return v1::Error::UNSUPPORTED;
    case base::StatusCode::malformed:
      return v1::Error::MALFORMED;
    case base::StatusCode::unavailable:
      return v1::Error::UNAVAILABLE;
    case base::StatusCode::internal:
      return v1::Error::INTERNAL;
  }
  return v1::Error::INTERNAL;
}

}  // namespace

v1::Error to_error(const base::Status& status, double retry_after_s) {
  v1::Error error;
  error.set_code(to_code(status.code()));
  error.set_what(status.what());
  error.set_where(status.where());
  error.set_retry_after_s(retry_after_s);
  return error;
}

v1::ServerMessage error_reply(std::uint64_t request_id, const base::Status& status, double retry_after_s) {
  v1::ServerMessage message;
  message.set_request_id(request_id);
  *message.mutable_error() = to_error(status, retry_after_s);
  return message;
}

v1::ServerMessage done_reply(std::uint64_t request_id, std::uint64_t tick, const std::string& world,
                             const std::string& detail, const std::vector<v1::MendedMesh>& mended) {
  v1::ServerMessage message;
  message.set_request_id(request_id);
  message.mutable_done()->set_tick(tick);
  message.mutable_done()->set_world(world);
  message.mutable_done()->set_detail(detail);
  message.mutable_done()->mutable_mended()->Add(mended.begin(), mended.end());
  return message;
}

v1::ServerMessage event_message(v1::Event::Kind kind, const std::string& world, std::uint64_t tick,
                                const std::string& body, const std::string& detail) {
  v1::ServerMessage message;
  v1::Event& event = *message.mutable_event();
  event.set_kind(kind);
  event.set_world(world);
  event.set_body(body);
  event.set_tick(tick);
  event.set_detail(detail);
  return message;
}

net::SharedBytes serialise(const v1::ServerMessage& message) {
  return std::make_shared<const std::string>(message.SerializeAsString());
}

std::string make_ping(std::uint64_t nonce) {
  v1::ServerMessage message;
  message.mutable_ping()->set_nonce(nonce);
  return message.SerializeAsString();
}

std::string make_goodbye(const base::Status& why) {
  v1::ServerMessage message;
  // A second is long enough for a place to come free, or a server to come back.
  const double retry_after_s = why.code() == base::StatusCode::unavailable ? 1.0 : 0.0;
  *message.mutable_goodbye()->mutable_reason() = to_error(why, retry_after_s);
  return message.SerializeAsString();
}

std::string make_gap(std::uint32_t stream_id, std::uint64_t from_tick, std::uint64_t to_tick) {
  v1::ServerMessage message;
  message.mutable_gap()->set_stream_id(stream_id);
  message.mutable_gap()->set_from_tick(from_tick);
  message.mutable_gap()->set_to_tick(to_tick);
  return message.SerializeAsString();
}

std::string_view kind_of(v1::ClientMessage::RequestCase request) {
  const auto* field = v1::ClientMessage::descriptor()->FindFieldByNumber(request);
  return field == nullptr ? std::string_view("unknown") : std::string_view(field->name());
}

const std::string* world_of(const v1::ClientMessage& request) {
  switch (request.request_case()) {
    case v1::ClientMessage::kDestroyWorld:
      return &request.destroy_world().world();
    case v1::ClientMessage::kSubscribe:
      return &request.subscribe().world();
    case v1::ClientMessage::kEdit:
      return &request.edit().world();
    case v1::ClientMessage::kImpulse:
      return &request.impulse().world();
    case v1::ClientMessage::kGrab:
      return &request.grab().world();
    case v1::ClientMessage::kMoveGrab:
      return &request.move_grab().world();
    case v1::ClientMessage::kReleaseGrab:
      return &request.release_grab().world();
    case v1::ClientMessage::kPause:
      return &request.pause().world();
    case v1::ClientMessage::kResume:
      return &request.resume().world();
    case v1::ClientMessage::kStep:
      return &request.step().world();
    case v1::ClientMessage::kReset:
      return &request.reset().world();
    case v1::ClientMessage::kSeek:
      return &request.seek().world();
    case v1::ClientMessage::kGetStats:
      return &request.get_stats().world();
    case v1::ClientMessage::kGetScene:
      return &request.get_scene().world();
    case v1::ClientMessage::kTakeSnapshot:
      return &request.take_snapshot().world();
    case v1::ClientMessage::kBranchWorld:
      return &request.branch_world().world();
    case v1::ClientMessage::kRewindWorld:
      return &request.rewind_world().world();
    default:
      return nullptr;
  }
}

}  // namespace pneuma::app
