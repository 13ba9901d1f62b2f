// Shows that a reader whose vertices go wrong finds it out with the first frame that is wrong, by the frame's check,
// and is set right by the key frame that it asks for; and what comes of it where a server tells no check. A payload
// that still reads with a bit of it changed is what a wrong step in a reader would be. A real world, hub and decoder.
#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "app/protocol.h"
#include "ball_scene.h"
#include "net/output_queue.h"
#include "pneuma_client/frames.h"

namespace pneuma::app {
namespace {

constexpr double checked_error_m = 1e-4;

class StreamCheck : public testing::Test {
 protected:
  StreamCheck()
      : world_(std::move(*LiveWorld::create(ball_scene()))),
        hub_([this] { return ++last_stream_id_; }, [](std::uint32_t) {}) {}

  void subscribe(bool velocities, bool simulated, bool time_layers) {
    v1::Subscribe request;
    request.set_world("w");
    request.set_max_error_m(checked_error_m);
    request.set_velocities(velocities);
    request.set_simulated(simulated);
    request.set_time_layers(time_layers);
    const auto subscribed = hub_.subscribe(session_, request, 60.0);
    ASSERT_TRUE(subscribed.ok()) << subscribed.status().message();
    ASSERT_TRUE(decoder_.add_stream(*subscribed).ok());
  }

  /// The next frame to come, in whatever tick; layouts go to the decoder.
  v1::Frame next_frame() {
    while (frames_.empty()) tick();
    v1::Frame frame = std::move(frames_.front());
    frames_.pop_front();
    return frame;
  }

  void tick() {
    world_.physics().step_tick(workers_);
    std::vector<double>& exact_m = exact_m_[world_.tick()];
    exact_m.resize(3 * 42);
    world_.physics().copy_positions(0, exact_m);
    Outbox outbox;
    hub_.encode_tick(LiveFrames(world_.physics()), world_.tick(), false, outbox);
    for (const auto& item : outbox.items) {
      if (const auto* send = std::get_if<Outbox::Send>(&item)) {
        EXPECT_TRUE(queue_.push_reply(send->message));
      } else if (const auto* missing = std::get_if<Outbox::SendTopology>(&item)) {
        EXPECT_TRUE(queue_.push_reply(missing->topology.message));
      } else if (const auto* publish = std::get_if<Outbox::Publish>(&item)) {
        queue_.offer(publish->frame, {});
      }
    }
    for (const net::SharedBytes& bytes : queue_.take(std::size_t{1} << 20U, {})) {
      v1::ServerMessage message;
      EXPECT_TRUE(message.ParseFromString(*bytes));
      const base::Status taken = message.has_topology() ? decoder_.take_topology(message.topology())
                                 : message.has_layout() ? decoder_.take_layout(message.layout())
                                                        : base::Status();
      EXPECT_TRUE(taken.ok()) << taken.message();
      if (message.has_frame()) frames_.push_back(message.frame());
    }
    queue_.written();
  }

  [[nodiscard]] double off_m(const client::DecodedFrame& frame) const {
    const std::vector<double>& seen_m = frame.bodies.at(0).positions_m;
    const std::vector<double>& true_m = exact_m_.at(frame.tick);
    double furthest_m = 0.0;
    for (std::size_t i = 0; i < seen_m.size(); i += 3) {
      furthest_m = std::max(
          furthest_m, std::hypot(seen_m[i] - true_m[i], seen_m[i + 1] - true_m[i + 1], seen_m[i + 2] - true_m[i + 2]));
    }
    return furthest_m;
  }

  void take_right(int frames) {
    for (int i = 0; i < frames; ++i) {
      const auto frame = decoder_.take_frame(next_frame(), 0);
      ASSERT_TRUE(frame.ok()) << frame.status().message();
      ASSERT_TRUE(frame->has_value());
      ASSERT_LE(off_m(**frame), checked_error_m);
    }
  }

  /// The frame, with one bit of `payload` changed so that it reads, to other vertices or velocities.
  std::optional<v1::Frame> with_a_wrong_step(const v1::Frame& frame, std::string* (v1::Frame::*payload)()) const {
    client::StreamDecoder right = decoder_;
    const auto expected = right.take_frame(frame, 0);
    EXPECT_TRUE(expected.ok()) << expected.status().message();
    if (!expected.ok()) return std::nullopt;
    const client::SoftBodyFrame& ball = (*expected)->bodies.at(0);
    for (std::size_t byte = 4; byte < (v1::Frame(frame).*payload)()->size(); ++byte) {
      v1::Frame wrong = frame;
      std::string& bytes = *(wrong.*payload)();
      bytes[byte] = static_cast<char>(static_cast<unsigned char>(bytes[byte]) ^ 1U);
      v1::Frame unchecked = wrong;
      unchecked.clear_check();
      unchecked.clear_velocities_check();
      client::StreamDecoder decoder = decoder_;
      const auto read = decoder.take_frame(unchecked, 0);
      if (!read.ok()) continue;
      const client::SoftBodyFrame& other = (*read)->bodies.at(0);
      if (other.positions_m != ball.positions_m || other.velocities_m_s != ball.velocities_m_s) return wrong;
    }
    return std::nullopt;
  }

  /// Takes a frame with a wrong step, then those up to the key frame that is asked for, and some more.
  void go_wrong_and_recover(std::string* (v1::Frame::*payload)(), const std::string& what) {
    std::optional<v1::Frame> wrong;
    for (int tries = 0; !wrong && tries < 60; ++tries) {
      const v1::Frame frame = next_frame();
      wrong = with_a_wrong_step(frame, payload);
      if (!wrong) {
        ASSERT_TRUE(decoder_.take_frame(frame, 0).ok());
      }
    }
    ASSERT_TRUE(wrong) << "a frame that reads with a bit changed";
    const auto taken = decoder_.take_frame(*wrong, 0);
    ASSERT_FALSE(taken.ok());
    EXPECT_EQ(taken.status().code(), base::StatusCode::malformed);
    EXPECT_NE(taken.status().message().find(what + " at tick " + std::to_string(wrong->tick())), std::string::npos)
        << taken.status().message();
    EXPECT_TRUE(decoder_.waits_for_key(wrong->stream_id()));

    const auto ignored = decoder_.take_frame(next_frame(), 0);
    ASSERT_TRUE(ignored.ok()) << "the error is told once";
    EXPECT_FALSE(ignored->has_value());
    ASSERT_TRUE(hub_.request_key(session_->id(), wrong->stream_id()));
    std::optional<client::DecodedFrame> key;
    for (int frames = 0; !key && frames < 5; ++frames) {
      auto frame = decoder_.take_frame(next_frame(), 0);
      ASSERT_TRUE(frame.ok()) << frame.status().message();
      key = std::move(*frame);
    }
    ASSERT_TRUE(key);
    EXPECT_TRUE(key->key);
    EXPECT_LE(off_m(*key), checked_error_m);
    EXPECT_FALSE(decoder_.waits_for_key(wrong->stream_id()));
    take_right(30);
  }

  LiveWorld world_;
  physics::Workers workers_{1};
  std::uint32_t last_stream_id_ = 0;
  FrameHub hub_;
  std::shared_ptr<Session> session_ = std::make_shared<Session>(1);
  net::OutputQueue queue_{8U << 20U, make_gap};
  client::StreamDecoder decoder_;
  std::deque<v1::Frame> frames_;
  std::map<std::uint64_t, std::vector<double>> exact_m_;  // by tick
};

TEST_F(StreamCheck, IsInEveryFrame) {
  subscribe(true, false, true);
  for (int i = 0; i < 12; ++i) {
    const v1::Frame frame = next_frame();
    EXPECT_TRUE(frame.has_check()) << frame.tick();
    EXPECT_TRUE(frame.has_velocities_check()) << frame.tick();
    EXPECT_LT(frame.check(), 1U << 14U);
  }
}

TEST_F(StreamCheck, AStreamWithoutVelocitiesHasNoneOfThem) {
  subscribe(false, false, false);
  EXPECT_FALSE(next_frame().has_velocities_check());
  EXPECT_FALSE(next_frame().has_velocities_check());
}

TEST_F(StreamCheck, AWrongStepIsFoundAtOnceAndAKeyFrameSetsItRight) {
  subscribe(false, false, false);
  take_right(20);
  for (int round = 0; round < 5; ++round) go_wrong_and_recover(&v1::Frame::mutable_payload, "the vertices");
}

TEST_F(StreamCheck, OfABodyThatIsSimulatedToo) {
  subscribe(false, true, false);
  take_right(20);
  go_wrong_and_recover(&v1::Frame::mutable_payload, "the vertices");
}

TEST_F(StreamCheck, InTimeLayersToo) {
  subscribe(false, false, true);
  take_right(20);
  for (int round = 0; round < 5; ++round) go_wrong_and_recover(&v1::Frame::mutable_payload, "the vertices");
}

TEST_F(StreamCheck, OfVelocitiesToo) {
  subscribe(true, false, false);
  take_right(20);
  go_wrong_and_recover(&v1::Frame::mutable_velocities, "the velocities");
}

TEST_F(StreamCheck, WhereTheServerTellsNoneAWrongStepGrowsUnseen) {
  subscribe(false, false, false);
  take_right(20);
  std::optional<v1::Frame> wrong;
  while (!wrong) {
    const v1::Frame frame = next_frame();
    wrong = with_a_wrong_step(frame, &v1::Frame::mutable_payload);
    if (!wrong) {
      ASSERT_TRUE(decoder_.take_frame(frame, 0).ok());
    }
  }
  wrong->clear_check();
  ASSERT_TRUE(decoder_.take_frame(*wrong, 0).ok());
  double furthest_m = 0.0;
  for (int i = 0; i < 30; ++i) {
    v1::Frame frame = next_frame();
    frame.clear_check();
    const auto taken = decoder_.take_frame(frame, 0);
    ASSERT_TRUE(taken.ok()) << taken.status().message();
    furthest_m = off_m(**taken);
  }
  EXPECT_GT(furthest_m, checked_error_m);
}

TEST_F(StreamCheck, AKeyFrameThatFailsItIsNotAskedForAgain) {
  subscribe(false, false, false);
  v1::Frame key = next_frame();
  ASSERT_FALSE(key.has_base_tick());
  key.set_check(key.check() ^ 1U);
  EXPECT_FALSE(decoder_.take_frame(key, 0).ok());
  EXPECT_FALSE(decoder_.waits_for_key(key.stream_id()));
}

}  // namespace
}  // namespace pneuma::app
