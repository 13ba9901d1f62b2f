// Shows that a recording that is played is the world that was recorded: its frames at their times and ticks, within
// the bound that the stream declares, for any number of subscribers; that it can be paused, stepped, reset and sought
// in, and changed by nobody. The time is the test's own; no sockets.
#include "replay/replayed_world.h"

#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "app/live_world.h"
#include "base/limits.h"
#include "pneuma_client/recording.h"
#include "support/temporary_folder.h"
#include "unit/app/ball_scene.h"

namespace pneuma::replay {
namespace {

constexpr double recorded_error_m = 1e-3;
constexpr std::uint64_t recorded_ticks = 60;
constexpr std::uint64_t hit_tick = 20;     // an impulse is applied after so many ticks
constexpr std::uint64_t second_tick = 40;  // and a second ball added after so many

/// What one session gets of what is sent, in order.
class Viewer {
 public:
  explicit Viewer(net::SessionId id) : session_(std::make_shared<app::Session>(id)) {}

  [[nodiscard]] const std::shared_ptr<app::Session>& session() const { return session_; }

  std::vector<std::string> take(const app::Outbox& outbox) {
    std::vector<std::string> messages;
    for (const auto& item : outbox.items) {
      if (const auto* send = std::get_if<app::Outbox::Send>(&item);
          send != nullptr && send->session == session_->id()) {
        messages.push_back(*send->message);
      }
      if (const auto* missing = std::get_if<app::Outbox::SendTopology>(&item);
          missing != nullptr && missing->session == session_) {
        session_->send_topology(missing->topology.hash, [&] { messages.push_back(*missing->topology.message); });
      }
      const auto* publish = std::get_if<app::Outbox::Publish>(&item);
      if (publish == nullptr || std::ranges::count(*publish->sessions, session_->id()) == 0) continue;
      const bool delta = publish->frame.delta != nullptr && publish->frame.base_tick == last_tick_;
      EXPECT_TRUE(delta || publish->frame.key != nullptr);
      last_tick_ = publish->frame.tick;
      messages.push_back(delta ? *publish->frame.delta : *publish->frame.key);
    }
    return messages;
  }

 private:
  std::shared_ptr<app::Session> session_;
  std::optional<std::uint64_t> last_tick_;
};

v1::ServerMessage parse(const std::string& bytes) {
  v1::ServerMessage message;
  EXPECT_TRUE(message.ParseFromString(bytes));
  return message;
}

class ReplayedWorldTest : public testing::Test {
 protected:
  using TimePoint = ReplayedWorld::TimePoint;

  /// Records a ball from tick 0 on.
  void SetUp() override {
    auto live = app::LiveWorld::create(app::ball_scene());
    ASSERT_TRUE(live.ok());
    app::FrameHub hub([] { return 5U; }, [](std::uint32_t) {});
    Viewer recorder(1);
    v1::Subscribe request;
    request.set_max_error_m(recorded_error_m);
    request.set_commands(true);
    request.set_key_interval_s(0.25);
    const auto subscribed = hub.subscribe(recorder.session(), request, 60.0);
    ASSERT_TRUE(subscribed.ok());
    v1::RecordingHeader header;
    header.set_world("w");
    header.set_world_rate_hz(60.0);
    *header.mutable_scene() = app::ball_scene();
    *header.mutable_stream() = *subscribed;
    auto writer = client::RecordingWriter::create(file_, header, client::RecordingWriter::IfThere::refuse);
    ASSERT_TRUE(writer.ok());
    physics::Workers workers{1};
    for (std::uint64_t tick = 0; tick <= recorded_ticks; ++tick) {
      app::Outbox outbox;
      if (tick > 0) live->physics().step_tick(workers);
      hub.encode_tick(app::LiveFrames(live->physics()), tick, false, outbox);
      truth_m_[tick] = positions(*live);
      if (tick == hit_tick) change(*live, hub, app::impulse_up("ball", 1.0), outbox);
      if (tick == second_tick) change(*live, hub, app::add_second_ball(), outbox);
      for (const std::string& bytes : recorder.take(outbox)) ASSERT_TRUE(writer->append(bytes, parse(bytes)).ok());
    }
    ASSERT_TRUE(writer->finish().ok());
  }

  static void change(app::LiveWorld& live, app::FrameHub& hub, const v1::ClientMessage& message, app::Outbox& outbox) {
    ASSERT_TRUE(live.change(message).ok());
    hub.applied(live.tick(), message, outbox);
    hub.edited();
  }

  static std::vector<double> positions(const app::LiveWorld& live) {
    std::vector<double> positions_m(3 * live.physics().soft_body(0).mesh->positions_m.size());
    live.physics().copy_positions(0, positions_m);
    return positions_m;
  }

  void play(const PlayOptions& options = {}) {
    auto playback = client::Playback::open(file_);
    ASSERT_TRUE(playback.ok()) << playback.status().message();
    world_.emplace(std::move(*playback), options,
                   ReplayedWorld::Wiring{[this] { return ++last_stream_id_; }, [](std::uint32_t) {}});
    ASSERT_TRUE(world_->begin(start_).ok());
  }

  [[nodiscard]] TimePoint at(double time_s) const {
    return start_ + std::chrono::duration_cast<TimePoint::duration>(std::chrono::duration<double>(time_s));
  }

  /// Asks and takes all that is sent until the reply, which is returned.
  v1::ServerMessage ask(const std::function<void(v1::ClientMessage&)>& fill, double now_s = 0.0) {
    v1::ClientMessage message;
    message.set_request_id(9);
    fill(message);
    EXPECT_EQ(world_->post(app::Request{viewer_.session(), message}), app::Inbox::Post::taken);
    app::Outbox outbox;
    world_->drain(at(now_s), outbox);
    return look(outbox).value_or(v1::ServerMessage());
  }

  v1::ServerMessage subscribe(double max_error_m = 0.0, double rate_hz = 0.0) {
    return ask([&](auto& message) {
      message.mutable_subscribe()->set_max_error_m(max_error_m);
      message.mutable_subscribe()->set_rate_hz(rate_hz);
      message.mutable_subscribe()->set_commands(true);
    });
  }

  /// Takes what was sent: frames to frames_, changes to changes_. Returns the reply among it.
  std::optional<v1::ServerMessage> look(const app::Outbox& outbox) {
    std::optional<v1::ServerMessage> reply;
    for (const std::string& bytes : viewer_.take(outbox)) {
      const v1::ServerMessage message = parse(bytes);
      if (message.has_subscribed()) {
        bound_m_ = message.subscribed().max_error_m();
        EXPECT_TRUE(decoder_.add_stream(message.subscribed()).ok());
      }
      if (message.request_id() != 0) {
        reply = message;
      } else {
        take(message);
      }
    }
    return reply;
  }

  void take(const v1::ServerMessage& message) {
    if (message.has_topology()) {
      EXPECT_TRUE(decoder_.take_topology(message.topology()).ok());
    }
    if (message.has_layout()) {
      EXPECT_TRUE(decoder_.take_layout(message.layout()).ok());
    }
    if (message.has_applied()) changes_.push_back(message.applied());
    if (!message.has_frame()) return;
    auto frame = decoder_.take_frame(message.frame(), 0);
    ASSERT_TRUE(frame.ok() && *frame) << frame.status().message();
    expect_true((**frame));
    frames_.push_back(std::move(**frame));
  }

  /// Every vertex of the first ball is within the declared bound of where it was.
  void expect_true(const client::DecodedFrame& frame) {
    const std::vector<double>& truth_m = truth_m_.at(frame.tick);
    const std::vector<double>& seen_m = frame.bodies[0].positions_m;
    ASSERT_EQ(seen_m.size(), truth_m.size());
    for (std::size_t i = 0; i < seen_m.size(); i += 3) {
      EXPECT_LE(std::hypot(seen_m[i] - truth_m[i], seen_m[i + 1] - truth_m[i + 1], seen_m[i + 2] - truth_m[i + 2]),
                bound_m_)
          << "tick " << frame.tick;
    }
    EXPECT_EQ(frame.bodies.size(), frame.tick > second_tick ? 2U : 1U);
  }

  /// Plays all that is due until then.
  void go_on_until(double time_s) {
    while (const auto due = world_->due()) {
      if (*due > at(time_s)) break;
      app::Outbox outbox;
      world_->play(*due, outbox);
      look(outbox);
    }
  }

  [[nodiscard]] std::vector<std::uint64_t> ticks_seen() {
    std::vector<std::uint64_t> ticks;
    for (const auto& frame : frames_) ticks.push_back(frame.tick);
    frames_.clear();
    return ticks;
  }

  support::TemporaryFolder folder_;
  std::string file_ = folder_ / "w.pneuma";
  std::map<std::uint64_t, std::vector<double>> truth_m_;  // by tick: of the first ball
  TimePoint start_ = TimePoint(std::chrono::hours(1));
  std::uint32_t last_stream_id_ = 0;
  std::optional<ReplayedWorld> world_;

  Viewer viewer_{2};
  client::StreamDecoder decoder_;
  double bound_m_ = 0.0;
  std::vector<client::DecodedFrame> frames_;
  std::vector<v1::Applied> changes_;
};

std::vector<std::uint64_t> from_to(std::uint64_t from, std::uint64_t to, std::uint64_t step = 1) {
  std::vector<std::uint64_t> ticks;
  for (std::uint64_t tick = from; tick <= to; tick += step) ticks.push_back(tick);
  return ticks;
}

TEST_F(ReplayedWorldTest, ShowsEveryFrameAtItsTimeWithinTheDeclaredBound) {
  play();
  const auto subscribed = subscribe().subscribed();
  EXPECT_EQ(subscribed.rate_hz(), 60.0);
  EXPECT_GT(subscribed.max_error_m(), recorded_error_m);
  EXPECT_LE(subscribed.max_error_m(), 1.25 * recorded_error_m + 1e-12);
  EXPECT_EQ(ticks_seen(), from_to(0, 0));
  go_on_until(0.5 + 1e-6);
  EXPECT_EQ(ticks_seen(), from_to(1, 30));
  go_on_until(10.0);
  EXPECT_EQ(ticks_seen(), from_to(31, recorded_ticks));
  EXPECT_FALSE(world_->due());
  EXPECT_TRUE(world_->status().listing.paused());
}

TEST_F(ReplayedWorldTest, ChangesComeBeforeTheFramesThatShowThem) {
  play();
  subscribe();
  go_on_until(static_cast<double>(hit_tick) / 60.0 + 1e-6);
  EXPECT_TRUE(changes_.empty());
  go_on_until(10.0);
  ASSERT_EQ(changes_.size(), 2U);
  EXPECT_EQ(changes_[0].tick(), hit_tick);
  EXPECT_TRUE(changes_[0].command().has_impulse());
  EXPECT_EQ(changes_[1].tick(), second_tick);
}

TEST_F(ReplayedWorldTest, SpeedAndLoop) {
  play({.speed = 2.0, .loop = true});
  subscribe();
  go_on_until(0.25 + 1e-6);
  EXPECT_EQ(ticks_seen(), from_to(0, 30));
  go_on_until(0.5 + 0.5 / 60.0 + 1e-6);
  std::vector<std::uint64_t> expected = from_to(31, recorded_ticks);
  expected.push_back(0);
  EXPECT_EQ(ticks_seen(), expected);
}

TEST_F(ReplayedWorldTest, APausedOneStepsAndGoesOn) {
  play({.paused = true});
  subscribe();
  EXPECT_FALSE(world_->due());
  EXPECT_EQ(ask([](auto& message) { message.mutable_step()->set_ticks(5); }).done().tick(), 5U);
  EXPECT_EQ(ticks_seen(), from_to(0, 5));
  EXPECT_TRUE(ask([](auto& message) { message.mutable_resume(); }, 100.0).has_done());
  EXPECT_EQ(ask([](auto& message) { message.mutable_step()->set_ticks(1); }, 100.0).error().code(),
            v1::Error::FAILED_PRECONDITION);
  go_on_until(100.0 + 10.0 / 60.0 + 1e-6);
  EXPECT_EQ(ticks_seen(), from_to(6, 15));
  EXPECT_TRUE(ask([](auto& message) { message.mutable_pause(); }, 101.0).has_done());
  EXPECT_FALSE(world_->due());
  EXPECT_EQ(ask([](auto& message) { message.mutable_step()->set_ticks(1000); }).error().what(),
            "the recording ends at tick 60");
}

TEST_F(ReplayedWorldTest, ASeekShowsTheFrameOfThatTimeAtOnce) {
  for (const bool paused : {true, false}) {
    SCOPED_TRACE(paused);
    play({.paused = paused});
    viewer_ = Viewer(2);
    decoder_ = client::StreamDecoder();
    subscribe();
    (void)ticks_seen();
    for (const std::uint64_t tick : {50U, 10U, 11U, 60U, 0U}) {
      const double time_s = static_cast<double>(tick) / 60.0 + (tick == 60 ? 0.1 : 0.0);
      const auto reply = ask([&](auto& message) { message.mutable_seek()->set_time_s(time_s); });
      if (tick == 60) {
        EXPECT_EQ(reply.error().where(), "seek.time_s") << "it is past the end";
        continue;
      }
      EXPECT_EQ(reply.done().tick(), tick);
      EXPECT_EQ(ticks_seen(), from_to(tick, tick));
    }
    if (!paused) {
      go_on_until(0.1 + 1e-6);
      EXPECT_EQ(ticks_seen(), from_to(1, 6)) << "from there";
    }
  }
}

TEST_F(ReplayedWorldTest, AResetGoesToTheStartAndAResumeAtTheEndToo) {
  play({.start_s = 0.5});
  subscribe();
  go_on_until(10.0);
  EXPECT_EQ(ticks_seen(), from_to(30, recorded_ticks));
  EXPECT_EQ(ask([](auto& message) { message.mutable_resume(); }, 20.0).done().tick(), 0U);
  EXPECT_EQ(ticks_seen(), from_to(0, 0));
  go_on_until(20.1 + 1e-6);
  EXPECT_EQ(ticks_seen(), from_to(1, 6));
  EXPECT_EQ(ask([](auto& message) { message.mutable_reset(); }, 20.1).done().tick(), 0U);
  EXPECT_EQ(ticks_seen(), from_to(0, 0));
}

TEST_F(ReplayedWorldTest, ARateIsADivisionOfTheRecordings) {
  play();
  EXPECT_EQ(subscribe(0.0, 22.0).subscribed().rate_hz(), 20.0);
  go_on_until(0.5 + 1e-6);
  EXPECT_EQ(ticks_seen(), from_to(0, 30, 3));
}

TEST_F(ReplayedWorldTest, NoStreamPromisesMoreThanWasRecorded) {
  play();
  const auto refused = subscribe(recorded_error_m);
  EXPECT_EQ(refused.error().code(), v1::Error::LIMIT_EXCEEDED);
  EXPECT_EQ(refused.error().where(), "subscribe.max_error_m");
  EXPECT_EQ(subscribe(3.0 * recorded_error_m).subscribed().max_error_m(), 3.0 * recorded_error_m);
  go_on_until(1.0 + 1e-6);
  EXPECT_EQ(ticks_seen(), from_to(1, recorded_ticks)) << "the next frame is the first";
}

TEST_F(ReplayedWorldTest, NobodyChangesARecording) {
  play();
  for (const auto& fill : std::vector<std::function<void(v1::ClientMessage&)>>{
           [](auto& message) { message.mutable_edit(); }, [](auto& message) { message.mutable_impulse(); },
           [](auto& message) { message.mutable_grab(); }, [](auto& message) { message.mutable_destroy_world(); }}) {
    EXPECT_EQ(ask(fill).error().code(), v1::Error::FAILED_PRECONDITION);
  }
  EXPECT_EQ(ask([](auto& message) { message.mutable_get_scene(); }).scene().scene().name(), "ball");
  EXPECT_EQ(ask([](auto& message) { message.mutable_get_stats(); }).stats().world(), "w");
}

}  // namespace
}  // namespace pneuma::replay
