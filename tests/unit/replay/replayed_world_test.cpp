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
#include "unit/app/requests.h"
#include "unit/app/viewer.h"

namespace pneuma::replay {
namespace {

using app::Viewer;

constexpr double recorded_error_m = 1e-3;
constexpr std::uint64_t recorded_ticks = 60;
constexpr std::uint64_t hit_tick = 20;     // an impulse is applied after so many ticks
constexpr std::uint64_t second_tick = 40;  // and a second ball added after so many
// As recorded; any numbers.
constexpr std::uint64_t asker = 9;
constexpr std::uint64_t told_grab = 4;

v1::ServerMessage parse(const std::string& bytes) {
  v1::ServerMessage message;
  EXPECT_TRUE(message.ParseFromString(bytes));
  return message;
}

class ReplayedWorldTest : public testing::Test {
 protected:
  using TimePoint = ReplayedWorld::TimePoint;

  /// Of the first ball.
  struct Truth {
    std::vector<double> positions_m;
    std::vector<double> velocities_m_s;
    double kinetic_j = 0.0;
  };

  void SetUp() override {
    record([](v1::Subscribe&) {});
  }

  /// Records a ball from tick 0 on, by a stream as `fill` asks for it.
  void record(const std::function<void(v1::Subscribe&)>& fill) {
    auto live = app::LiveWorld::create(app::ball_scene());
    ASSERT_TRUE(live.ok());
    app::FrameHub hub([] { return 5U; }, [](std::uint32_t) {});
    Viewer recorder(1);
    v1::Subscribe request;
    request.set_max_error_m(recorded_error_m);
    request.set_commands(true);
    request.set_key_interval_s(0.25);
    fill(request);
    const auto subscribed = hub.subscribe(recorder.session(), request, 60.0);
    ASSERT_TRUE(subscribed.ok());
    v1::RecordingHeader header;
    header.set_world("w");
    header.set_world_rate_hz(60.0);
    *header.mutable_scene() = app::ball_scene();
    *header.mutable_stream() = *subscribed;
    auto writer = client::RecordingWriter::create(file_, header, client::RecordingWriter::IfThere::replace);
    ASSERT_TRUE(writer.ok());
    physics::Workers workers{1};
    for (std::uint64_t tick = 0; tick <= recorded_ticks; ++tick) {
      app::Outbox outbox;
      if (tick > 0) live->physics().step_tick(workers);
      hub.encode_tick(app::LiveFrames(live->physics()), tick, false, outbox);
      truth_[tick] = truth_of(live->physics());
      if (tick == hit_tick) change(*live, hub, app::impulse_up("ball", 1.0), outbox);
      if (tick == second_tick) change(*live, hub, app::add_second_ball(), outbox);
      for (const std::string& bytes : recorder.take(outbox)) ASSERT_TRUE(writer->append(bytes, parse(bytes)).ok());
    }
    ASSERT_TRUE(writer->finish().ok());
  }

  static void change(app::LiveWorld& live, app::FrameHub& hub, const v1::ClientMessage& message, app::Outbox& outbox) {
    ASSERT_TRUE(live.change(message).ok());
    hub.applied({.tick = live.tick(), .command = message, .session = asker, .grab_id = told_grab}, outbox);
    hub.edited();
  }

  static Truth truth_of(const physics::World& world) {
    Truth truth;
    truth.positions_m.resize(3 * world.soft_body(0).mesh->positions_m.size());
    truth.velocities_m_s.resize(truth.positions_m.size());
    world.copy_positions(0, truth.positions_m);
    world.copy_velocities(0, truth.velocities_m_s);
    truth.kinetic_j = world.measure(0).kinetic_j;
    return truth;
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
    EXPECT_EQ(world_->post(app::request_of(viewer_.session(), message)), app::Inbox::Post::taken);
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
    const std::vector<double>& truth_m = truth_.at(frame.tick).positions_m;
    const std::vector<double>& seen_m = frame.bodies[0].positions_m;
    const std::vector<std::uint32_t>& kept = *frame.bodies[0].kept_vertices;
    ASSERT_EQ(seen_m.size(), kept.empty() ? truth_m.size() : 3 * kept.size());
    for (std::size_t i = 0; i < seen_m.size(); i += 3) {
      const std::size_t at = kept.empty() ? i : 3 * std::size_t{kept[i / 3]};
      EXPECT_LE(std::hypot(seen_m[i] - truth_m[at], seen_m[i + 1] - truth_m[at + 1], seen_m[i + 2] - truth_m[at + 2]),
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
  std::map<std::uint64_t, Truth> truth_;  // by tick
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
  EXPECT_EQ(changes_[0].session_id(), asker);
  EXPECT_EQ(changes_[0].grab_id(), told_grab);
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

TEST_F(ReplayedWorldTest, InSlowMotionItsFramesComeLater) {
  play();
  subscribe();
  ask([](auto& message) { message.mutable_resume()->set_time_scale(0.25); });
  go_on_until(0.4);
  EXPECT_EQ(ticks_seen(), from_to(0, 6)) << "0.1 s of the recording in 0.4 s";
  EXPECT_EQ(world_->status().listing.time_scale(), 0.25);
}

TEST_F(ReplayedWorldTest, ItGoesOnHoweverOftenItsSpeedIsSet) {
  play();
  subscribe();
  constexpr double interval_s = 0.010;  // less than a frame's
  for (int i = 1; i <= 50; ++i) {
    const double now_s = i * interval_s;
    go_on_until(now_s);
    ask([&](auto& message) { message.mutable_resume()->set_time_scale(i % 2 == 0 ? 1.0 : 0.5); }, now_s);
  }
  EXPECT_EQ(ticks_seen(), from_to(0, 22)) << "0.01 s at full speed, then 0.49 s at 0.75 on average: 0.375 s";
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

TEST_F(ReplayedWorldTest, ItsListingTellsWhereItBeginsAndEndsWhereverItIs) {
  for (const double start_s : {0.0, 0.5, 1.0}) {
    play({.start_s = start_s, .paused = true});
    const v1::WorldList::World listing = world_->status().listing;
    ASSERT_TRUE(listing.has_recording());
    EXPECT_NEAR(listing.recording().duration_s(), 1.0, 1e-9);
    EXPECT_EQ(listing.recording().first_tick(), 0U);
    EXPECT_EQ(listing.recording().last_tick(), recorded_ticks);
    EXPECT_FALSE(listing.recording().velocities());
  }
  record([](v1::Subscribe& request) { request.set_velocities(true); });
  play();
  EXPECT_TRUE(world_->status().listing.recording().velocities());
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

TEST_F(ReplayedWorldTest, WhatWasNotRecordedIsRefused) {
  play();
  const auto refusal = [&](const std::function<void(v1::Subscribe&)>& fill) {
    return ask([&](auto& message) { fill(*message.mutable_subscribe()); }).error();
  };
  const v1::Error velocities = refusal([](auto& subscribe) { subscribe.set_velocities(true); });
  EXPECT_EQ(velocities.code(), v1::Error::FAILED_PRECONDITION);
  EXPECT_EQ(velocities.where(), "subscribe.velocities");
  EXPECT_EQ(refusal([](auto& subscribe) { subscribe.set_scalars(true); }).where(), "subscribe.scalars");
  EXPECT_EQ(refusal([](auto& subscribe) { subscribe.set_contacts(true); }).where(), "subscribe.contacts");
  const v1::Error body = refusal([](auto& subscribe) { subscribe.add_bodies("second"); });
  EXPECT_EQ(body.code(), v1::Error::NOT_FOUND) << "it comes later";
  EXPECT_EQ(body.where(), "subscribe.bodies[0]");
}

TEST_F(ReplayedWorldTest, WhatWasRecordedOfVelocitiesAndScalarsIsPlayedAtTheKeptVertices) {
  record([](v1::Subscribe& request) {
    request.set_level_of_detail(1);
    request.set_velocities(true);
    request.set_scalars(true);
  });
  play();
  const v1::Subscribed subscribed = ask([](auto& message) {
                                      message.mutable_subscribe()->set_velocities(true);
                                      message.mutable_subscribe()->set_scalars(true);
                                      message.mutable_subscribe()->set_level_of_detail(1);
                                    }).subscribed();
  EXPECT_GT(subscribed.max_velocity_error_m_s(), 60.0 * recorded_error_m);
  go_on_until(10.0);
  ASSERT_EQ(frames_.size(), recorded_ticks + 1);
  for (const client::DecodedFrame& frame : frames_) {
    const client::SoftBodyFrame& body = frame.bodies[0];
    ASSERT_EQ(body.kept_vertices->size(), 12U);
    EXPECT_GT(body.kept_vertices->back(), 12U) << "of the mesh, not of what was recorded of it";
    const Truth& truth = truth_.at(frame.tick);
    EXPECT_EQ(body.scalars.kinetic_j, static_cast<double>(static_cast<float>(truth.kinetic_j)));
    for (std::size_t at = 0; at < 36; at += 3) {
      const std::size_t vertex = 3 * std::size_t{(*body.kept_vertices)[at / 3]};
      const double off_m_s = std::hypot(body.velocities_m_s[at] - truth.velocities_m_s[vertex],
                                        body.velocities_m_s[at + 1] - truth.velocities_m_s[vertex + 1],
                                        body.velocities_m_s[at + 2] - truth.velocities_m_s[vertex + 2]);
      EXPECT_LE(off_m_s, subscribed.max_velocity_error_m_s()) << "tick " << frame.tick;
    }
  }
}

TEST_F(ReplayedWorldTest, StatsTellTheFrameBytesOfTheLastSecond) {
  play();
  const auto frame_bytes_s = [this] {
    return ask([](auto& message) { message.mutable_get_stats(); }).stats().frame_bytes_s();
  };
  EXPECT_EQ(frame_bytes_s(), 0.0) << "nobody watches";
  subscribe();
  go_on_until(0.5);
  EXPECT_GT(frame_bytes_s(), 0.0);
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
