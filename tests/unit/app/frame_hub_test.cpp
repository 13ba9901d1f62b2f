// Shows what subscribers get: topology and layout before the first frame, a key for who joins, deltas that decode to
// the same as keys, one encoding for all of a quality, nothing for ticks that are not due. A real world, no sockets.
#include "app/frame_hub.h"

#include <cmath>

#include <gtest/gtest.h>

#include "app/live_world.h"
#include "ball_scene.h"

namespace pneuma::app {
namespace {

class FrameHubTest : public testing::Test {
 protected:
  FrameHubTest()
      : world_(std::move(*LiveWorld::create(ball_scene()))),
        hub_([this] { return ++last_stream_id_; }, [this](std::uint32_t id) { dropped_.push_back(id); }) {}

  v1::Subscribed subscribe(const std::shared_ptr<Session>& session, double rate_hz = 0.0, double max_error_m = 0.0) {
    v1::Subscribe request;
    request.set_world("w");
    request.set_rate_hz(rate_hz);
    request.set_max_error_m(max_error_m);
    const auto subscribed = hub_.subscribe(session, request, 60.0);
    EXPECT_TRUE(subscribed.ok());
    return *subscribed;
  }

  Outbox tick() {
    world_.physics().step_tick(workers_);
    Outbox outbox;
    hub_.encode_tick(LiveFrames(world_.physics()), world_.tick(), false, outbox);
    return outbox;
  }

  static std::vector<net::StreamFrame> frames(const Outbox& outbox) {
    std::vector<net::StreamFrame> out;
    for (const auto& item : outbox.items) {
      if (const auto* publish = std::get_if<Outbox::Publish>(&item)) out.push_back(publish->frame);
    }
    return out;
  }

  static v1::ServerMessage parse(const net::SharedBytes& bytes) {
    v1::ServerMessage message;
    EXPECT_TRUE(bytes != nullptr && message.ParseFromString(*bytes));
    return message;
  }

  /// Kinds of what is sent to a session, "topology layout frame".
  static std::string kinds(const Outbox& outbox, net::SessionId session) {
    std::string out;
    for (const auto& item : outbox.items) {
      if (const auto* send = std::get_if<Outbox::Send>(&item); send != nullptr && send->session == session) {
        const auto message = parse(send->message);
        out += message.has_layout() ? "layout " : "other ";
      }
      if (const auto* missing = std::get_if<Outbox::SendTopology>(&item);
          missing != nullptr && missing->session->id() == session) {
        missing->session->send_topology(missing->topology.hash, [&] { out += "topology "; });
      }
      if (const auto* publish = std::get_if<Outbox::Publish>(&item)) {
        for (const auto id : *publish->sessions) out += id == session ? "frame " : "";
      }
    }
    return out;
  }

  physics::Workers workers_{1};
  LiveWorld world_;
  std::uint32_t last_stream_id_ = 0;
  std::vector<std::uint32_t> dropped_;
  FrameHub hub_;
  std::shared_ptr<Session> ann_ = std::make_shared<Session>(1);
  std::shared_ptr<Session> bob_ = std::make_shared<Session>(2);
};

TEST_F(FrameHubTest, TopologyAndLayoutGoBeforeTheFirstFrameAndOnce) {
  subscribe(ann_);
  const Outbox first = tick();
  EXPECT_EQ(kinds(first, 1), "topology layout frame ");
  EXPECT_NE(frames(first)[0].key, nullptr);
  EXPECT_EQ(kinds(tick(), 1), "frame ");
}

TEST_F(FrameHubTest, WhatNobodyTakesIsNotEncoded) {
  const std::uint32_t stream = subscribe(ann_).stream_id();
  ASSERT_EQ(subscribe(bob_).stream_id(), stream);
  tick();
  hub_.stream_stalled(1, stream);
  EXPECT_EQ(frames(tick()).size(), 1U) << "the other takes it";
  hub_.stream_stalled(2, stream);
  EXPECT_TRUE(frames(tick()).empty());
  EXPECT_TRUE(frames(tick()).empty());
  hub_.key_wanted(2, stream);
  const auto again = frames(tick());
  ASSERT_EQ(again.size(), 1U);
  EXPECT_NE(again[0].key, nullptr);
}

// A layout that came meanwhile goes before the first frame that it is of, at a rate that is not due then too.
TEST_F(FrameHubTest, WhatStalledGoesOnWithTheWorldAsItIs) {
  const std::uint32_t stream = subscribe(ann_, 1.0).stream_id();
  ASSERT_EQ(kinds(tick(), 1), "topology layout frame ");
  hub_.stream_stalled(1, stream);
  auto scene = world_.physics().scene();
  scene.soft_bodies.push_back(scene.soft_bodies.front());
  scene.soft_bodies.back().name = "new";
  scene.soft_bodies.back().position.x() += 5.0;
  ASSERT_TRUE(world_.physics().apply(scene).ok());
  hub_.edited();
  EXPECT_EQ(kinds(tick(), 1), "");
  hub_.key_wanted(1, stream);
  EXPECT_EQ(kinds(tick(), 1), "layout frame ");
}

TEST_F(FrameHubTest, OneClientLeavesQualitiesForOthers) {
  const auto ask = [&](const std::string& client, std::size_t i) {
    v1::Subscribe request;
    request.set_max_error_m(1e-3 * static_cast<double>(i + 1));
    const auto id = static_cast<net::SessionId>(100 + i / base::session_streams_per_world_max);
    return hub_.subscribe(std::make_shared<Session>(id, client), request, 60.0).status();
  };
  for (std::size_t i = 0; i < base::client_quality_classes_max; ++i) ASSERT_TRUE(ask("one", i).ok()) << i;
  const base::Status refused = ask("one", base::client_quality_classes_max);
  EXPECT_EQ(refused.code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(refused.where(), "subscribe");
  EXPECT_TRUE(ask("other", base::client_quality_classes_max).ok());
}

TEST_F(FrameHubTest, AKnownTopologyIsNotSentAgain) {
  subscribe(ann_);
  const Outbox first = tick();
  const auto topology = parse(std::get<Outbox::SendTopology>(first.items[0]).topology.message).topology();
  v1::Subscribe request;
  request.add_known_topologies(topology.hash());
  ASSERT_TRUE(hub_.subscribe(bob_, request, 60.0).ok());
  EXPECT_EQ(kinds(tick(), 2), "layout frame ");
}

TEST_F(FrameHubTest, WhatIsNoHashOfATopologyIsRefused) {
  v1::Subscribe request;
  request.add_known_topologies(std::string(16, 'x'));
  EXPECT_TRUE(hub_.subscribe(ann_, request, 60.0).ok()) << "one that the server has never seen";
  request.add_known_topologies("short");
  EXPECT_EQ(hub_.subscribe(bob_, request, 60.0).status().where(), "subscribe.known_topologies[1]");
}

TEST_F(FrameHubTest, AKeyThatIsAskedForComesToWhoAskedAlone) {
  const std::uint32_t stream = subscribe(ann_).stream_id();
  subscribe(bob_);
  tick();
  tick();
  EXPECT_TRUE(hub_.request_key(ann_->id(), stream));
  const auto apart = frames(tick());
  ASSERT_EQ(apart.size(), 2U);
  EXPECT_NE(apart[0].key, nullptr);
  EXPECT_EQ(apart[0].delta, nullptr) << "it would take the delta";
  EXPECT_NE(apart[1].delta, nullptr);
  EXPECT_EQ(frames(tick()).size(), 1U) << "one chain of deltas for both again";
  EXPECT_FALSE(hub_.request_key(3, stream)) << "who has no such stream";
}

TEST_F(FrameHubTest, AStreamKeepsTheRateThatWasAskedForWhenTheWorldsChanges) {
  subscribe(ann_, 13.0);
  EXPECT_EQ(subscribe(bob_, 12.5).stream_id(), last_stream_id_) << "the same frames at 60 Hz: one stream";
  EXPECT_EQ(last_stream_id_, 1U);
  Outbox outbox;
  hub_.rate_changed("w", 1, 1000.0, outbox);
  const auto message = parse(std::get<Outbox::Send>(outbox.items.at(0)).message);
  EXPECT_NEAR(message.event().rate_hz(), 13.0, 0.1);
  hub_.rate_changed("w", 2, 60.0, outbox);
  EXPECT_EQ(parse(std::get<Outbox::Send>(outbox.items.back()).message).event().rate_hz(), 12.0);
}

TEST_F(FrameHubTest, DeltasDecodeToTheWorldWithinTheBound) {
  const double max_error_m = 1e-4;
  const auto subscribed = subscribe(ann_, 0.0, max_error_m);
  const auto mesh = world_.physics().soft_body(0).mesh;
  const std::span<const std::uint32_t> indices(mesh->faces.front().data(), 3 * mesh->faces.size());
  codec::FrameReader reader({std::make_shared<codec::MeshOrder>(codec::make_mesh_order(42, indices))});
  std::uint64_t last_tick = 0;
  for (int i = 0; i < 30; ++i) {
    const auto frame = frames(tick()).at(0);
    const auto message = parse(i == 0 ? frame.key : frame.delta).frame();
    EXPECT_EQ(message.tick(), world_.tick());
    EXPECT_EQ(message.has_base_tick(), i > 0);
    if (i > 0) {
      EXPECT_EQ(message.base_tick(), last_tick);
      EXPECT_EQ(frame.key, nullptr);
    }
    last_tick = message.tick();
    ASSERT_TRUE(reader.read(message.payload(), i == 0).ok());
    std::vector<double> decoded(3 * 42);
    std::vector<double> exact(3 * 42);
    reader.positions(0, subscribed.grid_step_m(), decoded);
    world_.physics().copy_positions(0, exact);
    for (std::size_t v = 0; v < 42; ++v) {
      const double error = std::hypot(decoded[3 * v] - exact[3 * v], decoded[3 * v + 1] - exact[3 * v + 1],
                                      decoded[3 * v + 2] - exact[3 * v + 2]);
      EXPECT_LE(error, max_error_m);
    }
  }
}

TEST_F(FrameHubTest, TimeIsToldWhereTheTicksDoNotTellIt) {
  const double tick_s = subscribe(ann_).tick_s();
  double time_s = 0.0;
  const auto told_at_next_tick = [&] {
    const auto frame = frames(tick()).at(0);
    const auto message = parse(frame.key ? frame.key : frame.delta).frame();
    time_s = message.has_time_s() ? message.time_s() : time_s + tick_s;
    EXPECT_NEAR(time_s, world_.physics().time_s(), 1e-9);
    EXPECT_EQ(message.layout_id(), frame.key ? 1U : 0U);
    return message.has_time_s();
  };
  EXPECT_TRUE(told_at_next_tick()) << "of a key frame";
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(told_at_next_tick());
  v1::ClientMessage edit;
  edit.mutable_edit()->mutable_edit()->add_changes()->mutable_set_stepping()->set_rate_hz(50.0);
  ASSERT_TRUE(world_.change(edit).ok());
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(told_at_next_tick()) << "at another rate";
  EXPECT_EQ(subscribe(bob_).tick_s(), tick_s) << "as the stream's others have it";
}

TEST_F(FrameHubTest, OneEncodingServesAllOfAQuality) {
  EXPECT_EQ(subscribe(ann_).stream_id(), subscribe(bob_).stream_id());
  EXPECT_EQ(hub_.class_count(), 1U);
  EXPECT_EQ(hub_.subscriber_count(), 2U);
  EXPECT_EQ(frames(tick()).size(), 1U);
  subscribe(bob_, 0.0, 0.01);
  EXPECT_EQ(hub_.class_count(), 2U);
  EXPECT_EQ(frames(tick()).size(), 2U);
}

TEST_F(FrameHubTest, TheRateIsAWholeDivisionOfTheWorlds) {
  EXPECT_EQ(subscribe(ann_, 20.0).rate_hz(), 20.0);
  EXPECT_EQ(subscribe(ann_, 1000.0).rate_hz(), 60.0);
  EXPECT_EQ(subscribe(ann_, 25.0).rate_hz(), 30.0);
  EXPECT_EQ(subscribe(ann_, 1e-300).rate_hz(), 60.0 / 86'400'000.0);
}

TEST_F(FrameHubTest, ALateJoinerOfASlowStreamGetsItsLastFrameAtOnce) {
  subscribe(ann_, 6.0);
  for (int i = 0; i < 10; ++i) tick();
  subscribe(bob_, 6.0);
  tick();  // 11: not due
  const Outbox outbox = tick();
  EXPECT_EQ(kinds(outbox, 2), "") << "the key went at tick 11";
  EXPECT_EQ(frames(outbox).size(), 0U);
}

TEST_F(FrameHubTest, ALateJoinersKeyIsWhatTheNextDeltaBuildsOn) {
  subscribe(ann_, 6.0);
  for (int i = 0; i < 10; ++i) tick();
  subscribe(bob_, 6.0);
  const Outbox outbox = tick();
  EXPECT_EQ(kinds(outbox, 2), "topology layout frame ");
  EXPECT_EQ(kinds(outbox, 1), "");
  const auto key = frames(outbox).at(0);
  EXPECT_EQ(key.delta, nullptr);
  std::vector<net::StreamFrame> next;
  while (next.empty()) next = frames(tick());
  EXPECT_EQ(next[0].base_tick, key.tick);
}

TEST_F(FrameHubTest, AKeyIntervalIsKeptForWhoAskedAndOthersGetTheirDeltas) {
  subscribe(ann_);
  v1::Subscribe request;
  request.set_key_interval_s(0.1);  // 6 ticks
  ASSERT_TRUE(hub_.subscribe(bob_, request, 60.0).ok());
  tick();
  std::vector<std::uint64_t> key_ticks;
  for (int i = 0; i < 30; ++i) {
    const Outbox outbox = tick();
    EXPECT_EQ(kinds(outbox, 1), "frame ");
    EXPECT_EQ(kinds(outbox, 2), "frame ");
    for (const auto& item : outbox.items) {
      const auto* publish = std::get_if<Outbox::Publish>(&item);
      if (publish == nullptr || publish->frame.delta != nullptr) continue;
      EXPECT_EQ(*publish->sessions, std::vector<net::SessionId>{2});
      key_ticks.push_back(publish->frame.tick);
    }
  }
  EXPECT_EQ(key_ticks, (std::vector<std::uint64_t>{7, 13, 19, 25, 31}));
}

TEST_F(FrameHubTest, AKeyIntervalBelowTheStreamsPeriodMakesEveryFrameAKey) {
  v1::Subscribe request;
  request.set_rate_hz(20.0);
  request.set_key_interval_s(0.001);
  ASSERT_TRUE(hub_.subscribe(ann_, request, 60.0).ok());
  for (int i = 0; i < 12; ++i) {
    for (const auto& frame : frames(tick())) EXPECT_EQ(frame.delta, nullptr);
  }
  for (const double bad : {-1.0, std::nan("")}) {
    request.set_key_interval_s(bad);
    EXPECT_EQ(hub_.subscribe(ann_, request, 60.0).status().where(), "subscribe.key_interval_s");
  }
}

TEST_F(FrameHubTest, WhoAsksForCommandsIsToldOfThem) {
  const auto stream = subscribe(ann_).stream_id();
  v1::Subscribe request;
  request.set_commands(true);
  ASSERT_TRUE(hub_.subscribe(bob_, request, 60.0).ok());
  v1::ClientMessage command;
  command.set_request_id(17);
  command.mutable_pause()->set_world("w");
  Outbox outbox;
  hub_.applied({5, command, 9}, outbox);
  ASSERT_EQ(outbox.items.size(), 1U);
  const auto& send = std::get<Outbox::Send>(outbox.items[0]);
  EXPECT_EQ(send.session, 2U);
  const v1::Applied applied = parse(send.message).applied();
  EXPECT_EQ(applied.stream_id(), stream);
  EXPECT_EQ(applied.tick(), 5U);
  EXPECT_EQ(applied.session_id(), 9U);
  EXPECT_EQ(applied.command().request_id(), 0U);
  EXPECT_EQ(applied.command().pause().world(), "w");
}

TEST_F(FrameHubTest, AWorldAtRestGivesItsKeyWithoutAStep) {
  subscribe(ann_);
  Outbox outbox;
  hub_.encode_rest(LiveFrames(world_.physics()), world_.tick(), outbox);
  EXPECT_EQ(kinds(outbox, 1), "topology layout frame ");
  Outbox again;
  hub_.encode_rest(LiveFrames(world_.physics()), world_.tick(), again);
  EXPECT_TRUE(again.items.empty());
  hub_.key_wanted(1, 1);
  hub_.encode_rest(LiveFrames(world_.physics()), world_.tick(), again);
  EXPECT_EQ(kinds(again, 1), "frame ");
}

TEST_F(FrameHubTest, AnAddedBodyMakesANewLayoutAndAKey) {
  subscribe(ann_);
  EXPECT_EQ(kinds(tick(), 1), "topology layout frame ");
  ASSERT_TRUE(world_.change(add_second_ball()).ok());
  hub_.edited();
  const Outbox outbox = tick();
  EXPECT_EQ(kinds(outbox, 1), "layout frame ");  // both balls have one topology
  const auto frame = frames(outbox).at(0);
  EXPECT_EQ(frame.delta, nullptr);
  EXPECT_EQ(parse(frame.key).frame().layout_id(), 2U);
}

TEST_F(FrameHubTest, AnEditOfAWorldAtRestIsShownInAKeyOfTheSameTick) {
  subscribe(ann_);
  tick();
  hub_.edited();
  Outbox outbox;
  hub_.encode_rest(LiveFrames(world_.physics()), world_.tick(), outbox);
  EXPECT_EQ(frames(outbox).at(0).tick, world_.tick());
  EXPECT_EQ(frames(outbox).at(0).delta, nullptr);
}

TEST_F(FrameHubTest, WhoLeavesGetsNothingAndTheLastEndsTheStream) {
  const auto stream = subscribe(ann_).stream_id();
  subscribe(bob_);
  tick();
  Outbox outbox;
  EXPECT_TRUE(hub_.unsubscribe(1, stream, outbox));
  EXPECT_FALSE(hub_.unsubscribe(1, stream, outbox));
  EXPECT_EQ(kinds(tick(), 1), "");
  EXPECT_TRUE(dropped_.empty());
  hub_.session_ended(2);
  EXPECT_EQ(dropped_, std::vector<std::uint32_t>{stream});
  EXPECT_EQ(hub_.class_count(), 0U);
}

TEST_F(FrameHubTest, BadQualitiesAndTooManyAreRefused) {
  v1::Subscribe request;
  request.set_rate_hz(-1.0);
  EXPECT_EQ(hub_.subscribe(ann_, request, 60.0).status().where(), "subscribe.rate_hz");
  request.set_rate_hz(std::nan(""));
  EXPECT_EQ(hub_.subscribe(ann_, request, 60.0).status().where(), "subscribe.rate_hz");
  request.set_rate_hz(0.0);
  for (const double bad : {-1.0, 1e-9, 1e9, std::nan("")}) {
    request.set_max_error_m(bad);
    EXPECT_EQ(hub_.subscribe(ann_, request, 60.0).status().where(), "subscribe.max_error_m") << bad;
  }
  for (std::size_t i = 0; i < base::session_streams_per_world_max; ++i) {
    subscribe(ann_, 0.0, 0.01 + 0.001 * static_cast<double>(i));
  }
  request.set_max_error_m(0.5);
  EXPECT_EQ(hub_.subscribe(ann_, request, 60.0).status().code(), base::StatusCode::limit_exceeded);
  EXPECT_TRUE(hub_.subscribe(bob_, request, 60.0).ok());
}

}  // namespace
}  // namespace pneuma::app
