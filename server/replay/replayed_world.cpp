#include "replay/replayed_world.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/protocol.h"
#include "app/request_fields.h"
#include "app/stream_terms.h"
#include "app/world_clock.h"
#include "base/limits.h"
#include "base/number_text.h"

namespace pneuma::replay {

using base::Status;
using base::StatusCode;

namespace {

// What is added to a recording's error by encoding it again. A quarter costs two bits a coordinate.
constexpr double added_error_share = 0.25;

// A year: nobody waits longer for a frame, and a clock counts it.
constexpr double wait_max_s = 3.2e7;

// Of a long step, no more frames are made than a display shows in a second; they wait in memory until it is done.
constexpr std::uint64_t step_frames_max = 60;

}  // namespace

Status check_seek(const v1::Seek& seek, double duration_s) {
  const double time_s = seek.time_s();
  if (!std::isfinite(time_s)) return base::invalid("is not finite", "seek.time_s");
  if (time_s < 0.0) return base::invalid("must be 0 or more", "seek.time_s");
  if (time_s > duration_s) {
    return base::invalid("the recording ends at " + base::number_text(duration_s) + " s", "seek.time_s");
  }
  return {};
}

ReplayedWorld::ReplayedWorld(client::Playback playback, const PlayOptions& options, Wiring wiring)
    : name_(playback.header().world()),
      options_(options),
      duration_s_(playback.index().duration_s()),
      playback_(std::move(playback)),
      shown_(1.0 / playback_.header().world_rate_hz()),
      hub_(std::move(wiring.take_stream_id), std::move(wiring.drop_stream_id), std::move(wiring.defer)),
      paused_(options.paused),
      speed_(options.speed) {
  const v1::Subscribed& recorded = playback_.header().stream();
  hub_.set_source_error(recorded.max_error_m(), recorded.max_velocity_error_m_s());
}

Status ReplayedWorld::begin(TimePoint now) {
  return go_to(options_.start_s, now);
}

app::WorldStatus ReplayedWorld::status() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

double ReplayedWorld::play_time_s() const {
  const std::lock_guard lock(status_mutex_);
  return status_at_s_;
}

void ReplayedWorld::drain(TimePoint now, app::Outbox& outbox) {
  while (const std::optional<app::Command> command = inbox_.take()) {
    if (const auto* request = std::get_if<app::Request>(&*command)) {
      const Answer answer = carry_out(*request, now, outbox);
      const std::uint64_t id = request->message->request_id();
      outbox.send(request->session->id(), answer.ok() ? *answer : app::error_reply(id, answer.status()));
    }
    if (const auto* wanted = std::get_if<app::KeyWanted>(&*command)) {
      hub_.key_wanted(wanted->session, wanted->stream_id);
    }
    if (const auto* stalled = std::get_if<app::StreamStalled>(&*command)) {
      hub_.stream_stalled(stalled->session, stalled->stream_id);
    }
    if (const auto* read = std::get_if<app::ReaderReported>(&*command)) {
      hub_.reader_report(read->session, read->report);
    }
    if (const auto* ended = std::get_if<app::SessionEnded>(&*command)) hub_.session_ended(ended->session);
  }
  // Nobody has to wait for a next frame that does not come, nor to see what a seek has found.
  if (moved_ || !due()) show_at_rest(outbox);
  publish_status(now);
}

void ReplayedWorld::show_at_rest(app::Outbox& outbox) {
  if (std::exchange(moved_, false)) hub_.edited();
  hub_.encode_rest(shown_, tick(), outbox);
}

std::optional<ReplayedWorld::TimePoint> ReplayedWorld::due() const {
  if (paused_ || (!next_ && !options_.loop)) return std::nullopt;
  // The last frame is shown for a period before the first one comes again.
  const double at_s = next_ ? next_->at_s : shown_at_s_ + shown_.tick_period_s();
  const std::chrono::duration<double> since_start(std::min((at_s - clock_start_s_) / speed_, wait_max_s));
  return clock_start_ + std::chrono::duration_cast<TimePoint::duration>(since_start);
}

void ReplayedWorld::play(TimePoint now, app::Outbox& outbox) {
  const auto due_at = due();
  if (!due_at || now < *due_at) return;
  if (next_) {
    advance(outbox);
    hub_.encode_tick(shown_, tick(), false, outbox);
    if (now - *due_at > app::WorldClock::catch_up_max) start_clock(now, shown_at_s_);
  } else {
    if (const Status found = go_to(0.0, now); !found.ok()) return halt(found);
    show_at_rest(outbox);
  }
  publish_status(now);
}

/// The file is not what it was.
void ReplayedWorld::halt(const Status& why) {
  spdlog::error("the recording ends here: {}", why.message());
  next_.reset();
  paused_ = true;
}

void ReplayedWorld::start_clock(TimePoint now, double at_s) {
  clock_start_ = now;
  clock_start_s_ = at_s;
}

void ReplayedWorld::read_on() {
  next_.reset();
  before_next_.clear();
  while (!next_) {
    auto recorded = playback_.next();
    if (!recorded.ok()) return halt(recorded.status());
    if (!*recorded) return;
    if (auto* frame = std::get_if<client::RecordedFrame>(&**recorded)) {
      next_ = std::move(*frame);
    } else {
      before_next_.push_back(std::move(**recorded));
    }
  }
}

void ReplayedWorld::advance(app::Outbox& outbox) {
  for (const client::Recorded& happened : before_next_) {
    if (const auto* applied = std::get_if<v1::Applied>(&happened)) {
      hub_.applied({applied->tick(), applied->command(), applied->session_id(), applied->grab_id()}, outbox);
    }
    // Those of a stream's rate and of a world's end are of what was there then.
    const auto* event = std::get_if<v1::Event>(&happened);
    if (event == nullptr || event->stream_id() != 0 || event->kind() == v1::Event::WORLD_DESTROYED) continue;
    v1::ServerMessage message;
    *message.mutable_event() = *event;
    hub_.send_to_all(message, outbox);
  }
  if (shown_.show(std::move(next_->frame))) hub_.edited();
  shown_at_s_ = next_->at_s;
  read_on();
}

Status ReplayedWorld::go_to(double at_s, TimePoint now) {
  if (Status found = playback_.seek(at_s); !found.ok()) return found;
  read_on();
  if (!next_) return {StatusCode::internal, "the recording cannot be read there"};
  shown_.show(std::move(next_->frame));
  shown_at_s_ = next_->at_s;
  moved_ = true;
  read_on();
  start_clock(now, shown_at_s_);
  publish_status(now);
  return {};
}

v1::ServerMessage ReplayedWorld::done(const v1::ClientMessage& message) const {
  return app::done_reply(message.request_id(), tick(), name_);
}

ReplayedWorld::Answer ReplayedWorld::carry_out(const app::Request& request, TimePoint now, app::Outbox& outbox) {
  const v1::ClientMessage& message = *request.message;
  switch (message.request_case()) {
    case v1::ClientMessage::kSubscribe:
      return subscribe(request);
    case v1::ClientMessage::kUnsubscribe:
      if (!hub_.unsubscribe(request.session->id(), message.unsubscribe().stream_id(), outbox)) {
        return base::not_found("this session has no such stream", "unsubscribe.stream_id");
      }
      return done(message);
    case v1::ClientMessage::kRequestKey:
      if (!hub_.request_key(request.session->id(), message.request_key().stream_id())) {
        return base::not_found("this session has no such stream", "request_key.stream_id");
      }
      return done(message);
    case v1::ClientMessage::kPause:
      paused_ = true;
      return done(message);
    case v1::ClientMessage::kResume:
      return resume(message, now);
    case v1::ClientMessage::kStep:
      return step(message, outbox);
    case v1::ClientMessage::kReset:
      if (Status found = go_to(0.0, now); !found.ok()) return found;
      hub_.send_to_all(app::event_message(v1::Event::WORLD_RESET, name_, tick()), outbox);
      return done(message);
    case v1::ClientMessage::kSeek: {
      if (Status wrong = check_seek(message.seek(), duration_s_); !wrong.ok()) return wrong;
      if (Status found = go_to(message.seek().time_s(), now); !found.ok()) return found;
      return done(message);
    }
    case v1::ClientMessage::kGetStats:
      return stats(request);
    case v1::ClientMessage::kGetScene: {
      v1::ServerMessage reply;
      reply.set_request_id(message.request_id());
      *reply.mutable_scene()->mutable_scene() = playback_.header().scene();
      reply.mutable_scene()->set_tick(tick());
      return reply;
    }
    case v1::ClientMessage::kGetState:
    case v1::ClientMessage::kRaycast:
    case v1::ClientMessage::kNearestPoint:
    case v1::ClientMessage::kBodiesInBox:
      return Status(StatusCode::failed_precondition, name_ + " is a recording that is played: it has frames alone",
                    std::string(app::kind_of(message)) + ".world");
    default:
      return Status(StatusCode::failed_precondition, name_ + " is a recording that is played: it cannot be changed",
                    std::string(app::kind_of(message)));
  }
}

// The recording's frames are within its own error already; the stream adds what is left of the bound asked for.
ReplayedWorld::Answer ReplayedWorld::subscribe(const app::Request& request) {
  const v1::Subscribed& recorded = playback_.header().stream();
  v1::Subscribe asked = request.message->subscribe();
  const double recorded_error_m = recorded.max_error_m();
  const double least_m = std::max(added_error_share * recorded_error_m, base::max_error_min_m);
  const double left_m = asked.max_error_m() == 0.0 ? least_m : asked.max_error_m() - recorded_error_m;
  if (left_m < least_m * (1.0 - 1e-9)) {
    return Status(StatusCode::limit_exceeded,
                  "was recorded within " + base::number_text(recorded_error_m) + " m; can be had within " +
                      base::number_text(recorded_error_m + least_m),
                  "subscribe.max_error_m");
  }
  if (Status lacks = app::check_subscribed(asked, shown_); !lacks.ok()) return lacks;
  const bool is_exact = asked.encoding() == v1::Subscribe::PLAIN && asked.max_error_m() == 0.0;
  if (!is_exact) asked.set_max_error_m(left_m);
  // A whole division of the recording's rate, not of the world's alone.
  if (asked.rate_hz() > 0.0 && std::isfinite(asked.rate_hz())) {
    asked.set_rate_hz(recorded.rate_hz() / std::max(1.0, std::round(recorded.rate_hz() / asked.rate_hz())));
  } else if (asked.rate_hz() == 0.0) {
    asked.set_rate_hz(recorded.rate_hz());
  }
  auto subscribed = hub_.subscribe(request.session, asked, playback_.header().world_rate_hz());
  if (!subscribed.ok()) return subscribed.status();
  v1::ServerMessage reply;
  reply.set_request_id(request.message->request_id());
  *reply.mutable_subscribed() = std::move(*subscribed);
  return reply;
}

ReplayedWorld::Answer ReplayedWorld::resume(const v1::ClientMessage& message, TimePoint now) {
  if (Status wrong = app::check_time_scale(message.resume()); !wrong.ok()) return wrong;
  if (!next_) {  // from the end, to the start
    if (Status found = go_to(0.0, now); !found.ok()) return found;
  }
  // Between two frames play time goes on from where it is: many changes of speed in a row would stop it otherwise.
  const std::chrono::duration<double> since_start = now - clock_start_;
  start_clock(now, paused_ ? shown_at_s_ : clock_start_s_ + speed_ * since_start.count());
  if (message.resume().has_time_scale()) speed_ = message.resume().time_scale();
  paused_ = false;
  return done(message);
}

ReplayedWorld::Answer ReplayedWorld::step(const v1::ClientMessage& message, app::Outbox& outbox) {
  const std::uint32_t ticks = message.step().ticks();
  if (!paused_) return Status(StatusCode::failed_precondition, "the recording plays; pause it first", "step.world");
  if (ticks == 0) return base::invalid("must be 1 or more", "step.ticks");
  if (ticks > base::step_ticks_max) {
    return Status(StatusCode::limit_exceeded,
                  "is " + std::to_string(ticks) + "; may be at most " + std::to_string(base::step_ticks_max),
                  "step.ticks");
  }
  const std::uint64_t until = tick() + ticks;
  std::uint64_t encoded = 0;
  // A tick has one frame at most, whatever a file says.
  for (std::uint32_t frames = 0; frames < ticks && next_ && next_->frame.tick <= until; ++frames) {
    advance(outbox);
    if (until - tick() >= step_frames_max || encoded == step_frames_max) continue;
    hub_.encode_tick(shown_, tick(), false, outbox);
    ++encoded;
  }
  if (tick() < until && !next_) {
    return Status(StatusCode::failed_precondition, "the recording ends at tick " + std::to_string(tick()),
                  "step.ticks");
  }
  return done(message);
}

void ReplayedWorld::close(const Status& why, app::Outbox& outbox) {
  inbox_.close();
  while (const std::optional<app::Command> command = inbox_.take()) {
    const auto* request = std::get_if<app::Request>(&*command);
    if (request != nullptr) {
      outbox.send(request->session->id(), app::error_reply(request->message->request_id(), why));
    }
  }
}

/// Of one that has a frame: begin() fails otherwise.
v1::WorldList::Recording ReplayedWorld::recording() const {
  const v1::RecordingIndex& index = playback_.index();
  v1::WorldList::Recording recording;
  recording.set_duration_s(duration_s_);
  recording.set_first_tick(index.keys(0).tick());
  recording.set_last_tick(index.last_tick());
  recording.set_velocities(playback_.header().stream().velocity_grid_step_m_s() > 0.0);
  return recording;
}

void ReplayedWorld::publish_status(TimePoint now) {
  const client::DecodedFrame& frame = shown_.frame();
  app::WorldStatus status;
  v1::WorldList::World& listing = status.listing;
  listing.set_name(name_);
  listing.set_scene_name(playback_.header().scene().name());
  listing.set_tick(frame.tick);
  listing.set_time_s(frame.time_s);
  listing.set_paused(!due());
  listing.set_time_scale(speed_);
  listing.set_soft_bodies(static_cast<std::uint32_t>(frame.bodies.size()));
  std::size_t vertices = 0;
  for (const client::SoftBodyFrame& body : frame.bodies) vertices += body.positions_m.size() / 3;
  listing.set_vertices(static_cast<std::uint32_t>(vertices));
  listing.set_rigid_bodies(
      static_cast<std::uint32_t>(std::ranges::count_if(frame.solids, &client::SolidFrame::dynamic)));
  listing.set_rate_hz(playback_.header().world_rate_hz());
  listing.set_subscribers(static_cast<std::uint32_t>(hub_.subscriber_count()));
  *listing.mutable_recording() = recording();
  status.last_active = now;
  const std::lock_guard lock(status_mutex_);
  status_ = std::move(status);
  status_at_s_ = shown_at_s_;
}

// What frames tell: of forces, energies and gas they know nothing.
v1::ServerMessage ReplayedWorld::stats(const app::Request& request) const {
  const client::DecodedFrame& frame = shown_.frame();
  v1::ServerMessage message;
  message.set_request_id(request.message->request_id());
  v1::Stats& out = *message.mutable_stats();
  out.set_world(name_);
  out.set_tick(frame.tick);
  out.set_time_s(frame.time_s);
  out.set_paused(!due());
  out.set_time_scale(speed_);
  out.set_rate_hz(playback_.header().world_rate_hz());
  out.set_subscribers(static_cast<std::uint32_t>(hub_.subscriber_count()));
  out.set_quality_classes(static_cast<std::uint32_t>(hub_.class_count()));
  out.set_frame_bytes_s(hub_.frame_bytes_s());
  hub_.describe_streams(request.session->id(), request.reader, out.rate_hz(), out);
  return message;
}

}  // namespace pneuma::replay
