// Shows what subscribers of a running world see: the same world whoever watches, a key at once for who joins late, a
// gap and a key for who reads too slowly, frames of a paused world, and a hit within a few frames.
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "raw_connection.h"
#include "served.h"

namespace pneuma::integration {
namespace {

class Streaming : public Served {
 protected:
  void SetUp() override { start(); }
};

TEST_F(Streaming, TwoClientsSeeTheSameFrames) {
  client::Client ann = connect();
  client::Client bob = connect();
  create(ann, two_balls(), "w", true);
  ASSERT_TRUE(ann.subscribe("w").ok());
  ASSERT_TRUE(bob.subscribe("w").ok());
  ASSERT_TRUE(ann.step("w", 20).ok());
  const auto last = [](const auto& frame) { return frame.tick == 20; };
  const auto seen_by_ann = await_frame(ann, last);
  const auto seen_by_bob = await_frame(bob, last);
  ASSERT_TRUE(seen_by_ann && seen_by_bob);
  for (std::size_t body = 0; body < 2; ++body) {
    EXPECT_EQ(seen_by_ann->bodies[body].positions_m, seen_by_bob->bodies[body].positions_m);
  }
  EXPECT_EQ(ann.stats("w")->quality_classes(), 1U);
}

TEST_F(Streaming, ALateJoinerStartsWithAKeyAndSeesTheSame) {
  client::Client ann = connect();
  create(ann, two_balls(), "w");
  ASSERT_TRUE(ann.subscribe("w").ok());
  ASSERT_TRUE(await_frame(ann, [](const auto& frame) { return frame.tick > 10; }));
  client::Client bob = connect();
  ASSERT_TRUE(bob.subscribe("w").ok());
  const auto first = await_frame(bob);
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->key);
  // Where this machine is too slow for the stream, keys come in between.
  const auto delta = await_frame(bob, [](const auto& frame) { return !frame.key; });
  ASSERT_TRUE(delta);
  const auto paused = ann.pause("w");
  ASSERT_TRUE(paused.ok());
  const auto last = [&](const auto& frame) { return frame.tick == paused->tick(); };
  const auto seen_by_ann = await_frame(ann, last);
  const auto seen_by_bob = last(*delta) ? delta : await_frame(bob, last);
  ASSERT_TRUE(seen_by_ann && seen_by_bob);
  EXPECT_EQ(seen_by_ann->bodies[1].positions_m, seen_by_bob->bodies[1].positions_m);
}

TEST_F(Streaming, AReaderIsToldOfItsOwnStreamsAlone) {
  client::Client ann = connect();
  client::Client bob = connect();
  create(ann, two_balls(), "w", true);
  const auto fine = ann.subscribe("w", {.max_error_m = 1e-4});
  const auto coarse = ann.subscribe("w", {.rate_hz = 20.0, .max_error_m = 1e-2});
  ASSERT_TRUE(fine.ok() && coarse.ok());
  ASSERT_TRUE(ann.step("w", 30).ok());
  std::size_t bytes = 0;
  std::uint64_t frames = 0;
  const auto seen = await_frame(ann, [&](const auto& frame) {
    if (frame.stream_id != fine->stream_id()) return false;
    bytes += frame.bytes;
    ++frames;
    return frame.tick == 30;
  });
  ASSERT_TRUE(seen);
  const auto stats = ann.stats("w");
  ASSERT_TRUE(stats.ok());
  ASSERT_EQ(stats->streams_size(), 2);
  for (const auto& stream : stats->streams()) {
    const bool is_fine = stream.stream_id() == fine->stream_id();
    EXPECT_EQ(stream.rate_hz(), is_fine ? 60.0 : 20.0);
    EXPECT_EQ(stream.max_error_m(), is_fine ? 1e-4 : 1e-2);
    EXPECT_GT(stream.encode_time_us(), 0.0);
    EXPECT_GT(stream.drain_bytes_s(), 0.0);
    if (!is_fine) continue;
    EXPECT_EQ(stream.frames_sent(), frames);
    EXPECT_DOUBLE_EQ(stream.bits_per_vertex(), 8.0 * static_cast<double>(bytes) / static_cast<double>(frames * 324));
  }
  EXPECT_EQ(bob.stats("w")->streams_size(), 0);
}

TEST_F(Streaming, AJoinerOfAPausedWorldGetsAKeyWithoutAStep) {
  client::Client ann = connect();
  create(ann, two_balls(), "w", true);
  ASSERT_TRUE(ann.subscribe("w").ok());
  const auto frame = await_frame(ann);
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->key);
  EXPECT_EQ(frame->tick, 0U);
  EXPECT_EQ(ann.stats("w")->tick(), 0U);
}

TEST_F(Streaming, AJoinerSeesItsFirstFrameWithinTwoTicks) {
  client::Client ann = connect();
  v1::Scene slow = two_balls();  // a tick is longer than this machine may take from one request to the next
  slow.mutable_stepping()->set_rate_hz(10.0);
  slow.mutable_stepping()->set_substeps(64);
  create(ann, slow, "w");
  v1::ClientMessage ask;
  ask.set_request_id(2);
  ask.mutable_get_stats()->set_world("w");
  v1::ClientMessage join;
  join.set_request_id(3);
  join.mutable_subscribe()->set_world("w");
  const std::string both =
      RawConnection::envelope(ask.SerializeAsString()) + RawConnection::envelope(join.SerializeAsString());
  for (int i = 0; i < 5; ++i) {
    RawConnection raw(server_->tcp_address());
    ASSERT_TRUE(raw.say_hello());
    ASSERT_TRUE(raw.send(both));
    const auto stats = raw.receive_reply(2);
    ASSERT_TRUE(stats && stats->has_stats());
    auto message = raw.receive();
    while (message && !message->has_frame()) message = raw.receive();
    ASSERT_TRUE(message);
    EXPECT_FALSE(message->frame().has_base_tick());
    EXPECT_GE(message->frame().tick(), stats->stats().tick());
    EXPECT_LE(message->frame().tick(), stats->stats().tick() + 2);
  }
}

TEST_F(Streaming, AReconnectingClientIsNotSentItsTopologiesAgain) {
  client::Client first = connect();
  create(first, two_balls(), "w", true);
  ASSERT_TRUE(first.subscribe("w").ok());
  ASSERT_TRUE(await_frame(first));
  const auto held = first.topologies();
  ASSERT_EQ(held.size(), 1U);

  RawConnection raw(server_->tcp_address());
  ASSERT_TRUE(raw.say_hello());
  v1::ClientMessage subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->set_world("w");
  subscribe.mutable_subscribe()->add_known_topologies(held[0]->hash);
  ASSERT_TRUE(raw.send(subscribe));
  std::string order;
  while (auto message = raw.receive()) {
    if (message->has_subscribed()) order += "subscribed ";
    if (message->has_topology()) order += "topology ";
    if (message->has_layout()) order += "layout ";
    if (message->has_frame()) {
      order += "frame";
      break;
    }
  }
  EXPECT_EQ(order, "subscribed layout frame");
}

TEST_F(Streaming, AHitShowsInTheFrameItsReplyNames) {
  client::Client ann = connect();
  create(ann, two_balls(), "w", true);
  create(ann, two_balls(), "untouched", true);
  const auto stream = ann.subscribe("w", {.max_error_m = 1e-5})->stream_id();
  const auto twin = ann.subscribe("untouched", {.max_error_m = 1e-5})->stream_id();
  const auto stepped = ann.step("w", 5);
  ASSERT_TRUE(stepped.ok()) << stepped.status().message();
  ASSERT_TRUE(ann.step("untouched", 6).ok());
  v1::Impulse impulse;
  impulse.set_world("w");
  impulse.set_body("left");
  impulse.set_vertex(11);
  *impulse.mutable_impulse() = vec(0.5, 0.0, 0.0);
  const auto done = ann.impulse(impulse);
  ASSERT_TRUE(done.ok());
  EXPECT_EQ(done->tick(), 6U);
  ASSERT_TRUE(ann.step("w", 1).ok());
  std::optional<client::DecodedFrame> hit;
  std::optional<client::DecodedFrame> calm;
  while (!hit || !calm) {
    auto frame = await_frame(ann, [](const auto& candidate) { return candidate.tick == 6; });
    ASSERT_TRUE(frame);
    ASSERT_TRUE(frame->stream_id == stream || frame->stream_id == twin);
    (frame->stream_id == stream ? hit : calm) = std::move(frame);
  }
  EXPECT_GT(hit->bodies[0].positions_m[3 * 11], calm->bodies[0].positions_m[3 * 11] + 1e-3);
}

TEST_F(Streaming, AClientSeesOnlyWhatItAsksFor) {
  client::Client ann = connect();
  create(ann, two_balls(), "w", true);
  const auto subscribed = ann.subscribe(
      "w", {.max_error_m = 1e-4, .bodies = {"right"}, .level_of_detail = 1, .velocities = true, .scalars = true});
  ASSERT_TRUE(subscribed.ok()) << subscribed.status().message();
  const auto first = await_frame(ann);  // of a world at rest, when the coarser mesh is made
  ASSERT_TRUE(first);
  EXPECT_EQ(first->tick, 0U);
  ASSERT_TRUE(ann.step("w", 30).ok());
  const auto frame = await_frame(ann, [](const auto& candidate) { return candidate.tick == 30; });
  ASSERT_TRUE(frame);
  ASSERT_EQ(frame->bodies.size(), 1U);
  const client::SoftBodyFrame& ball = frame->bodies[0];
  EXPECT_EQ(ball.name, "right");
  EXPECT_EQ(ball.kept_vertices->size(), 41U);
  EXPECT_EQ(ball.topology->vertex_count, 41U);
  EXPECT_EQ(frame->solids.size(), 2U);
  const double fallen_m_s = -9.81 * 0.5;
  EXPECT_NEAR(ball.velocities_m_s[1], fallen_m_s, 0.5);
  const auto stats = ann.stats("w");
  EXPECT_FLOAT_EQ(static_cast<float>(ball.scalars.volume_m3), static_cast<float>(stats->soft_bodies(1).volume_m3()));

  client::SubscribeOptions unknown;
  unknown.bodies = {"right", "wrong"};
  const auto refused = ann.subscribe("w", unknown);
  EXPECT_EQ(refused.status().code(), base::StatusCode::not_found);
  EXPECT_EQ(refused.status().where(), "subscribe.bodies[1]");
}

// A reader that stalls while frames that do not fit its buffers come, then reads again.
TEST_F(Streaming, AStalledReaderIsToldOfTheGapAndGetsAKey) {
  start({"--output-queue-bytes-max", "200000"});
  client::Client ann = connect();
  v1::Scene big = two_balls();
  big.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(5);
  big.mutable_stepping()->set_substeps(1);
  big.mutable_stepping()->set_integrator(v1::Stepping::MIDPOINT);
  big.mutable_stepping()->set_on_unstable(v1::Stepping::ALLOW);  // they fall, and nothing shakes them
  for (auto& body : *big.mutable_soft_bodies()) {
    body.mutable_springs()->set_stiffness_n_m(1.0);
    body.mutable_springs()->set_damping_n_s_m(0.0);
  }
  create(ann, big, "w", true);

  RawConnection slow(server_->tcp_address(), 16 * 1024);
  ASSERT_TRUE(slow.say_hello());
  v1::ClientMessage subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->set_world("w");
  subscribe.mutable_subscribe()->set_max_error_m(1e-6);
  ASSERT_TRUE(slow.send(subscribe));
  const auto subscribed = slow.receive_reply(2);
  ASSERT_TRUE(subscribed && subscribed->has_subscribed());
  std::optional<std::uint64_t> last_tick;
  while (!last_tick) {
    const auto message = slow.receive();
    ASSERT_TRUE(message) << "the connection ended";
    if (message->has_frame()) last_tick = message->frame().tick();
  }
  // The world does not wait for the reader that reads nothing more.
  ASSERT_TRUE(ann.step("w", 400).ok());

  std::optional<v1::Gap> gap;
  bool key_after_gap = false;
  while (last_tick != 400U) {
    const auto message = slow.receive();
    ASSERT_TRUE(message) << "the connection ended";
    if (message->has_gap()) {
      gap = message->gap();
      key_after_gap = false;
    }
    if (!message->has_frame()) continue;
    const v1::Frame& frame = message->frame();
    if (frame.has_base_tick()) {
      EXPECT_EQ(frame.base_tick(), last_tick) << "a delta on a frame that was not sent";
    } else {
      key_after_gap = true;
    }
    last_tick = frame.tick();
    if (gap && key_after_gap) break;
  }
  ASSERT_TRUE(gap) << "400 frames fitted the buffers of a reader that read nothing";
  EXPECT_EQ(gap->stream_id(), subscribed->subscribed().stream_id());
  EXPECT_LE(gap->from_tick(), gap->to_tick());
  EXPECT_TRUE(key_after_gap);
}

// A reader at a third of what a stream in layers takes, which is a little more than its layer 0 takes. Without layers,
// or where what waits in sockets came in large bursts, it got a gap and a key frame every other second.
TEST_F(Streaming, AReaderAtAThirdOfALayeredStreamsRateGetsNoGap) {
  constexpr std::chrono::seconds read_for{10};
  constexpr std::uint64_t measured_ticks = 120;
  start({"--scene", "five-balls"});
  client::Client ann = connect();
  const auto full = ann.subscribe("five-balls", {.max_error_m = 1e-6, .time_layers = true});
  ASSERT_TRUE(full.ok()) << full.status().message();
  const auto first = await_frame(ann);
  ASSERT_TRUE(first);
  double bytes = 0.0;
  ASSERT_TRUE(await_frame(ann, [&](const auto& frame) {
    bytes += static_cast<double>(frame.bytes);
    return frame.tick >= first->tick + measured_ticks;
  }));
  const double bytes_s = bytes / (static_cast<double>(measured_ticks) * full->tick_s());
  ASSERT_TRUE(ann.unsubscribe(full->stream_id()).ok());

  RawConnection slow(server_->tcp_address());
  ASSERT_TRUE(slow.say_hello());
  v1::ClientMessage subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->set_world("five-balls");
  subscribe.mutable_subscribe()->set_max_error_m(1e-6);
  subscribe.mutable_subscribe()->set_time_layers(true);
  ASSERT_TRUE(slow.send(subscribe));
  slow.read_at(bytes_s / 3.0);
  int keys = 0;
  std::array<int, 3> of_layer{};
  for (const auto end = std::chrono::steady_clock::now() + read_for; std::chrono::steady_clock::now() < end;) {
    const auto message = slow.receive();
    ASSERT_TRUE(message) << "the connection ended";
    ASSERT_FALSE(message->has_gap()) << message->gap().from_tick() << " to " << message->gap().to_tick();
    if (!message->has_frame()) continue;
    keys += message->frame().has_base_tick() ? 0 : 1;
    ++of_layer.at(message->frame().layer());
  }
  EXPECT_EQ(keys, 1) << "the one that it began with";
  EXPECT_GT(of_layer[0], 0);
  EXPECT_LT(of_layer[2], 2 * of_layer[0]) << "layer 2 goes first";
}

// A reader that asks for adaptive quality, and stalls until it was moved.
TEST_F(Streaming, AnAdaptiveReaderThatStallsIsGivenAnotherStream) {
  client::Client ann = connect();
  v1::Scene scene = light_and_quick();
  scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(2);
  create(ann, scene, "w");
  ASSERT_TRUE(ann.subscribe("w", {.max_error_m = 1e-6}).ok());
  RawConnection slow(server_->tcp_address(), 16 * 1024);
  ASSERT_TRUE(slow.say_hello());
  v1::ClientMessage subscribe;
  subscribe.set_request_id(2);
  subscribe.mutable_subscribe()->set_world("w");
  subscribe.mutable_subscribe()->set_max_error_m(1e-6);
  subscribe.mutable_subscribe()->set_adaptive(true);
  ASSERT_TRUE(slow.send(subscribe));
  const auto deadline = std::chrono::steady_clock::now() + patience;
  std::uint32_t classes = 0;
  std::uint64_t tick = 0;
  while (classes < 2 && std::chrono::steady_clock::now() < deadline) {
    // A server takes only so many requests a second.
    ASSERT_TRUE(await_frame(ann, [&](const auto& frame) { return frame.tick >= tick + 100; }));
    const auto stats = ann.stats("w");
    ASSERT_TRUE(stats.ok()) << stats.status().message();
    tick = stats->tick();
    classes = stats->quality_classes();
  }
  ASSERT_EQ(classes, 2U) << "it has a quality of its own";

  client::StreamDecoder decoder;
  std::uint32_t present = 0;
  bool was_replaced = false;
  bool read_successor = false;
  while (!read_successor) {
    const auto message = slow.receive();
    ASSERT_TRUE(message);
    base::Status taken;
    if (message->has_subscribed()) {
      present = message->subscribed().stream_id();
      taken = decoder.add_stream(message->subscribed());
    } else if (message->has_topology()) {
      taken = decoder.take_topology(message->topology());
    } else if (message->has_layout()) {
      EXPECT_EQ(message->layout().stream_id(), present);
      taken = decoder.take_layout(message->layout());
    } else if (message->has_event() && message->event().kind() == v1::Event::STREAM_REPLACED) {
      const v1::Event& event = message->event();
      EXPECT_EQ(event.stream_id(), present);
      EXPECT_GT(event.successor().max_error_m(), 1e-6);
      EXPECT_EQ(event.successor().world(), "w");
      present = event.successor().stream_id();
      taken = decoder.add_stream(event.successor());
      was_replaced = true;
    } else if (message->has_frame()) {
      EXPECT_EQ(message->frame().stream_id(), present) << "nothing of a stream that was replaced";
      taken = decoder.take_frame(message->frame(), 0).status();
      read_successor = was_replaced;
    }
    ASSERT_TRUE(taken.ok()) << taken.message();
  }
}

TEST_F(Streaming, TimeLayersShowTheSameWorld) {
  client::Client ann = connect();
  create(ann, two_balls(), "w", true);
  const auto plain = ann.subscribe("w");
  const auto layered = ann.subscribe("w", {.time_layers = true});
  ASSERT_TRUE(plain.ok() && layered.ok());
  using Places = std::map<std::uint64_t, std::vector<double>>;  // by tick
  Places expected;
  Places seen;
  std::set<std::uint32_t> layers;
  // Where this machine is too slow for the streams, some frames are left out.
  while (layers.size() < 3) {
    const auto done = ann.step("w", 8);
    ASSERT_TRUE(done.ok());
    while (!expected.contains(done->tick()) || !seen.contains(done->tick())) {
      const auto frame = await_frame(ann);
      ASSERT_TRUE(frame);
      Places& places = frame->stream_id == plain->stream_id() ? expected : seen;
      places[frame->tick] = frame->bodies[0].positions_m;
      if (frame->stream_id == layered->stream_id()) layers.insert(frame->layer);
    }
  }
  for (const auto& [tick, places_m] : seen) {
    const auto same = expected.find(tick);
    if (same == expected.end()) continue;
    for (std::size_t i = 0; i < places_m.size(); ++i) {
      EXPECT_NEAR(places_m[i], same->second[i], 2e-3) << "each is within 1e-3";
    }
  }
}

TEST_F(Streaming, AClientThatSimulatesSeesTheSameWorldForFewerBytes) {
  client::Client ann = connect();
  client::Client bob = connect();
  create(ann, two_balls(), "w", true);
  const auto plain = ann.subscribe("w", {.max_error_m = 1e-5});
  const auto simulated = bob.subscribe("w", {.max_error_m = 1e-5, .simulated = true});
  ASSERT_TRUE(plain.ok() && simulated.ok());
  const auto bytes_to = [](client::Client& client, std::uint64_t tick, std::optional<client::DecodedFrame>& last) {
    std::size_t bytes = 0;
    last = await_frame(client, [&](const auto& frame) {
      if (!frame.key) bytes += frame.bytes;
      return frame.tick == tick;
    });
    return bytes;
  };
  std::size_t plain_bytes = 0;
  std::size_t simulated_bytes = 0;
  for (std::uint64_t tick = 2; tick <= 60; tick += 2) {  // no more than a queue holds
    ASSERT_TRUE(ann.step("w", 2).ok());
    std::optional<client::DecodedFrame> seen_by_ann;
    std::optional<client::DecodedFrame> seen_by_bob;
    plain_bytes += bytes_to(ann, tick, seen_by_ann);
    simulated_bytes += bytes_to(bob, tick, seen_by_bob);
    ASSERT_TRUE(seen_by_ann && seen_by_bob);
    for (std::size_t body = 0; body < 2; ++body) {
      const auto& a = seen_by_ann->bodies[body].positions_m;
      const auto& b = seen_by_bob->bodies[body].positions_m;
      ASSERT_EQ(a.size(), b.size());
      for (std::size_t i = 0; i < a.size(); ++i) ASSERT_NEAR(a[i], b[i], 2e-5);
    }
  }
  EXPECT_LT(simulated_bytes, plain_bytes);
}

TEST_F(Streaming, ARunawayBodyIsReportedAndTheOthersGoOn) {
  client::Client ann = connect();
  create(ann, two_balls(), "w", true);
  ASSERT_TRUE(ann.subscribe("w").ok());
  v1::Impulse impulse;
  impulse.set_world("w");
  impulse.set_body("left");
  *impulse.mutable_impulse() = vec(1e8, 0.0, 0.0);
  ASSERT_TRUE(ann.impulse(impulse).ok());
  ASSERT_TRUE(ann.step("w", 10).ok());
  const auto event = await_event(ann, v1::Event::BODY_FROZEN);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->body(), "left");
  EXPECT_FALSE(event->detail().empty());
  const auto stats = ann.stats("w");
  EXPECT_TRUE(stats->soft_bodies(0).frozen());
  EXPECT_FALSE(stats->soft_bodies(1).frozen());
  EXPECT_LT(stats->soft_bodies(1).momentum().y(), 0.0) << "it falls on";
}

TEST_F(Streaming, ABurstBodyIsReportedAndItsGasIsGone) {
  client::Client ann = connect();
  v1::Scene scene = two_balls();
  scene.mutable_soft_bodies(1)->mutable_gas()->set_moles(1.0);
  scene.mutable_soft_bodies(1)->mutable_gas()->set_burst_pressure_pa(1.0);
  create(ann, scene, "w", true);
  ASSERT_TRUE(ann.subscribe("w").ok());
  ASSERT_TRUE(ann.step("w", 2).ok());
  const auto event = await_event(ann, v1::Event::BODY_BURST);
  ASSERT_TRUE(event);
  EXPECT_EQ(event->body(), scene.soft_bodies(1).name());
  EXPECT_EQ(ann.stats("w")->soft_bodies(1).moles(), 0.0);
}

}  // namespace
}  // namespace pneuma::integration
