// Shows that a world without a server answers as one behind a server: with the same bits, replies and errors.
#include "app/local_world.h"

#include <gtest/gtest.h>

#include "ball_scene.h"

namespace pneuma::app {
namespace {

LocalWorld local_ball(std::size_t threads = 1) {
  auto world = LocalWorld::create(ball_scene(), threads);
  EXPECT_TRUE(world.ok()) << world.status().message();
  return std::move(*world);
}

v1::ClientMessage step(std::uint32_t ticks) {
  v1::ClientMessage message;
  message.set_request_id(7);
  message.mutable_step()->set_ticks(ticks);
  return message;
}

/// Requests need not name the world.
v1::ClientMessage in_process(v1::ClientMessage message) {
  if (message.has_impulse()) message.mutable_impulse()->clear_world();
  if (message.has_grab()) message.mutable_grab()->clear_world();
  return message;
}

TEST(LocalWorld, StepsAsALiveWorldDoes) {
  auto live = LiveWorld::create(ball_scene());
  ASSERT_TRUE(live.ok());
  physics::Workers workers(1);
  for (int tick = 0; tick < 30; ++tick) live->physics().step_tick(workers);
  ASSERT_TRUE(live->change(impulse_up("ball", 2.0)).ok());
  for (int tick = 0; tick < 30; ++tick) live->physics().step_tick(workers);

  LocalWorld local = local_ball(2);
  EXPECT_EQ(local.answer(step(30)).done().tick(), 30U);
  EXPECT_EQ(local.answer(in_process(impulse_up("ball", 2.0))).done().tick(), 31U);
  v1::ClientMessage observed = step(30);
  observed.mutable_step()->mutable_observe();
  const v1::ServerMessage reply = local.answer(observed);
  EXPECT_EQ(reply.request_id(), 7U);
  EXPECT_EQ(reply.done().state().state_hash(), live->physics().state_hash());
  EXPECT_EQ(reply.done().state().tick(), 60U);
  EXPECT_EQ(reply.done().world(), "ball");
  EXPECT_FALSE(local.answer(step(1)).done().has_state()) << "nobody asked";
}

TEST(LocalWorld, WaitsForATouch) {
  LocalWorld local = local_ball();
  v1::ClientMessage message;
  message.mutable_step_until()->set_ticks_max(600);
  message.mutable_step_until()->mutable_touch()->set_first("ball");
  message.mutable_step_until()->mutable_touch()->set_second("floor");
  message.mutable_step_until()->mutable_observe();
  const v1::ServerMessage reply = local.answer(message);
  EXPECT_TRUE(reply.done().reached());
  const auto& ball = reply.done().state().soft_bodies(0).body();
  EXPECT_NEAR(ball.centre_of_mass().y(), 1.0, 0.2);  // its radius
  message.mutable_step_until()->set_tick(3);
  EXPECT_EQ(local.answer(message).done().tick(), reply.done().tick()) << "a tick that is over is reached at once";
}

TEST(LocalWorld, GrabsAndResets) {
  LocalWorld local = local_ball();
  const v1::ServerMessage grabbed = local.answer(in_process(grab_vertex(3)));
  EXPECT_EQ(grabbed.grabbed().vertex(), 3U);
  EXPECT_EQ(grabbed.grabbed().tick(), 1U);
  (void)local.answer(step(5));
  v1::ClientMessage reset;
  reset.mutable_reset();
  EXPECT_EQ(local.answer(reset).done().tick(), 5U);
  EXPECT_EQ(local.live().physics().tick(), 0U);
  EXPECT_EQ(local.answer(step(1)).done().tick(), 6U);
}

TEST(LocalWorld, ErrorsAreTheWiresOwn) {
  LocalWorld local = local_ball();
  EXPECT_EQ(local.answer(step(0)).error().where(), "step.ticks");
  EXPECT_EQ(local.answer(in_process(impulse_up("stone", 1.0))).error().code(), v1::Error::NOT_FOUND);
  EXPECT_EQ(local.answer(impulse_up("ball", 1.0)).error().where(), "impulse.world") << "another world's";
  v1::ClientMessage subscribe;
  subscribe.mutable_subscribe()->set_world("ball");
  EXPECT_EQ(local.answer(subscribe).error().code(), v1::Error::UNSUPPORTED);
  v1::ClientMessage observed = step(1);
  observed.mutable_step()->mutable_observe()->add_bodies("none");
  EXPECT_EQ(local.answer(observed).error().where(), "step.observe.bodies[0]");
  EXPECT_EQ(local.live().tick(), 0U);
}

}  // namespace
}  // namespace pneuma::app
