// What each request does to a world, between two of its ticks.
#include <exception>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/hosted_world.h"
#include "app/log.h"
#include "app/protocol.h"
#include "app/request_fields.h"
#include "app/step_goal.h"
#include "app/stream_terms.h"
#include "app/world_queries.h"
#include "app/world_state.h"
#include "app/world_stats.h"
#include "base/limits.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

Status no_such_grab(std::uint64_t grab_id, const std::string& field) {
  return base::not_found("this session holds no grab " + std::to_string(grab_id), field);
}

v1::ServerMessage reply_to(const v1::ClientMessage& message) {
  v1::ServerMessage reply;
  reply.set_request_id(message.request_id());
  return reply;
}

}  // namespace

void HostedWorld::answer(const Request& request, TimePoint now, Outbox& outbox) {
  std::optional<Answer> answer;
  // No request ends the server, whatever a library makes of it.
  try {
    answer = carry_out(request, now, outbox);
  } catch (const std::exception& error) {
    spdlog::error("world={} session={} {} threw: {}", log_name(name_), request.session->id(), kind_of(*request.message),
                  error.what());
    answer = Status(StatusCode::internal, "the server failed at this request");
  }
  if (!answer) return;
  if (!answer->ok()) return refuse(request, answer->status(), outbox);
  wiring_.metrics->count_command(kind_of(*request.message), "ok");
  outbox.send(request.session->id(), **answer);
}

void HostedWorld::refuse(const Request& request, const Status& why, Outbox& outbox) {
  const double hint_s = why.code() == StatusCode::unavailable ? retry_hint_s : 0.0;
  const v1::ServerMessage reply = error_reply(request.message->request_id(), why, hint_s);
  wiring_.metrics->count_command(kind_of(*request.message), v1::Error::Code_Name(reply.error().code()));
  outbox.send(request.session->id(), reply);
}

std::optional<HostedWorld::Answer> HostedWorld::carry_out(const Request& request, TimePoint now, Outbox& outbox) {
  const v1::ClientMessage& message = *request.message;
  switch (message.request_case()) {
    case v1::ClientMessage::kSubscribe: {
      Status lacks = check_subscribed(message.subscribe(), LiveFrames(live_.physics()));
      if (lacks.ok()) lacks = check_touch_wish(live_.physics(), message.subscribe().touches());
      if (!lacks.ok()) return Answer(std::move(lacks));
      auto subscribed = hub_.subscribe(request.session, message.subscribe(), 1.0 / live_.physics().tick_period_s(),
                                       [this](double bytes) { return memory_.admit_stream(bytes); });
      if (!subscribed.ok()) return Answer(subscribed.status());
      v1::ServerMessage reply = reply_to(message);
      *reply.mutable_subscribed() = std::move(*subscribed);
      return Answer(std::move(reply));
    }
    case v1::ClientMessage::kUnsubscribe: {
      const std::uint32_t stream_id = message.unsubscribe().stream_id();
      if (!hub_.unsubscribe(request.session->id(), stream_id, outbox)) {
        return Answer(
            base::not_found("this session has no stream " + std::to_string(stream_id), "unsubscribe.stream_id"));
      }
      return Answer(done_reply(message.request_id(), live_.tick(), name_));
    }
    case v1::ClientMessage::kRequestKey: {
      const std::uint32_t stream_id = message.request_key().stream_id();
      if (!hub_.request_key(request.session->id(), stream_id)) {
        return Answer(
            base::not_found("this session has no stream " + std::to_string(stream_id), "request_key.stream_id"));
      }
      return Answer(done_reply(message.request_id(), live_.tick(), name_));
    }
    case v1::ClientMessage::kPause:
      return pause(request, outbox);
    case v1::ClientMessage::kResume:
      return resume(request, now, outbox);
    case v1::ClientMessage::kStep:
    case v1::ClientMessage::kStepUntil:
      return step_on(request, outbox);
    case v1::ClientMessage::kGetState:
    case v1::ClientMessage::kRaycast:
    case v1::ClientMessage::kNearestPoint:
    case v1::ClientMessage::kBodiesInBox:
      return answer_question(live_.physics(), message, name_, live_.tick());
    case v1::ClientMessage::kGetStats: {
      v1::ServerMessage reply = stats(request, now);
      return Answer(std::move(reply));
    }
    case v1::ClientMessage::kGetScene: {
      v1::ServerMessage reply = reply_to(message);
      *reply.mutable_scene()->mutable_scene() = live_.scene();
      reply.mutable_scene()->set_tick(live_.tick());
      return Answer(std::move(reply));
    }
    case v1::ClientMessage::kSeek:
      return Answer(
          Status(StatusCode::failed_precondition, "a live world has no past to go to; a recording has", "seek.world"));
    case v1::ClientMessage::kTakeSnapshot:
    case v1::ClientMessage::kBranchWorld:
      return look_back(request);
    case v1::ClientMessage::kRewindWorld:
      if (message.rewind_world().state().empty()) return look_back(request);
      return change(request, outbox);
    case v1::ClientMessage::kDestroyWorld:
      destroy(request, outbox);
      return std::nullopt;
    default:
      return change(request, outbox);
  }
}

HostedWorld::Answer HostedWorld::change(const Request& request, Outbox& outbox) {
  const v1::ClientMessage& message = *request.message;
  const net::SessionId session = request.session->id();
  const auto owns = [&](std::uint64_t grab_id) {
    const auto owner = grab_owners_.find(grab_id);
    return owner != grab_owners_.end() && owner->second == session;
  };
  if (message.has_move_grab() && !owns(message.move_grab().grab_id())) {
    return no_such_grab(message.move_grab().grab_id(), "move_grab.grab_id");
  }
  if (message.has_release_grab() && !owns(message.release_grab().grab_id())) {
    return no_such_grab(message.release_grab().grab_id(), "release_grab.grab_id");
  }
  if (!LiveWorld::is_change(message)) return Status(StatusCode::unsupported, "not a request to a world");
  if (message.has_set_state() && (!paused_ || !pending_steps_.empty())) {
    const char* what = paused_ ? "steps of the world wait; it must rest" : "the world runs; pause it first";
    return Status(StatusCode::failed_precondition, what, "set_state.world");
  }

  if (Status failed = write_ahead(message); !failed.ok()) return failed;
  const double period_before_s = live_.physics().tick_period_s();
  auto effect = live_.change(
      message, [this](const v1::Scene& source, const physics::Scene& scene) { return memory_.admit(source, scene); });
  memory_.settle(effect.ok(), live_.physics().integrator(), hub_.bytes_per_vertex());
  if (!effect.ok()) {
    if (journal_) journal_->take_back();
    return effect.status();
  }
  if (message.has_rewind_world()) {
    v1::ClientMessage told = message;
    told.mutable_rewind_world()->clear_state();
    hub_.applied({live_.tick(), told, session}, outbox);
  } else {
    hub_.applied({live_.tick(), message, session, effect->grabbed ? effect->grabbed->grab_id() : 0}, outbox);
  }
  if (effect->edited) hub_.edited();
  // An edit shows in a world at rest without a step; anything else, and in a world that runs, with the next tick.
  const std::uint64_t shown_from = effect->edited && paused_ && pending_steps_.empty() ? live_.tick() : next_tick();
  if (live_.physics().tick_period_s() != period_before_s) {
    hub_.rate_changed(name_, shown_from, 1.0 / live_.physics().tick_period_s(), outbox);
  }
  // Released, or gone with its body or its scene.
  std::erase_if(grab_owners_, [&](const auto& owner) { return !live_.grabs().contains(owner.first); });
  if (message.has_reset() || message.has_rewind_world()) {
    hub_.forget_touches();
    hub_.send_to_all(event_message(v1::Event::WORLD_RESET, name_, shown_from, {}, effect->detail), outbox);
  }
  if (effect->grabbed) {
    grab_owners_.emplace(effect->grabbed->grab_id(), session);
    v1::ServerMessage reply = reply_to(message);
    *reply.mutable_grabbed() = *effect->grabbed;
    reply.mutable_grabbed()->set_tick(next_tick());
    return reply;
  }
  return done_reply(message.request_id(), shown_from, name_, effect->detail, effect->mended);
}

HostedWorld::Answer HostedWorld::pause(const Request& request, Outbox& outbox) {
  const v1::ClientMessage& message = *request.message;
  if (!paused_) {
    if (Status failed = write_ahead(message); !failed.ok()) return failed;
    hub_.applied({live_.tick(), message, request.session->id()}, outbox);
  }
  end_steps({StatusCode::failed_precondition, "a pause ended it at tick " + std::to_string(live_.tick())}, outbox);
  paused_ = true;
  return done_reply(message.request_id(), live_.tick(), name_);
}

HostedWorld::Answer HostedWorld::resume(const Request& request, TimePoint now, Outbox& outbox) {
  const v1::ClientMessage& message = *request.message;
  if (halted_)
    return Status(StatusCode::failed_precondition, "the world was halted by a fault; destroy it", "resume.world");
  if (Status wrong = check_time_scale(message.resume()); !wrong.ok()) return wrong;
  const double time_scale = message.resume().has_time_scale() ? message.resume().time_scale() : time_scale_;
  if (paused_ || time_scale != time_scale_) {
    if (Status failed = write_ahead(message); !failed.ok()) return failed;
    hub_.applied({live_.tick(), message, request.session->id()}, outbox);
  }
  end_steps({StatusCode::failed_precondition, "a resume ended it at tick " + std::to_string(live_.tick())}, outbox);
  time_scale_ = time_scale;
  if (paused_) clock_.start(now);
  paused_ = false;
  return done_reply(message.request_id(), next_tick(), name_);
}

const v1::Observe* HostedWorld::PendingStep::observe() const {
  if (message == nullptr) return nullptr;
  if (message->step().has_observe()) return &message->step().observe();
  return message->step_until().has_observe() ? &message->step_until().observe() : nullptr;
}

const v1::StepUntil* HostedWorld::PendingStep::until() const {
  return message != nullptr && message->has_step_until() ? &message->step_until() : nullptr;
}

std::optional<HostedWorld::Answer> HostedWorld::step_on(const Request& request, Outbox& outbox) {
  const v1::ClientMessage& message = *request.message;
  PendingStep step{.session = request.session,
                   .request_id = message.request_id(),
                   .ticks_left = message.has_step() ? message.step().ticks() : message.step_until().ticks_max(),
                   .kind = kind_of(message)};
  if (message.has_step_until() || message.step().has_observe()) step.message = request.message;
  if (Status wrong = check_step(step); !wrong.ok()) return Answer(std::move(wrong));
  pending_steps_.push_back(std::move(step));
  end_passed_steps(outbox);
  return std::nullopt;  // answered there, or in end_tick
}

void HostedWorld::end_passed_steps(Outbox& outbox) {
  while (!pending_steps_.empty()) {
    PendingStep& step = pending_steps_.front();
    const v1::StepUntil* until = step.until();
    if (until == nullptr || !until->has_tick() || until->tick() > live_.tick()) return;
    step.reached = true;
    outbox.send(step.session->id(), stepped(step));
    pending_steps_.pop_front();
  }
}

Status HostedWorld::check_step(const PendingStep& step) const {
  const std::string kind(step.kind);
  if (halted_) {
    return {StatusCode::failed_precondition, "the world was halted by a fault; destroy it", kind + ".world"};
  }
  if (!paused_) return {StatusCode::failed_precondition, "the world runs; pause it first", kind + ".world"};
  const std::string ticks_field = kind + (step.until() != nullptr ? ".ticks_max" : ".ticks");
  if (step.ticks_left == 0) return base::invalid("must be 1 or more", ticks_field);
  std::uint64_t waiting = 0;
  for (const PendingStep& pending : pending_steps_) waiting += pending.ticks_left;
  if (waiting + step.ticks_left > base::step_ticks_max) {
    return {StatusCode::limit_exceeded,
            "is " + std::to_string(step.ticks_left) + ", and " + std::to_string(waiting) +
                " ticks wait; may be at most " + std::to_string(base::step_ticks_max) + " in all",
            ticks_field};
  }
  if (step.until() != nullptr) {
    if (Status wrong = check_goal(live_.physics(), *step.until()); !wrong.ok()) return wrong;
  }
  if (step.observe() == nullptr) return {};
  const Status wrong = check_observed(live_.physics(), *step.observe());
  return wrong.ok() ? wrong : wrong.inside(kind + ".observe");
}

Status HostedWorld::check_past(std::uint64_t tick, const std::string& field) const {
  if (tick > live_.tick()) {
    return base::invalid(
        "is " + std::to_string(tick) + "; the world has done " + std::to_string(live_.tick()) + " ticks", field);
  }
  if (!journal_)
    return {
        StatusCode::failed_precondition,
        "nothing is kept of this world: the server was started without --data-dir, or the world is owned by a session",
        field};
  return {};
}

std::optional<HostedWorld::Answer> HostedWorld::look_back(const Request& request) {
  const v1::ClientMessage& message = *request.message;
  const std::string kind(kind_of(message));
  if (!wiring_.look_back) return Answer(Status(StatusCode::unsupported, "not a request to this world", kind));
  if (halted_)
    return Answer(Status(StatusCode::failed_precondition, "the world was halted by a fault", kind + ".world"));
  Status wrong;
  if (message.has_rewind_world()) wrong = check_past(message.rewind_world().tick(), kind + ".tick");
  if (message.branch_world().has_tick()) wrong = check_past(message.branch_world().tick(), kind + ".tick");
  if (wrong.ok()) {
    wrong = wiring_.look_back(request, [this] {
      return WorldMoment{{live_.save(), paused_},
                         live_.physics().state_hash(),
                         journal_ ? journal_->log_end() : std::nullopt,
                         journal_ ? journal_->first_checkpoint() : 0};
    });
  }
  if (!wrong.ok()) return Answer(std::move(wrong));
  return std::nullopt;
}

void HostedWorld::destroy(const Request& request, Outbox& outbox) {
  destroyed_by_ = request;
  hub_.send_to_all(event_message(v1::Event::WORLD_DESTROYED, name_, live_.tick()), outbox);
  hub_.close(outbox);
  close(base::not_found("no world " + name_ + ": it was destroyed"), outbox);
}

void HostedWorld::close(const Status& why, Outbox& outbox) {
  end_steps(why, outbox);
  inbox_.close();
  while (const std::optional<Command> command = inbox_.take()) {
    if (const auto* request = std::get_if<Request>(&*command)) refuse(*request, why, outbox);
  }
}

void HostedWorld::end_steps(const Status& why, Outbox& outbox) {
  if (pending_steps_.empty()) return;
  if (journal_) (void)journal_->note_tick(live_.tick());  // no tick of theirs is acknowledged as done
  for (const PendingStep& pending : pending_steps_) {
    outbox.send(pending.session->id(), error_reply(pending.request_id, why.inside(std::string(pending.kind))));
  }
  pending_steps_.clear();
}

void HostedWorld::session_ended(net::SessionId session, Outbox& outbox) {
  hub_.session_ended(session);
  const auto dropped =
      std::erase_if(pending_steps_, [&](const PendingStep& pending) { return pending.session->id() == session; });
  if (dropped > 0 && journal_) (void)journal_->note_tick(live_.tick());
  for (auto grab = grab_owners_.begin(); grab != grab_owners_.end();) {
    if (grab->second != session) {
      ++grab;
      continue;
    }
    release(grab->first, outbox);
    grab = grab_owners_.erase(grab);
  }
}

void HostedWorld::release(std::uint64_t grab_id, Outbox& outbox) {
  v1::ClientMessage message;
  message.mutable_release_grab()->set_world(name_);
  message.mutable_release_grab()->set_grab_id(grab_id);
  // Nobody asks for it who could be refused: what cannot be written is done all the same.
  const bool kept = write_ahead(message).ok();
  if (live_.change(message).ok()) {
    hub_.applied({live_.tick(), message}, outbox);
    if (!kept) journal_->lost_a_change();
  } else if (kept && journal_) {
    journal_->take_back();
  }
}

// What is acknowledged is written, and what is not written is not done.
Status HostedWorld::write_ahead(const v1::ClientMessage& message) {
  if (!journal_) return {};
  const Status failed = journal_->write(live_.tick(), message);
  if (failed.ok()) return {};
  return {StatusCode::unavailable, "the server cannot keep it, so it was not done: " + failed.message(),
          std::string(kind_of(message))};
}

v1::ServerMessage HostedWorld::stats(const Request& request, TimePoint now) const {
  v1::ServerMessage message = reply_to(*request.message);
  v1::Stats& out = *message.mutable_stats();
  describe(live_.physics(), out);
  const TickSummary summary = window_.summary(now);
  out.set_world(name_);
  out.set_tick(live_.tick());
  out.set_paused(paused_);
  out.set_time_scale(time_scale_);
  out.set_time_ratio(summary.time_ratio);
  out.set_slipped_s(slipped_s_);
  out.set_step_time_ms(summary.step_ms_median);
  out.set_step_time_max_ms(summary.step_ms_max);
  out.set_encode_time_ms(summary.encode_ms_median);
  out.set_due_error_ms_p99(summary.due_error_ms_p99);
  out.set_frame_bytes_s(hub_.frame_bytes_s());
  out.set_subscribers(static_cast<std::uint32_t>(hub_.subscriber_count()));
  out.set_quality_classes(static_cast<std::uint32_t>(hub_.class_count()));
  hub_.describe_streams(request.session->id(), request.reader, out.rate_hz(), out);
  return message;
}

}  // namespace pneuma::app
