// Shows that scripts see the state of exactly the tick that they stepped to, put bodies where they say, and are told
// when what they wait for is so.
#include <algorithm>
#include <chrono>
#include <optional>

#include <gtest/gtest.h>

#include "app/hosted_world.h"
#include "app/world_state.h"
#include "ball_scene.h"
#include "base/limits.h"
#include "requests.h"

namespace pneuma::app {
namespace {

class ObservedSteps : public testing::Test {
 protected:
  ObservedSteps() {
    auto live = LiveWorld::create(ball_scene());
    EXPECT_TRUE(live.ok()) << live.status().message();
    HostedWorld::Wiring wiring{[] { return 1U; }, [](std::uint32_t) {}, &metrics_};
    world_.emplace("w", std::move(*live), true, nullptr, wiring);
  }

  static v1::ClientMessage message(std::uint64_t request_id) {
    v1::ClientMessage message;
    message.set_request_id(request_id);
    return message;
  }
  static v1::ClientMessage observed_step(std::uint64_t request_id, std::uint32_t ticks) {
    v1::ClientMessage asked = message(request_id);
    asked.mutable_step()->set_world("w");
    asked.mutable_step()->set_ticks(ticks);
    asked.mutable_step()->mutable_observe()->set_velocities(true);
    asked.mutable_step()->mutable_observe()->set_double_precision(true);
    return asked;
  }
  static v1::ClientMessage until(std::uint64_t request_id, std::uint32_t ticks_max) {
    v1::ClientMessage asked = message(request_id);
    asked.mutable_step_until()->set_world("w");
    asked.mutable_step_until()->set_ticks_max(ticks_max);
    return asked;
  }

  /// Asks, and ticks until the world rests again: all replies.
  std::vector<v1::ServerMessage> ask(const v1::ClientMessage& asked) {
    EXPECT_EQ(world_->post(request_of(session_, asked)), Inbox::Post::taken);
    using TimePoint = HostedWorld::TimePoint;
    Outbox outbox;
    world_->drain(std::chrono::steady_clock::now(), TimePoint::max(), outbox);
    while (world_->tick_due(std::chrono::steady_clock::now())) {
      EXPECT_TRUE(world_->step([] { return false; }));
      world_->encode(outbox);
      world_->end_tick(std::chrono::steady_clock::now(), outbox);
    }
    std::vector<v1::ServerMessage> replies;
    for (const auto& item : outbox.items) {
      if (const auto* sent = std::get_if<Outbox::Send>(&item)) replies.emplace_back().ParseFromString(*sent->message);
    }
    return replies;
  }
  v1::ServerMessage ask_one(const v1::ClientMessage& asked) {
    std::vector<v1::ServerMessage> replies = ask(asked);
    EXPECT_EQ(replies.size(), 1U);
    return replies.empty() ? v1::ServerMessage() : replies.back();
  }
  v1::State state() {
    v1::ClientMessage asked = message(99);
    asked.mutable_get_state()->set_world("w");
    asked.mutable_get_state()->mutable_observe()->set_velocities(true);
    asked.mutable_get_state()->mutable_observe()->set_double_precision(true);
    return ask_one(asked).state();
  }

  Metrics metrics_;
  std::shared_ptr<Session> session_ = std::make_shared<Session>(7);
  std::optional<HostedWorld> world_;
};

TEST_F(ObservedSteps, AStepTellsTheStateOfItsLastTick) {
  const v1::Done done = ask_one(observed_step(1, 10)).done();
  EXPECT_EQ(done.tick(), 10U);
  ASSERT_TRUE(done.has_state());
  EXPECT_EQ(done.state().tick(), 10U);
  EXPECT_EQ(done.state().world(), "w");
  ASSERT_EQ(done.state().soft_bodies_size(), 1);
  EXPECT_EQ(done.state().soft_bodies(0).body().name(), "ball");
  EXPECT_EQ(done.state().soft_bodies(0).positions().size(), 42U * 24U);
  EXPECT_EQ(done.state().SerializeAsString(), state().SerializeAsString());
  v1::ClientMessage plain = observed_step(2, 1);
  plain.mutable_step()->clear_observe();
  EXPECT_FALSE(ask_one(plain).done().has_state());
}

TEST_F(ObservedSteps, StepsThatWaitTogetherEachTellTheirOwnTick) {
  (void)world_->post(request_of(session_, observed_step(1, 2)));
  (void)world_->post(request_of(session_, observed_step(2, 3)));
  const std::vector<v1::ServerMessage> replies = ask(observed_step(3, 1));
  ASSERT_EQ(replies.size(), 3U);
  EXPECT_EQ(replies[0].done().state().tick(), 2U);
  EXPECT_EQ(replies[1].done().state().tick(), 5U);
  EXPECT_EQ(replies[2].done().state().tick(), 6U);
}

TEST_F(ObservedSteps, AStateThatIsSetBackIsSteppedToTheSameAgain) {
  (void)ask(observed_step(1, 5));
  const v1::State before = state();
  const v1::State after = ask_one(observed_step(2, 20)).done().state();
  v1::ClientMessage back = message(3);
  v1::SetState& set = *back.mutable_set_state();
  set.set_world("w");
  set.set_double_precision(true);
  set.add_soft_bodies()->set_name("ball");
  set.mutable_soft_bodies(0)->set_positions(before.soft_bodies(0).positions());
  set.mutable_soft_bodies(0)->set_velocities(before.soft_bodies(0).velocities());
  ASSERT_TRUE(ask_one(back).has_done());
  EXPECT_EQ(state().soft_bodies(0).SerializeAsString(), before.soft_bodies(0).SerializeAsString());
  const v1::State again = ask_one(observed_step(4, 20)).done().state();
  EXPECT_EQ(again.tick(), 45U);
  EXPECT_EQ(again.soft_bodies(0).positions(), after.soft_bodies(0).positions());
}

TEST_F(ObservedSteps, RefusesToSetWhatIsNotThereOrNotTheStateOfAWorldThatRuns) {
  v1::ClientMessage nobody = message(1);
  nobody.mutable_set_state()->set_world("w");
  EXPECT_EQ(ask_one(nobody).error().where(), "set_state");
  v1::ClientMessage cut = nobody;
  cut.mutable_set_state()->add_soft_bodies()->set_name("ball");
  cut.mutable_set_state()->mutable_soft_bodies(0)->set_positions("abc");
  EXPECT_EQ(ask_one(cut).error().where(), "set_state.soft_bodies[0].positions");
  v1::ClientMessage stone = nobody;
  stone.mutable_set_state()->add_rigid_bodies()->set_name("stone");
  EXPECT_EQ(ask_one(stone).error().where(), "set_state.rigid_bodies[0].name");
  stone.mutable_set_state()->mutable_rigid_bodies(0)->mutable_orientation()->set_w(0.0);
  EXPECT_EQ(ask_one(stone).error().where(), "set_state.rigid_bodies[0].orientation");
  v1::ClientMessage resume = message(2);
  resume.mutable_resume()->set_world("w");
  (void)world_->post(request_of(session_, resume));
  cut.mutable_set_state()->mutable_soft_bodies(0)->clear_positions();
  (void)world_->post(request_of(session_, cut));
  Outbox outbox;
  world_->drain(std::chrono::steady_clock::now(), HostedWorld::TimePoint::max(), outbox);
  ASSERT_EQ(outbox.items.size(), 2U);
  v1::ServerMessage reply;
  ASSERT_TRUE(reply.ParseFromString(*std::get<Outbox::Send>(outbox.items[1]).message));
  EXPECT_EQ(reply.error().code(), v1::Error::FAILED_PRECONDITION);
}

TEST_F(ObservedSteps, UntilABodyIsPastAPlaneIsTheFirstTickWhereItIs) {
  v1::ClientMessage asked = until(1, 600);
  v1::StepUntil& request = *asked.mutable_step_until();
  request.mutable_past()->set_body("ball");
  request.mutable_past()->mutable_normal()->set_y(-1.0);
  request.mutable_past()->set_offset_m(-2.5);
  request.mutable_observe();
  const v1::Done done = ask_one(asked).done();
  EXPECT_TRUE(done.reached());
  // Half a metre of free fall from rest takes 0.319 s, 19.2 ticks.
  EXPECT_EQ(done.tick(), 20U);
  EXPECT_LT(done.state().soft_bodies(0).body().centre_of_mass().y(), 2.5);
}

TEST_F(ObservedSteps, UntilTheBallTouchesTheFloorTellsTheTouch) {
  v1::ClientMessage asked = until(1, 600);
  asked.mutable_step_until()->mutable_touch()->set_first("floor");
  asked.mutable_step_until()->mutable_touch()->set_second("ball");
  const v1::Done done = ask_one(asked).done();
  EXPECT_TRUE(done.reached());
  // A ball of a metre's radius falls two metres: 0.639 s.
  EXPECT_NEAR(static_cast<double>(done.tick()), 38.0, 3.0);
}

TEST_F(ObservedSteps, UntilEverythingRestsAndUntilATick) {
  v1::ClientMessage rest = until(1, 3'000);
  rest.mutable_step_until()->mutable_rest();
  const v1::Done rested = ask_one(rest).done();
  EXPECT_TRUE(rested.reached());
  EXPECT_GT(rested.tick(), 60U);
  EXPECT_TRUE(state().soft_bodies(0).body().asleep());
  v1::ClientMessage later = until(2, 3'000);
  later.mutable_step_until()->set_tick(rested.tick() + 7);
  EXPECT_EQ(ask_one(later).done().tick(), rested.tick() + 7);
  v1::ClientMessage past = until(3, 10);
  past.mutable_step_until()->set_tick(rested.tick());
  const v1::Done passed = ask_one(past).done();
  EXPECT_TRUE(passed.reached());
  EXPECT_EQ(passed.tick(), rested.tick() + 7) << "it is past that tick, and steps no further";
}

TEST_F(ObservedSteps, ABodyThatRanAwayDidNotComeToRest) {
  (void)world_->post(request_of(session_, impulse_up("ball", 1e6)));
  v1::ClientMessage asked = until(2, 60);
  asked.mutable_step_until()->mutable_rest();
  const std::vector<v1::ServerMessage> replies = ask(asked);
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_FALSE(replies[1].done().reached());
  EXPECT_TRUE(state().soft_bodies(0).body().frozen());
}

TEST_F(ObservedSteps, ATickThatIsPassedWhileTheStepWaitsIsReachedInTurn) {
  (void)world_->post(request_of(session_, observed_step(1, 10)));
  v1::ClientMessage early = until(2, 100);
  early.mutable_step_until()->set_tick(5);
  (void)world_->post(request_of(session_, early));
  const std::vector<v1::ServerMessage> replies = ask(observed_step(3, 1));
  ASSERT_EQ(replies.size(), 3U);
  EXPECT_EQ(replies[1].request_id(), 2U);
  EXPECT_TRUE(replies[1].done().reached());
  EXPECT_EQ(replies[1].done().tick(), 10U);
  EXPECT_EQ(replies[2].done().tick(), 11U);
}

TEST_F(ObservedSteps, MoreBodiesThanAWorldHoldsAreRefusedBeforeTheyAreLookedAt) {
  v1::ClientMessage asked = observed_step(1, 1);
  for (std::size_t i = 0; i <= base::world_bodies_max; ++i) asked.mutable_step()->mutable_observe()->add_bodies("ball");
  const v1::Error refused = ask_one(asked).error();
  EXPECT_EQ(refused.code(), v1::Error::LIMIT_EXCEEDED);
  EXPECT_EQ(refused.where(), "step.observe.bodies");
}

TEST_F(ObservedSteps, WhatDoesNotComeInTimeIsNotReached) {
  v1::ClientMessage asked = until(1, 12);
  asked.mutable_step_until()->mutable_rest();
  const v1::Done done = ask_one(asked).done();
  EXPECT_FALSE(done.reached());
  EXPECT_EQ(done.tick(), 12U);
}

TEST_F(ObservedSteps, GoalsThatNameNothingAreRefused) {
  v1::ClientMessage none = until(1, 10);
  EXPECT_EQ(ask_one(none).error().where(), "step_until.until");
  v1::ClientMessage touch = until(2, 10);
  touch.mutable_step_until()->mutable_touch()->set_first("ball");
  touch.mutable_step_until()->mutable_touch()->set_second("ceiling");
  EXPECT_EQ(ask_one(touch).error().where(), "step_until.touch.second");
  touch.mutable_step_until()->mutable_touch()->set_second("ball");
  EXPECT_EQ(ask_one(touch).error().where(), "step_until.touch.second");
  v1::ClientMessage past = until(3, 10);
  past.mutable_step_until()->mutable_past()->set_body("ball");
  EXPECT_EQ(ask_one(past).error().where(), "step_until.past.normal");
  v1::ClientMessage long_one = until(4, 0);
  long_one.mutable_step_until()->mutable_rest();
  EXPECT_EQ(ask_one(long_one).error().where(), "step_until.ticks_max");
  v1::ClientMessage stranger = observed_step(5, 1);
  stranger.mutable_step()->mutable_observe()->add_bodies("cube");
  EXPECT_EQ(ask_one(stranger).error().where(), "step.observe.bodies[0]");
}

}  // namespace
}  // namespace pneuma::app
