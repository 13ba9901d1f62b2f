// A world as the server hosts it: what moves (LiveWorld), who watches (FrameHub), what is asked of it (Inbox), when its
// ticks are due (WorldClock) and what is kept of it (WorldJournal).
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/frame_hub.h"
#include "app/inbox.h"
#include "app/live_world.h"
#include "app/metrics.h"
#include "app/outbox.h"
#include "app/tick_window.h"
#include "app/world_clock.h"
#include "app/world_journal.h"
#include "app/world_moment.h"
#include "app/world_room.h"
#include "app/world_status.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

class HostedWorld {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct Wiring {
    std::function<std::uint32_t()> take_stream_id;
    std::function<void(std::uint32_t)> drop_stream_id;
    Metrics* metrics = nullptr;
    MeshTopologies::Defer defer = [](std::size_t /*vertices*/, const auto& make) { make(); };
    LookBackOn look_back = nullptr;
    std::optional<net::SessionId> owner = std::nullopt;  // the session that it ends with
  };

  /// `journal` may be null: nothing of the world is kept.
  HostedWorld(std::string name, LiveWorld live, bool paused, std::unique_ptr<WorldJournal> journal, Wiring wiring,
              WorldRoom room = {});

  // Any thread:

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::optional<net::SessionId>& owner() const { return wiring_.owner; }
  [[nodiscard]] Inbox::Post post(Command command) { return inbox_.post(std::move(command)); }
  [[nodiscard]] WorldStatus status() const;

  // The stepping thread, in the order of a tick:

  /// Carries out what came since the last tick. While the world runs, looks at bodies get a share of its time. Nothing
  /// where a tick is under way or the world has used up its budget of processor time, but that a request to destroy the
  /// world need not wait for long. What is not done at `until`, or makes too many replies at once, waits for the next
  /// slice.
  void drain(TimePoint now, TimePoint until, Outbox& outbox);
  /// A tick is under way, asked for, or due by its clock, and there is processor time left for it.
  [[nodiscard]] bool tick_due(TimePoint now) const;
  /// Steps until the tick ends (true), or `give_way` says so between two parts of it.
  bool step(const std::function<bool()>& give_way);
  /// The tick's frames, replies and events.
  void encode(Outbox& outbox);
  void end_tick(TimePoint now, Outbox& outbox);
  /// Where one is due, or `force` is set.
  void checkpoint(TimePoint now, bool force);
  [[nodiscard]] bool has_budget() const { return time_.is_limited(); }
  /// What the slice that ends has taken of a processor, from its budget.
  void spend(TimePoint now, TimeBudget::Duration used);
  /// When it wants to run next; nothing where it rests.
  [[nodiscard]] std::optional<TimePoint> next_due(TimePoint now) const;
  /// When it wants to run at the latest where it rests.
  [[nodiscard]] std::optional<TimePoint> next_try(TimePoint now) const;

  /// Takes no more requests; those that wait are answered with `why`.
  void close(const base::Status& why, Outbox& outbox);
  /// Ends the tick under way, if one is; its events are told, its frames are not.
  void finish_tick(TimePoint deadline, Outbox& outbox);
  /// Stops the world for good, after something that should not have happened.
  void halt(const std::string& why, Outbox& outbox);

  /// The request that ended the world; null where it lives.
  [[nodiscard]] const Request* destroyed_by() const { return destroyed_by_ ? &*destroyed_by_ : nullptr; }
  /// Whether all of it is on the disk; when its stepping has ended and the disk's jobs are done.
  [[nodiscard]] base::Status kept() const { return journal_ ? journal_->trouble() : base::Status(); }
  /// Removes what is kept of it.
  [[nodiscard]] base::Status forget();

 private:
  using Answer = base::Result<v1::ServerMessage>;

  struct PendingStep {
    std::shared_ptr<Session> session;
    std::uint64_t request_id;
    std::uint32_t ticks_left;
    std::string_view kind;  // of the request
    MessagePtr message{};   // where it observes or has a goal; counted as the client's while it waits
    bool reached = false;   // the goal

    /// Null where it observes nothing, or goes on for all of its ticks.
    [[nodiscard]] const v1::Observe* observe() const;
    [[nodiscard]] const v1::StepUntil* until() const;
  };

  // hosted_world_requests.cpp: what a request does.
  void answer(const Request& request, TimePoint now, Outbox& outbox);
  void refuse(const Request& request, const base::Status& why, Outbox& outbox);
  [[nodiscard]] std::optional<Answer> carry_out(const Request& request, TimePoint now, Outbox& outbox);
  [[nodiscard]] Answer change(const Request& request, Outbox& outbox);
  [[nodiscard]] Answer pause(const Request& request, Outbox& outbox);
  [[nodiscard]] Answer resume(const Request& request, TimePoint now, Outbox& outbox);
  [[nodiscard]] std::optional<Answer> step_on(const Request& request, Outbox& outbox);
  [[nodiscard]] base::Status check_step(const PendingStep& step) const;
  /// Answers the steps that come next and whose tick the world has passed.
  void end_passed_steps(Outbox& outbox);
  /// What is answered later, from what is kept of the world.
  [[nodiscard]] std::optional<Answer> look_back(const Request& request);
  [[nodiscard]] base::Status check_past(std::uint64_t tick, const std::string& field) const;
  /// The steps that wait get `why` for an answer.
  void end_steps(const base::Status& why, Outbox& outbox);
  void destroy(const Request& request, Outbox& outbox);
  void session_ended(net::SessionId session, Outbox& outbox);
  void release(std::uint64_t grab_id, Outbox& outbox);
  /// Writes a request to the log, before it is carried out.
  [[nodiscard]] base::Status write_ahead(const v1::ClientMessage& message);
  [[nodiscard]] v1::ServerMessage stats(const Request& request, TimePoint now) const;

  /// What became of bodies in the tick, to the log and to all who watch.
  void send_events(Outbox& outbox);
  void publish_status(TimePoint now);
  /// Whether its processor time is used up, and notes since when.
  [[nodiscard]] bool is_held_back(TimePoint now);
  /// What is kept of the world, or not.
  void describe_keeping(WorldStatus& status) const;
  [[nodiscard]] std::uint64_t next_tick() const { return live_.tick() + 1; }
  /// It is paused, and no tick of it is asked for.
  [[nodiscard]] bool is_idle() const { return paused_ && pending_steps_.empty(); }
  /// Whether the step under way waits for what only contacts tell.
  [[nodiscard]] bool awaits_touch() const;
  /// The reply to a step that has ended with the tick just done.
  [[nodiscard]] v1::ServerMessage stepped(const PendingStep& step) const;

  const std::string name_;
  const Wiring wiring_;
  Inbox inbox_;

  LiveWorld live_;
  WorldMemory memory_;
  StepBudget time_;
  FrameHub hub_;
  std::unique_ptr<WorldJournal> journal_;
  physics::Workers workers_{1};  // worlds run in parallel, not the bodies of a world
  std::map<std::uint64_t, net::SessionId> grab_owners_;

  bool paused_;
  double time_scale_ = 1.0;                   // simulated over real time
  std::optional<TimePoint> held_back_since_;  // since when there is no processor time left for it
  TimePoint last_held_back_{};
  std::string held_back_by_;    // which budget last did
  bool had_its_share_ = false;  // of a slice, before all that waited was carried out
  TimeBudget looks_;            // what requests that look at bodies may take while the world runs
  bool looks_wait_ = false;
  std::deque<PendingStep> pending_steps_;
  std::optional<Request> destroyed_by_;
  bool halted_ = false;

  WorldClock clock_;
  bool mid_tick_ = false;
  TimePoint tick_began_{};
  TickSample sample_;  // of the tick under way
  TickWindow window_;
  TickSummary summary_;  // of the last seconds, for others: found once a second
  TimePoint summarised_{};
  double slipped_s_ = 0.0;
  TimePoint last_slow_event_{};

  mutable std::mutex status_mutex_;
  WorldStatus status_;
};

}  // namespace pneuma::app
