// Shows a stream in time layers as its readers see it, whatever of it they shed: each frame decodes to the world within
// the bound, fewer frames come to the slower ones and no keys, who joins is in step at once, and a world that comes to
// rest is seen at rest by all. A real world, hub, queue and decoder; no sockets and no clock.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <random>

#include <gtest/gtest.h>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "app/protocol.h"
#include "ball_scene.h"
#include "net/output_queue.h"
#include "pneuma_client/frames.h"

namespace pneuma::app {
namespace {

constexpr double layers_error_m = 1e-4;
constexpr std::size_t everything = 1U << 30;

/// What stands between a hub and a client: a queue, and a decoder behind it.
class Reader {
 public:
  Reader(net::SessionId id, FrameHub& hub, double rate_hz = 0.0) : session_(std::make_shared<Session>(id)), hub_(hub) {
    v1::Subscribe request;
    request.set_world("w");
    request.set_rate_hz(rate_hz);
    request.set_max_error_m(layers_error_m);
    request.set_time_layers(true);
    const auto subscribed = hub.subscribe(session_, request, 60.0);
    EXPECT_TRUE(subscribed.ok());
    EXPECT_TRUE(decoder_.add_stream(*subscribed).ok());
  }

  /// `time`: of the test's own.
  void deliver(const Outbox& outbox, net::Duration time = {}) {
    for (const auto& item : outbox.items) {
      if (const auto* send = std::get_if<Outbox::Send>(&item); send != nullptr && send->session == session_->id()) {
        EXPECT_TRUE(queue_.push_reply(send->message));
      }
      if (const auto* missing = std::get_if<Outbox::SendTopology>(&item);
          missing != nullptr && missing->session == session_) {
        session_->send_topology(missing->topology.hash,
                                [&] { EXPECT_TRUE(queue_.push_reply(missing->topology.message)); });
      }
      const auto* publish = std::get_if<Outbox::Publish>(&item);
      if (publish != nullptr && std::ranges::count(*publish->sessions, session_->id()) > 0) {
        queue_.offer(publish->frame, net::TimePoint() + time);
      }
    }
    ask_for_keys();
  }

  /// Reads what waits; the frames.
  std::vector<client::DecodedFrame> read(std::size_t bytes = everything) {
    std::vector<client::DecodedFrame> frames;
    for (const net::SharedBytes& bytes_of_one : queue_.take(bytes, {})) {
      v1::ServerMessage message;
      EXPECT_TRUE(message.ParseFromString(*bytes_of_one));
      const base::Status taken = message.has_topology() ? decoder_.take_topology(message.topology())
                                 : message.has_layout() ? decoder_.take_layout(message.layout())
                                                        : base::Status();
      EXPECT_TRUE(taken.ok()) << taken.message();
      gaps_ += message.has_gap() ? 1 : 0;
      if (!message.has_frame()) continue;
      auto frame = decoder_.take_frame(message.frame(), bytes_of_one->size());
      EXPECT_TRUE(frame.ok()) << frame.status().message();
      if (frame.ok()) frames.push_back(std::move(**frame));
    }
    queue_.written();
    ask_for_keys();
    return frames;
  }

  [[nodiscard]] int gaps() const { return gaps_; }

 private:
  void ask_for_keys() {
    for (const std::uint32_t stream : queue_.keys_to_ask_for()) hub_.key_wanted(session_->id(), stream);
  }

  std::shared_ptr<Session> session_;
  FrameHub& hub_;
  net::OutputQueue queue_{8U << 20, make_gap};
  client::StreamDecoder decoder_;
  int gaps_ = 0;
};

class TimeLayers : public testing::Test {
 protected:
  TimeLayers()
      : world_(std::move(*LiveWorld::create(ball_scene()))),
        hub_([this] { return ++last_stream_id_; }, [](std::uint32_t) {}) {}

  Outbox tick() {
    world_.physics().step_tick(workers_);
    std::vector<double>& exact = exact_[world_.tick()];
    exact.resize(3 * 42);
    world_.physics().copy_positions(0, exact);
    Outbox outbox;
    hub_.encode_tick(LiveFrames(world_.physics()), world_.tick(), false, outbox);
    return outbox;
  }

  Outbox rest() {
    Outbox outbox;
    hub_.encode_rest(LiveFrames(world_.physics()), world_.tick(), outbox);
    return outbox;
  }

  void expect_within_bound(const client::DecodedFrame& frame) {
    const std::vector<double>& exact = exact_.at(frame.tick);
    const std::vector<double>& decoded = frame.bodies.at(0).positions_m;
    for (std::size_t i = 0; i < exact.size(); i += 3) {
      EXPECT_LE(std::hypot(decoded[i] - exact[i], decoded[i + 1] - exact[i + 1], decoded[i + 2] - exact[i + 2]),
                layers_error_m);
    }
  }

  physics::Workers workers_{1};
  LiveWorld world_;
  std::uint32_t last_stream_id_ = 0;
  FrameHub hub_;
  std::map<std::uint64_t, std::vector<double>> exact_;
};

TEST_F(TimeLayers, FramesOfACycleAreOfTheirLayers) {
  Reader ann(1, hub_);
  std::vector<std::uint32_t> layers;
  for (int i = 0; i < 13; ++i) {
    ann.deliver(tick());
    for (const auto& frame : ann.read()) {
      layers.push_back(frame.layer);
      EXPECT_EQ(frame.key, frame.tick == 1);
      expect_within_bound(frame);
    }
  }
  EXPECT_EQ(layers, (std::vector<std::uint32_t>{0, 1, 2, 0, 2, 1, 2, 0, 2, 1, 2, 0, 2})) << "from tick 1 on";
}

TEST_F(TimeLayers, AReaderOfAQuarterOfTheFramesGetsNoGapAndNoKey) {
  Reader ann(1, hub_);
  ann.deliver(tick());
  EXPECT_EQ(ann.read().size(), 1U);
  std::size_t read = 0;
  for (int i = 0; i < 400; ++i) {
    ann.deliver(tick());
    if (i % 4 != 0) continue;
    for (const auto& frame : ann.read(1)) {  // one message at most
      EXPECT_FALSE(frame.key);
      expect_within_bound(frame);
      ++read;
    }
  }
  EXPECT_EQ(read, 100U);
  EXPECT_EQ(ann.gaps(), 0);
}

TEST_F(TimeLayers, WhoeverReadsWhatAndWhenDecodesTheWorld) {
  std::mt19937 random(5);
  Reader ann(1, hub_);
  Reader bob(2, hub_, 20.0);
  std::uint64_t keys = 0;
  std::array<std::uint64_t, 3> of_layer{};
  for (int i = 0; i < 3000; ++i) {
    const Outbox outbox = tick();
    for (Reader* reader : {&ann, &bob}) {
      reader->deliver(outbox, i * std::chrono::microseconds(16'667));
      // Now and then it stops for good; in between it reads a little less than comes.
      if ((i / 300) % 3 == 1 && random() % 40 != 0) continue;
      if (random() % 4 == 0) continue;
      std::uint64_t last_tick = 0;
      for (const auto& frame : reader->read(1 + random() % 200)) {
        expect_within_bound(frame);
        EXPECT_GT(frame.tick, last_tick);
        last_tick = frame.tick;
        ++of_layer.at(frame.layer);
        keys += frame.key ? 1U : 0U;
      }
      if (testing::Test::HasFailure()) FAIL() << "at tick " << world_.tick();
    }
  }
  EXPECT_GT(ann.gaps(), 5) << "layers 0 were lost too";
  EXPECT_GT(keys, 5U);
  for (const std::uint64_t count : of_layer) EXPECT_GT(count, 100U);
}

TEST_F(TimeLayers, WhoJoinsIsInStepAtOnce) {
  Reader ann(1, hub_);
  for (net::SessionId id = 2; id < 14; ++id) {
    ann.deliver(tick());
    Reader bob(id, hub_);
    for (int i = 0; i < 9; ++i) {
      const Outbox outbox = tick();
      ann.deliver(outbox);
      bob.deliver(outbox);
      const auto frames = bob.read();
      ASSERT_FALSE(frames.empty()) << "a frame a tick, from the first on";
      EXPECT_EQ(frames.back().tick, world_.tick());
      EXPECT_EQ(frames.front().key, i == 0);
      for (const auto& frame : frames) expect_within_bound(frame);
    }
    EXPECT_EQ(bob.gaps(), 0);
    hub_.session_ended(id);
    ann.read();
  }
}

TEST_F(TimeLayers, AWorldAtRestIsSeenAtRestByThoseWhoShedItsLastFrame) {
  Reader ann(1, hub_);
  for (int last = 4; last < 12; ++last) {
    ann.deliver(tick());
    ann.read();
    for (int i = 0; i < last; ++i) ann.deliver(tick());  // unread: the highest layers go
    ann.deliver(rest());
    std::vector<client::DecodedFrame> frames = ann.read();
    ann.deliver(rest());  // where a key was asked for
    for (auto& frame : ann.read()) frames.push_back(std::move(frame));
    ASSERT_FALSE(frames.empty());
    EXPECT_EQ(frames.back().tick, world_.tick());
    expect_within_bound(frames.back());
  }
}

TEST_F(TimeLayers, TheSameTickOnceMoreAndAnEarlierOneAreOfLayerZero) {
  Reader ann(1, hub_);
  for (int i = 0; i < 5; ++i) ann.deliver(tick());
  ann.deliver(rest());
  ann.read();
  for (const std::uint64_t tick : {5U, 3U, 3U}) {  // none of them of a turn of layer 0
    Outbox outbox;
    hub_.encode_tick(LiveFrames(world_.physics()), tick, false, outbox);
    ann.deliver(outbox);
    const auto frames = ann.read();
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_TRUE(frames[0].key);
    EXPECT_EQ(frames[0].layer, 0U);
    EXPECT_EQ(frames[0].tick, tick);
  }
}

TEST_F(TimeLayers, KeysAtAnIntervalAreOfLayerZero) {
  const auto session = std::make_shared<Session>(1);
  v1::Subscribe request;
  request.set_time_layers(true);
  request.set_key_interval_s(0.1);  // 6 ticks: each frame of layer 0, of which one comes every 4
  ASSERT_TRUE(hub_.subscribe(session, request, 60.0).ok());
  std::vector<std::uint64_t> keys;
  for (int i = 0; i < 16; ++i) {
    const Outbox outbox = tick();
    for (const auto& item : outbox.items) {
      const auto* publish = std::get_if<Outbox::Publish>(&item);
      if (publish != nullptr && publish->frame.delta == nullptr) keys.push_back(publish->frame.tick);
    }
  }
  EXPECT_EQ(keys, (std::vector<std::uint64_t>{1, 4, 8, 12, 16}));
}

TEST_F(TimeLayers, AreAStreamOfTheirOwn) {
  const auto session = std::make_shared<Session>(1);
  v1::Subscribe request;
  const auto plain = hub_.subscribe(session, request, 60.0);
  request.set_time_layers(true);
  const auto layered = hub_.subscribe(session, request, 60.0);
  EXPECT_NE(plain->stream_id(), layered->stream_id());
}

}  // namespace
}  // namespace pneuma::app
