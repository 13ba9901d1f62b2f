// The typed requests of Client: each fills one message and takes the reply that belongs to it.
#include <utility>

#include "base/limits.h"
#include "pneuma_client/client.h"

namespace pneuma::client {

namespace {

using v1::ClientMessage;
using v1::ServerMessage;

// A world may be replayed from its last checkpoints for the reply.
constexpr std::chrono::minutes replay_timeout{10};

/// The part of a reply that a request expects.
template <class Reply>
base::Result<Reply> take(base::Result<ServerMessage> message, bool (ServerMessage::*has)() const,
                         Reply* (ServerMessage::*get)()) {
  if (!message.ok()) return message.status();
  if (!((*message).*has)()) return base::Status(base::StatusCode::malformed, "a reply of another kind");
  return std::move(*((*message).*get)());
}

base::Result<v1::Done> take_done(base::Result<ServerMessage> message) {
  return take(std::move(message), &ServerMessage::has_done, &ServerMessage::mutable_done);
}

}  // namespace

base::Result<v1::WorldList> Client::list_worlds() {
  ClientMessage request;
  request.mutable_list_worlds();
  return take(call(std::move(request)), &ServerMessage::has_world_list, &ServerMessage::mutable_world_list);
}

base::Result<v1::Done> Client::create_world(const v1::CreateWorld& request) {
  ClientMessage message;
  *message.mutable_create_world() = request;
  return take_done(call(std::move(message)));
}

base::Result<v1::Done> Client::create_builtin(const std::string& scene, const std::string& world, bool paused) {
  v1::CreateWorld request;
  request.set_builtin(scene);
  request.set_name(world);
  request.set_paused(paused);
  return create_world(request);
}

base::Result<v1::Done> Client::destroy_world(const std::string& world) {
  ClientMessage request;
  request.mutable_destroy_world()->set_world(world);
  return take_done(call(std::move(request)));
}

base::Result<v1::Subscribed> Client::subscribe(const std::string& world, const SubscribeOptions& options) {
  ClientMessage request;
  v1::Subscribe& subscribe = *request.mutable_subscribe();
  subscribe.set_world(world);
  subscribe.set_rate_hz(options.rate_hz);
  subscribe.set_max_error_m(options.max_error_m);
  subscribe.set_commands(options.commands);
  subscribe.set_key_interval_s(options.key_interval_s);
  for (const std::string& body : options.bodies) subscribe.add_bodies(body);
  subscribe.set_level_of_detail(options.level_of_detail);
  subscribe.set_velocities(options.velocities);
  subscribe.set_scalars(options.scalars);
  subscribe.set_contacts(options.contacts);
  subscribe.set_time_layers(options.time_layers);
  subscribe.set_adaptive(options.adaptive);
  subscribe.set_simulated(options.simulated);
  for (const TopologyPtr& topology : topologies()) subscribe.add_known_topologies(topology->hash);
  return take(call(std::move(request)), &ServerMessage::has_subscribed, &ServerMessage::mutable_subscribed);
}

base::Result<v1::Done> Client::unsubscribe(std::uint32_t stream_id) {
  ClientMessage request;
  request.mutable_unsubscribe()->set_stream_id(stream_id);
  return take_done(call(std::move(request)));
}

base::Result<v1::Done> Client::edit(const std::string& world, const v1::SceneEdit& edit) {
  ClientMessage request;
  request.mutable_edit()->set_world(world);
  *request.mutable_edit()->mutable_edit() = edit;
  return take_done(call(std::move(request)));
}

base::Result<v1::Done> Client::edit_json(const std::string& world, const std::string& edit_json) {
  ClientMessage request;
  request.mutable_edit()->set_world(world);
  request.mutable_edit()->set_edit_json(edit_json);
  return take_done(call(std::move(request)));
}

base::Result<v1::Done> Client::impulse(const v1::Impulse& request) {
  ClientMessage message;
  *message.mutable_impulse() = request;
  return take_done(call(std::move(message)));
}

base::Result<v1::Grabbed> Client::grab(const v1::Grab& request) {
  ClientMessage message;
  *message.mutable_grab() = request;
  return take(call(std::move(message)), &ServerMessage::has_grabbed, &ServerMessage::mutable_grabbed);
}

base::Result<v1::Done> Client::move_grab(const std::string& world, std::uint64_t grab_id, const v1::Vec3& target) {
  ClientMessage request;
  request.mutable_move_grab()->set_world(world);
  request.mutable_move_grab()->set_grab_id(grab_id);
  *request.mutable_move_grab()->mutable_target() = target;
  return take_done(call(std::move(request)));
}

base::Result<v1::Done> Client::release_grab(const std::string& world, std::uint64_t grab_id) {
  ClientMessage request;
  request.mutable_release_grab()->set_world(world);
  request.mutable_release_grab()->set_grab_id(grab_id);
  return take_done(call(std::move(request)));
}

base::Result<v1::Done> Client::pause(const std::string& world) {
  ClientMessage request;
  request.mutable_pause()->set_world(world);
  return take_done(call(std::move(request)));
}

base::Result<v1::Done> Client::resume(const std::string& world, std::optional<double> time_scale) {
  ClientMessage request;
  request.mutable_resume()->set_world(world);
  if (time_scale) request.mutable_resume()->set_time_scale(*time_scale);
  return take_done(call(std::move(request)));
}

base::Result<v1::Done> Client::step(const std::string& world, std::uint32_t ticks, std::chrono::milliseconds timeout) {
  ClientMessage request;
  request.mutable_step()->set_world(world);
  request.mutable_step()->set_ticks(ticks);
  return take_done(call(std::move(request), timeout));
}

base::Result<v1::Done> Client::reset(const std::string& world) {
  ClientMessage request;
  request.mutable_reset()->set_world(world);
  return take_done(call(std::move(request)));
}

base::Result<v1::Done> Client::seek(const std::string& world, double time_s) {
  ClientMessage request;
  request.mutable_seek()->set_world(world);
  request.mutable_seek()->set_time_s(time_s);
  return take_done(call(std::move(request)));
}

base::Result<v1::Snapshot> Client::snapshot(const std::string& world) {
  ClientMessage request;
  request.mutable_take_snapshot()->set_world(world);
  const auto ask = [this](ClientMessage message) {
    return take(call(std::move(message), replay_timeout), &ServerMessage::has_snapshot,
                &ServerMessage::mutable_snapshot);
  };
  auto whole = ask(std::move(request));
  if (whole.ok() && whole->bytes_total() > base::world_file_bytes_max) {
    return base::Status(base::StatusCode::malformed, "a snapshot larger than any");
  }
  while (whole.ok() && whole->data().size() < whole->bytes_total()) {
    ClientMessage next;
    next.mutable_read_snapshot()->set_snapshot_id(whole->snapshot_id());
    next.mutable_read_snapshot()->set_offset(whole->data().size());
    const auto piece = ask(std::move(next));
    if (!piece.ok()) return piece;
    if (piece->offset() != whole->data().size() || piece->data().empty() ||
        piece->bytes_total() != whole->bytes_total()) {
      return base::Status(base::StatusCode::malformed, "a piece of another snapshot");
    }
    whole->mutable_data()->append(piece->data());
  }
  if (whole.ok() && whole->data().size() != whole->bytes_total()) {
    return base::Status(base::StatusCode::malformed, "a snapshot of another length than it says");
  }
  return whole;
}

base::Result<v1::Done> Client::restore_world(const v1::RestoreWorld& request) {
  ClientMessage message;
  *message.mutable_restore_world() = request;
  return take_done(call(std::move(message), replay_timeout));
}

base::Result<v1::Done> Client::branch_world(const v1::BranchWorld& request) {
  ClientMessage message;
  *message.mutable_branch_world() = request;
  return take_done(call(std::move(message), replay_timeout));
}

base::Result<v1::Done> Client::rewind_world(const std::string& world, std::uint64_t tick) {
  ClientMessage request;
  request.mutable_rewind_world()->set_world(world);
  request.mutable_rewind_world()->set_tick(tick);
  return take_done(call(std::move(request), replay_timeout));
}

base::Result<v1::Stats> Client::stats(const std::string& world) {
  ClientMessage request;
  request.mutable_get_stats()->set_world(world);
  return take(call(std::move(request)), &ServerMessage::has_stats, &ServerMessage::mutable_stats);
}

base::Result<v1::SceneReply> Client::scene(const std::string& world) {
  ClientMessage request;
  request.mutable_get_scene()->set_world(world);
  return take(call(std::move(request)), &ServerMessage::has_scene, &ServerMessage::mutable_scene);
}

base::Result<std::chrono::nanoseconds> Client::ping() {
  constexpr std::uint64_t nonce = 0x70'6e'65'75'6d'61;
  ClientMessage request;
  request.mutable_ping()->set_nonce(nonce);
  const auto start = std::chrono::steady_clock::now();
  const auto pong = take(call(std::move(request)), &ServerMessage::has_pong, &ServerMessage::mutable_pong);
  if (!pong.ok()) return pong.status();
  if (pong->nonce() != nonce) return base::Status(base::StatusCode::malformed, "the pong of another ping");
  return std::chrono::nanoseconds(std::chrono::steady_clock::now() - start);
}

}  // namespace pneuma::client
