#include "app/hosted_world.h"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

#include "app/log.h"
#include "app/protocol.h"
#include "app/step_goal.h"
#include "app/world_state.h"
#include "base/limits.h"
#include "base/number_text.h"

namespace pneuma::app {

namespace {

// A tick that takes longer holds up the end of its world no more: a scene may ask for minutes of work a tick.
constexpr std::chrono::seconds long_tick{1};

// A slow world says so, but not at every tick.
constexpr std::chrono::seconds slow_event_interval{5};
// Of a running world's time, for requests that look at its bodies: one of 0.3 s comes once in 1.2 s.
constexpr double looks_share = 0.25;

double ms_between(HostedWorld::TimePoint from, HostedWorld::TimePoint to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

std::uint32_t vertex_count(const physics::World& world) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) count += world.soft_body(i).mesh->positions_m.size();
  return static_cast<std::uint32_t>(count);
}

std::uint32_t frozen_count(const physics::World& world) {
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) count += world.is_frozen(i) ? 1 : 0;
  for (const physics::RigidState& body : world.rigid_bodies()) count += body.frozen ? 1 : 0;
  return count;
}

}  // namespace

HostedWorld::HostedWorld(std::string name, LiveWorld live, bool paused, std::unique_ptr<WorldJournal> journal,
                         Wiring wiring, WorldRoom room)
    : name_(std::move(name)),
      wiring_(std::move(wiring)),
      live_(std::move(live)),
      memory_(std::move(room.memory)),
      time_(std::move(room.time)),
      hub_(wiring_.take_stream_id, wiring_.drop_stream_id, wiring_.defer),
      journal_(std::move(journal)),
      paused_(paused),
      looks_(looks_share) {
  // The sessions that held the grabs of a restored world are gone.
  const LiveWorld::Grabs grabs = live_.grabs();
  Outbox nobody;
  for (const auto& [id, body] : grabs) release(id, nobody);
  const TimePoint now = std::chrono::steady_clock::now();
  clock_.start(now);
  publish_status(now);
}

WorldStatus HostedWorld::status() const {
  const std::lock_guard lock(status_mutex_);
  return status_;
}

void HostedWorld::drain(TimePoint now, TimePoint until, Outbox& outbox) {
  const bool held_back = is_held_back(now);
  if (mid_tick_ || held_back) {
    if (!held_back && now - tick_began_ < long_tick) return;
    if (const std::optional<Request> end = inbox_.take_destroy()) destroy(*end, outbox);
    return;
  }
  bool had_commands = false;
  const auto share_is_used_up = [&] {
    return std::chrono::steady_clock::now() >= until || outbox.bytes >= base::drain_reply_bytes_max;
  };
  looks_wait_ = false;
  while (!(had_its_share_ = share_is_used_up())) {
    const TimePoint start = std::chrono::steady_clock::now();
    const bool lets_look = is_idle() || looks_.ready_at(start) <= start;
    const std::optional<Command> command =
        inbox_.take(lets_look ? Inbox::Leave::nothing : Inbox::Leave::looks_at_bodies);
    if (!command) {
      looks_wait_ = !lets_look && !inbox_.is_empty();
      break;
    }
    had_commands = true;
    if (const auto* request = std::get_if<Request>(&*command)) {
      answer(*request, now, outbox);
      if (looks_at_bodies(request->message->request_case())) {
        const TimePoint end = std::chrono::steady_clock::now();
        looks_.spend(end, end - start);
      }
    }
    if (const auto* wanted = std::get_if<KeyWanted>(&*command)) hub_.key_wanted(wanted->session, wanted->stream_id);
    if (const auto* stalled = std::get_if<StreamStalled>(&*command)) {
      hub_.stream_stalled(stalled->session, stalled->stream_id);
    }
    if (const auto* read = std::get_if<ReaderReported>(&*command)) hub_.reader_report(read->session, read->report);
    if (const auto* ended = std::get_if<SessionEnded>(&*command)) session_ended(ended->session, outbox);
  }
  if (destroyed_by_) return;
  if (is_idle()) hub_.encode_rest(LiveFrames(live_.physics()), live_.tick(), outbox);
  if (had_commands) {
    memory_.settle(false, live_.physics().integrator(), hub_.bytes_per_vertex());
    publish_status(now);
  }
}

bool HostedWorld::tick_due(TimePoint now) const {
  if (halted_ || destroyed_by_ || time_.ready_at(now) > now) return false;
  return mid_tick_ || !pending_steps_.empty() || (!paused_ && now >= clock_.due());
}

bool HostedWorld::step(const std::function<bool()>& give_way) {
  const TimePoint start = std::chrono::steady_clock::now();
  if (!mid_tick_) {
    sample_ = {};
    tick_began_ = start;
    live_.physics().note_contacts(hub_.wants_contacts() || hub_.wants_touches() || awaits_touch());
  }
  mid_tick_ = true;
  do {
    mid_tick_ = !live_.physics().substep(workers_);
  } while (mid_tick_ && !give_way());
  const TimePoint end = std::chrono::steady_clock::now();
  sample_.step_ms += ms_between(start, end);
  const std::lock_guard lock(status_mutex_);
  status_.last_active = end;
  return !mid_tick_;
}

void HostedWorld::encode(Outbox& outbox) {
  const TimePoint start = std::chrono::steady_clock::now();
  if (!pending_steps_.empty() && pending_steps_.front().until() != nullptr) {
    PendingStep& step = pending_steps_.front();
    step.reached = is_reached(live_.physics(), live_.tick(), *step.until());
    if (step.reached) step.ticks_left = 1;
  }
  // The last tick of a step request shows the world at rest, whatever the subscriber's rate.
  const bool last_of_step = paused_ && pending_steps_.size() == 1 && pending_steps_.front().ticks_left == 1;
  hub_.encode_tick(LiveFrames(live_.physics()), live_.tick(), last_of_step, outbox);
  if (hub_.wants_touches()) hub_.tell_touches(TickTouches(live_.physics()), live_.tick(), outbox);
  sample_.encode_ms = ms_between(start, std::chrono::steady_clock::now());
  send_events(outbox);
}

bool HostedWorld::awaits_touch() const {
  const v1::StepUntil* until = pending_steps_.empty() ? nullptr : pending_steps_.front().until();
  return until != nullptr && until->has_touch();
}

v1::ServerMessage HostedWorld::stepped(const PendingStep& step) const {
  v1::ServerMessage reply = done_reply(step.request_id, live_.tick(), name_);
  if (step.until() != nullptr) reply.mutable_done()->set_reached(step.reached);
  // An edit may have come between its ticks: what is too large since is not told, the ticks are done all the same.
  const v1::Observe* observed = step.observe();
  if (observed != nullptr && observed_bytes(live_.physics(), *observed) <= base::state_bytes_max) {
    *reply.mutable_done()->mutable_state() = state_of(live_.physics(), *observed, name_, live_.tick());
  }
  return reply;
}

void HostedWorld::send_events(Outbox& outbox) {
  for (const physics::FrozenBody& frozen : live_.physics().take_frozen()) {
    spdlog::warn("world={} body={} tick={} frozen: {}", log_name(name_), log_name(frozen.name), live_.tick(),
                 frozen.reason);
    hub_.send_to_all(event_message(v1::Event::BODY_FROZEN, name_, live_.tick(), frozen.name, frozen.reason), outbox);
  }
  for (const physics::BodyGasEvent& happened : live_.physics().take_gas_events()) {
    const bool burst = happened.event.kind == physics::GasEvent::Kind::burst;
    if (burst) hub_.mechanics_changed();
    const std::string what = physics::describe(happened.event);
    spdlog::warn("world={} body={} tick={} {}: {}", log_name(name_), log_name(happened.name), live_.tick(),
                 burst ? "burst" : "inverted", what);
    hub_.send_to_all(event_message(burst ? v1::Event::BODY_BURST : v1::Event::BODY_INVERTED, name_, live_.tick(),
                                   happened.name, what),
                     outbox);
  }
  for (const physics::BrokenJoint& broken : live_.physics().take_broken_joints()) {
    const std::string what = "it takes at most " + base::number_text(broken.break_force_n) + " N";
    spdlog::info("world={} joint={} tick={} broken: {}", log_name(name_), log_name(broken.name), live_.tick(), what);
    v1::ServerMessage message = event_message(v1::Event::JOINT_BROKEN, name_, live_.tick(), {}, what);
    message.mutable_event()->set_joint(broken.name);
    hub_.send_to_all(message, outbox);
    hub_.edited();
  }
}

void HostedWorld::end_tick(TimePoint now, Outbox& outbox) {
  wiring_.metrics->ticks.Increment();
  wiring_.metrics->step_seconds.Observe(1e-3 * sample_.step_ms);
  wiring_.metrics->encode_seconds.Observe(1e-3 * sample_.encode_ms);

  if (!pending_steps_.empty()) {
    PendingStep& pending = pending_steps_.front();
    if (--pending.ticks_left == 0) {
      const base::Status kept = journal_ ? journal_->note_tick(live_.tick()) : base::Status();
      if (kept.ok()) {
        outbox.send(pending.session->id(), stepped(pending));
      } else {
        const std::string what = "the world is at tick " + std::to_string(live_.tick()) + ", which cannot be kept: ";
        outbox.send(pending.session->id(),
                    error_reply(pending.request_id,
                                {base::StatusCode::unavailable, what + kept.message(), std::string(pending.kind)}));
      }
      pending_steps_.pop_front();
      end_passed_steps(outbox);
      if (pending_steps_.empty()) clock_.start(now);
    }
    publish_status(now);
    return;
  }

  sample_.period_s = live_.physics().tick_period_s() / time_scale_;
  sample_.due_error_ms = ms_between(clock_.due(), now);
  const auto period = std::chrono::duration_cast<WorldClock::Duration>(std::chrono::duration<double>(sample_.period_s));
  sample_.slipped_s = std::chrono::duration<double>(clock_.tick_ended(now, period)).count();
  slipped_s_ += sample_.slipped_s;
  window_.add(now, sample_);
  if (sample_.slipped_s > 0.0) {
    wiring_.metrics->slipped_seconds.Increment(sample_.slipped_s);
    if (now - last_slow_event_ > slow_event_interval) {
      last_slow_event_ = now;
      const double ratio = window_.summary(now).time_ratio;
      const bool was_held_back = now - last_held_back_ <= slow_event_interval;
      const std::string why = was_held_back ? "; " + held_back_by_ : std::string();
      spdlog::warn("world={} tick={} slowed time_ratio={:.3f} slipped_s={:.3f}{}", log_name(name_), live_.tick(), ratio,
                   slipped_s_, why);
      hub_.send_to_all(event_message(v1::Event::WORLD_SLOWED, name_, live_.tick(), {},
                                     "simulated over real time: " + base::number_text(ratio * time_scale_) + why),
                       outbox);
    }
  }
  publish_status(now);
}

void HostedWorld::checkpoint(TimePoint now, bool force) {
  if (!journal_ || mid_tick_ || halted_) return;
  journal_->sync_if_due(now);
  if (force || journal_->checkpoint_due(now, live_.tick())) journal_->checkpoint(now, live_.save(), paused_);
  const std::lock_guard lock(status_mutex_);
  describe_keeping(status_);
}

void HostedWorld::describe_keeping(WorldStatus& status) const {
  if (!journal_) return;
  status.disk_trouble = journal_->trouble().message();
  status.behind_checkpoint_of = journal_->behind_checkpoint_of(live_.tick());
}

// Looked at where a slice ends too: the next one begins only when there is time again.
void HostedWorld::spend(TimePoint now, TimeBudget::Duration used) {
  time_.spend(now, used);
  (void)is_held_back(now);
}

bool HostedWorld::is_held_back(TimePoint now) {
  const bool is_held_back = time_.ready_at(now) > now;
  if (is_held_back) {
    held_back_by_ = time_.describe(now);
    last_held_back_ = now;
    if (!held_back_since_) held_back_since_ = now;
  } else if (held_back_since_) {
    wiring_.metrics->held_back_seconds.Increment(1e-3 * ms_between(*held_back_since_, now));
    held_back_since_.reset();
    last_held_back_ = now;
  }
  return is_held_back;
}

std::optional<HostedWorld::TimePoint> HostedWorld::next_due(TimePoint now) const {
  if (destroyed_by_ || time_.ready_at(now) > now) return std::nullopt;
  if (tick_due(now) || had_its_share_ || (looks_wait_ && is_idle())) return now;
  if (paused_ || halted_) return std::nullopt;
  return clock_.due();
}

std::optional<HostedWorld::TimePoint> HostedWorld::next_try(TimePoint now) const {
  if (destroyed_by_) return std::nullopt;
  const TimePoint ready_at = time_.ready_at(now);
  const auto next = journal_ && !halted_ ? journal_->next_try(now) : std::nullopt;
  if (ready_at <= now) return next;
  return next ? std::min(*next, ready_at) : ready_at;
}

void HostedWorld::finish_tick(TimePoint deadline, Outbox& outbox) {
  while (mid_tick_ && std::chrono::steady_clock::now() < deadline) mid_tick_ = !live_.physics().substep(workers_);
  if (!mid_tick_) send_events(outbox);
}

void HostedWorld::halt(const std::string& why, Outbox& outbox) {
  spdlog::error("world={} tick={} halted: {}", log_name(name_), live_.tick(), why);
  halted_ = true;
  paused_ = true;
  mid_tick_ = false;
  end_steps({base::StatusCode::internal, "the world was halted by a fault"}, outbox);
}

base::Status HostedWorld::forget() {
  return journal_ ? journal_->remove() : base::Status();
}

void HostedWorld::publish_status(TimePoint now) {
  const physics::World& world = live_.physics();
  WorldStatus status;
  v1::WorldList::World& listing = status.listing;
  listing.set_name(name_);
  listing.set_scene_name(live_.scene_name());
  listing.set_tick(live_.tick());
  listing.set_time_s(world.time_s());
  listing.set_paused(paused_);
  listing.set_time_scale(time_scale_);
  listing.set_soft_bodies(static_cast<std::uint32_t>(world.soft_body_count()));
  listing.set_rigid_bodies(static_cast<std::uint32_t>(world.rigid_bodies().size()));
  listing.set_vertices(vertex_count(world));
  listing.set_rate_hz(1.0 / world.tick_period_s());
  listing.set_subscribers(static_cast<std::uint32_t>(hub_.subscriber_count()));
  listing.set_frozen_bodies(frozen_count(world));
  status.last_active = now;
  if (now - summarised_ >= std::chrono::seconds(1)) {
    summary_ = window_.summary(now);
    summarised_ = now;
  }
  if (!paused_) {
    status.lateness_s = 1e-3 * summary_.due_error_ms_p99;
    status.time_ratio = summary_.time_ratio;
  }
  describe_keeping(status);
  const std::lock_guard lock(status_mutex_);
  status_ = std::move(status);
}

}  // namespace pneuma::app
