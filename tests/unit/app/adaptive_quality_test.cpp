// Shows how the hub moves adaptive readers: told before the new stream's first message, one stream at a time, back to
// what was asked for, and never past what streams are limited to. Reports are made up; no sockets and no clock.
#include <algorithm>

#include <gtest/gtest.h>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "ball_scene.h"
#include "base/limits.h"

namespace pneuma::app {
namespace {

using namespace std::chrono_literals;

class AdaptiveQuality : public testing::Test {
 protected:
  AdaptiveQuality()
      : world_(std::move(*LiveWorld::create(ball_scene()))),
        hub_([this] { return ++last_stream_id_; }, [this](std::uint32_t id) { dropped_.push_back(id); }) {}

  base::Result<v1::Subscribed> subscribe(const std::shared_ptr<Session>& session, double max_error_m,
                                         bool adaptive = true, double rate_hz = 0.0) {
    v1::Subscribe request;
    request.set_world("w");
    request.set_rate_hz(rate_hz);
    request.set_max_error_m(max_error_m);
    request.set_adaptive(adaptive);
    return hub_.subscribe(session, request, 60.0);
  }

  /// A report in the stream's life; `dropped` more frames than in the last one. Of a reader that takes nearly all.
  void report(net::SessionId session, std::uint32_t stream_id, net::Duration later, std::uint64_t dropped) {
    now_ += later;
    net::ReaderReport report{now_, 1e9, {}};
    report.stream.stream_id = stream_id;
    dropped_frames_ += dropped;
    report.stream.totals.frames_dropped = dropped_frames_;
    hub_.reader_report(session, report);
  }
  void strain(net::SessionId session, std::uint32_t stream_id) {
    dropped_frames_ = 0;
    report(session, stream_id, 250ms, 0);
    report(session, stream_id, 2s, 3);
  }

  Outbox tick() {
    world_.physics().step_tick(workers_);
    Outbox outbox;
    hub_.encode_tick(LiveFrames(world_.physics()), world_.tick(), false, outbox);
    return outbox;
  }

  /// What a session is sent, "end 1 replaced 1 2 layout 2 frame 2".
  static std::string sent(const Outbox& outbox, net::SessionId session) {
    std::string out;
    for (const auto& item : outbox.items) {
      if (const auto* end = std::get_if<Outbox::EndStream>(&item); end != nullptr && end->session == session) {
        out += "end " + std::to_string(end->stream_id) + " ";
      }
      if (const auto* send = std::get_if<Outbox::Send>(&item); send != nullptr && send->session == session) {
        v1::ServerMessage message;
        EXPECT_TRUE(message.ParseFromString(*send->message));
        if (message.has_layout()) out += "layout " + std::to_string(message.layout().stream_id()) + " ";
        if (!message.has_event()) continue;
        EXPECT_EQ(message.event().kind(), v1::Event::STREAM_REPLACED);
        EXPECT_EQ(message.event().successor().world(), "w");
        out += "replaced " + std::to_string(message.event().stream_id()) + " " +
               std::to_string(message.event().successor().stream_id()) + " ";
      }
      const auto* publish = std::get_if<Outbox::Publish>(&item);
      if (publish != nullptr && std::ranges::count(*publish->sessions, session) > 0) {
        out += (publish->frame.key != nullptr ? "key " : "delta ") + std::to_string(publish->frame.stream_id) + " ";
      }
    }
    return out;
  }

  /// The streams of a session, "1: 60 Hz 0.001".
  [[nodiscard]] v1::Stats streams(net::SessionId session) const {
    v1::Stats stats;
    hub_.describe_streams(session, {}, 60.0, stats);
    return stats;
  }

  physics::Workers workers_{1};
  LiveWorld world_;
  std::uint32_t last_stream_id_ = 0;
  std::vector<std::uint32_t> dropped_;
  FrameHub hub_;
  net::TimePoint now_{1000s};
  std::uint64_t dropped_frames_ = 0;
  std::shared_ptr<Session> ann_ = std::make_shared<Session>(1);
  std::shared_ptr<Session> bob_ = std::make_shared<Session>(2);
};

TEST_F(AdaptiveQuality, AReaderIsToldOfItsNewStreamBeforeItBegins) {
  ASSERT_TRUE(subscribe(ann_, 1e-3).ok());
  ASSERT_TRUE(subscribe(bob_, 1e-3, false).ok());
  tick();
  strain(1, 1);
  strain(2, 1);
  const Outbox outbox = tick();
  EXPECT_EQ(sent(outbox, 1), "end 1 replaced 1 2 layout 2 key 2 ");
  EXPECT_EQ(sent(outbox, 2), "delta 1 ") << "who did not ask for it stays";
  EXPECT_EQ(sent(tick(), 1), "delta 2 ");
  const v1::Stats stats = streams(1);
  ASSERT_EQ(stats.streams_size(), 1);
  EXPECT_EQ(stats.streams(0).max_error_m(), 2e-3);
  EXPECT_EQ(stats.streams(0).rate_hz(), 60.0);
}

TEST_F(AdaptiveQuality, ItGoesDownTheLadderAndBack) {
  ASSERT_TRUE(subscribe(ann_, 1e-3).ok());
  tick();
  std::vector<std::pair<double, double>> seen;
  const auto note = [&] {
    const v1::Stats stats = streams(1);
    ASSERT_EQ(stats.streams_size(), 1);
    seen.emplace_back(stats.streams(0).max_error_m(), stats.streams(0).rate_hz());
  };
  for (int i = 0; i < 5; ++i) {
    strain(1, streams(1).streams(0).stream_id());
    tick();
    note();
  }
  EXPECT_EQ(seen, (std::vector<std::pair<double, double>>{
                      {2e-3, 60.0}, {4e-3, 60.0}, {4e-3, 30.0}, {4e-3, 15.0}, {4e-3, 15.0}}));
  seen.clear();
  for (int i = 0; i < 5; ++i) {
    dropped_frames_ = 0;
    report(1, streams(1).streams(0).stream_id(), 20s, 0);
    report(1, streams(1).streams(0).stream_id(), 20s, 0);
    tick();
    note();
  }
  EXPECT_EQ(seen, (std::vector<std::pair<double, double>>{
                      {4e-3, 30.0}, {4e-3, 60.0}, {2e-3, 60.0}, {1e-3, 60.0}, {1e-3, 60.0}}));
  EXPECT_EQ(hub_.class_count(), 1U) << "what nobody reads any more is gone";
  EXPECT_EQ(dropped_.size() + 1, last_stream_id_);
}

TEST_F(AdaptiveQuality, AskingAgainGivesTheStreamThatItIsOn) {
  const auto first = subscribe(ann_, 1e-3);
  tick();
  strain(1, first->stream_id());
  tick();
  const auto again = subscribe(ann_, 1e-3);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->stream_id(), 2U);
  EXPECT_EQ(again->max_error_m(), 2e-3);
  EXPECT_EQ(hub_.subscriber_count(), 1U);
}

TEST_F(AdaptiveQuality, AskingForTheQualityThatItIsOnDoesNotTakeItsStreamOver) {
  const auto first = subscribe(ann_, 1e-3);
  tick();
  strain(1, first->stream_id());
  tick();
  for (const bool adaptive : {true, false}) {
    const auto other = subscribe(ann_, 2e-3, adaptive);
    EXPECT_EQ(other.status().code(), base::StatusCode::failed_precondition);
  }
  const auto again = subscribe(ann_, 1e-3);
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->stream_id(), 2U) << "still the first one's";
}

TEST_F(AdaptiveQuality, WhoAsksForAFixedQualityAgainIsBroughtBackToIt) {
  const auto first = subscribe(ann_, 1e-3);
  tick();
  strain(1, first->stream_id());
  tick();
  ASSERT_TRUE(subscribe(ann_, 1e-3, false).ok());
  EXPECT_EQ(sent(tick(), 1), "end 2 replaced 2 3 layout 3 key 3 ");
  strain(1, 3);
  EXPECT_EQ(sent(tick(), 1), "delta 3 ");
  EXPECT_EQ(streams(1).streams(0).max_error_m(), 1e-3);
}

TEST_F(AdaptiveQuality, AStreamThatItHasAlreadyIsPassedOver) {
  ASSERT_TRUE(subscribe(ann_, 1e-3).ok());
  ASSERT_TRUE(subscribe(ann_, 2e-3, false).ok());
  tick();
  strain(1, 1);
  tick();
  const v1::Stats stats = streams(1);
  ASSERT_EQ(stats.streams_size(), 2);
  EXPECT_EQ(stats.streams(0).max_error_m(), 2e-3);
  EXPECT_EQ(stats.streams(1).max_error_m(), 4e-3);
}

TEST_F(AdaptiveQuality, NoErrorPastTheLargestIsGiven) {
  ASSERT_TRUE(subscribe(ann_, base::max_error_max_m).ok());
  tick();
  for (int i = 0; i < 6; ++i) {
    strain(1, streams(1).streams(0).stream_id());
    tick();
    EXPECT_LE(streams(1).streams(0).max_error_m(), base::max_error_max_m);
  }
}

TEST_F(AdaptiveQuality, NoQualityMoreThanAWorldMayHaveIsMade) {
  ASSERT_TRUE(subscribe(ann_, 1e-3).ok());
  ASSERT_TRUE(subscribe(bob_, 1e-3, false).ok());
  for (net::SessionId id = 3; hub_.class_count() < base::world_quality_classes_max; ++id) {
    const auto reader = std::make_shared<Session>(id, "client " + std::to_string(id));
    ASSERT_TRUE(subscribe(reader, 1e-2 + 1e-4 * static_cast<double>(id), false).ok());
  }
  tick();
  strain(1, 1);
  EXPECT_EQ(sent(tick(), 1), "delta 1 ") << "there is no room";
  hub_.session_ended(2);
  strain(1, 1);
  tick();
  EXPECT_EQ(streams(1).streams(0).max_error_m(), 2e-3) << "what it leaves makes room";
  EXPECT_EQ(hub_.class_count(), base::world_quality_classes_max);
}

TEST_F(AdaptiveQuality, ReportsOfStrangersAndOfEndedStreamsAreIgnored) {
  ASSERT_TRUE(subscribe(ann_, 1e-3).ok());
  tick();
  strain(2, 1);
  strain(1, 99);
  EXPECT_EQ(sent(tick(), 1), "delta 1 ");
  strain(1, 1);
  tick();
  strain(1, 1);  // of the stream before
  EXPECT_EQ(sent(tick(), 1), "delta 2 ");
  hub_.session_ended(1);
  strain(1, 2);
  tick();
  EXPECT_EQ(hub_.class_count(), 0U);
}

TEST_F(AdaptiveQuality, AWorldAtRestMovesItsReadersToo) {
  ASSERT_TRUE(subscribe(ann_, 1e-3).ok());
  tick();
  strain(1, 1);
  Outbox outbox;
  hub_.encode_rest(LiveFrames(world_.physics()), world_.tick(), outbox);
  EXPECT_EQ(sent(outbox, 1), "end 1 replaced 1 2 layout 2 key 2 ");
}

}  // namespace
}  // namespace pneuma::app
