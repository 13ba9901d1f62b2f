// Shows what a hosted world makes of requests that come faster than it carries them out, or that contradict each other.
// The loop is the test's own: a drain whose time is up carries out nothing. What befalls a body is told and logged.
#include "app/hosted_world.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include "ball_scene.h"
#include "base/limits.h"
#include "requests.h"

namespace pneuma::app {
namespace {

class HostedWorldTest : public testing::Test {
 protected:
  using TimePoint = HostedWorld::TimePoint;

  explicit HostedWorldTest(v1::Scene scene = ball_scene(), WorldRoom room = {}) {
    auto live = LiveWorld::create(std::move(scene));
    EXPECT_TRUE(live.ok()) << live.status().message();
    HostedWorld::Wiring wiring{[] { return 1U; }, [](std::uint32_t) {}, &metrics_};
    world_.emplace("w", std::move(*live), true, nullptr, wiring, std::move(room));
  }

  Inbox::Post post(const v1::ClientMessage& message) { return world_->post(request_of(session_, message)); }

  /// What a drain with all the time it wants answers.
  std::vector<v1::ServerMessage> drain() {
    world_->drain(std::chrono::steady_clock::now(), TimePoint::max(), outbox_);
    return take_replies();
  }
  void drain_without_time() {
    const TimePoint now = std::chrono::steady_clock::now();
    world_->drain(now, now, outbox_);
  }
  std::vector<v1::ServerMessage> tick() {
    EXPECT_TRUE(world_->step([] { return false; }));
    world_->encode(outbox_);
    world_->end_tick(std::chrono::steady_clock::now(), outbox_);
    return take_replies();
  }
  [[nodiscard]] bool tick_due() const { return world_->tick_due(std::chrono::steady_clock::now()); }

  std::vector<v1::ServerMessage> take_replies() {
    std::vector<v1::ServerMessage> replies;
    for (const auto& item : outbox_.items) {
      if (const auto* sent = std::get_if<Outbox::Send>(&item)) replies.emplace_back().ParseFromString(*sent->message);
    }
    outbox_ = {};
    return replies;
  }

  Metrics metrics_;
  std::shared_ptr<Session> session_ = std::make_shared<Session>(7);
  Outbox outbox_;
  std::optional<HostedWorld> world_;
};

v1::ClientMessage get_stats(std::uint64_t request_id) {
  v1::ClientMessage message;
  message.set_request_id(request_id);
  message.mutable_get_stats()->set_world("w");
  return message;
}

v1::ClientMessage step(std::uint64_t request_id, std::uint32_t ticks) {
  v1::ClientMessage message;
  message.set_request_id(request_id);
  message.mutable_step()->set_world("w");
  message.mutable_step()->set_ticks(ticks);
  return message;
}

v1::ClientMessage pause(std::uint64_t request_id) {
  v1::ClientMessage message;
  message.set_request_id(request_id);
  message.mutable_pause()->set_world("w");
  return message;
}

v1::ClientMessage resume(std::uint64_t request_id) {
  v1::ClientMessage message;
  message.set_request_id(request_id);
  message.mutable_resume()->set_world("w");
  return message;
}

// Of frames while the world is paused, and of a tick that was asked for.
TEST_F(HostedWorldTest, StatsTellTheFrameBytesOfTheLastSecondToAllReaders) {
  v1::ClientMessage subscribe;
  subscribe.mutable_subscribe()->set_world("w");
  post(subscribe);
  (void)world_->post(request_of(std::make_shared<Session>(8), subscribe));
  std::size_t sent_bytes = 0;
  const auto count_frames = [&] {
    for (const auto& item : outbox_.items) {
      const auto* publish = std::get_if<Outbox::Publish>(&item);
      if (publish == nullptr) continue;
      const auto& message = publish->frame.delta ? publish->frame.delta : publish->frame.key;
      sent_bytes += publish->sessions->size() * message->size();
    }
    outbox_ = {};
  };
  const auto drain_and_count = [&] {
    world_->drain(std::chrono::steady_clock::now(), TimePoint::max(), outbox_);
    count_frames();
  };
  drain_and_count();
  const std::size_t at_rest_bytes = sent_bytes;
  EXPECT_GT(at_rest_bytes, 0U);
  post(step(1, 1));
  drain_and_count();
  EXPECT_TRUE(world_->step([] { return false; }));
  world_->encode(outbox_);
  count_frames();
  EXPECT_GT(sent_bytes, at_rest_bytes);
  world_->end_tick(std::chrono::steady_clock::now(), outbox_);
  outbox_ = {};
  post(get_stats(2));
  const auto replies = drain();
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].stats().frame_bytes_s(), static_cast<double>(sent_bytes));
}

TEST_F(HostedWorldTest, WhatADrainLeavesIsCarriedOutAfterTheTickUnderWay) {
  post(step(1, 1));
  drain();
  post(get_stats(2));
  drain_without_time();
  ASSERT_FALSE(world_->step([] { return true; })) << "the tick is under way";
  EXPECT_TRUE(drain().empty());
  tick();
  const TimePoint now = std::chrono::steady_clock::now();
  EXPECT_EQ(world_->next_due(now), now) << "a paused world would rest";
  EXPECT_EQ(drain().size(), 1U);
}

TEST_F(HostedWorldTest, WhileItRunsLooksAtBodiesTakeAShareOfItsTimeAndOthersAreAnswered) {
  constexpr int looks = 500;
  v1::ClientMessage look;
  look.mutable_nearest_point()->set_world("w");
  for (std::size_t i = 0; i < base::query_points_max; ++i) look.mutable_nearest_point()->add_points()->set_x(1.0);
  const auto looker = std::make_shared<Session>(8);
  for (int i = 0; i < looks; ++i) {
    look.set_request_id(static_cast<std::uint64_t>(i) + 10);
    ASSERT_EQ(world_->post(request_of(looker, look)), Inbox::Post::taken);
  }
  post(resume(1));
  post(get_stats(2));
  const auto count_looks = [](const std::vector<v1::ServerMessage>& replies) {
    return std::ranges::count_if(replies, &v1::ServerMessage::has_surface_points);
  };
  auto replies = drain();
  EXPECT_TRUE(std::ranges::any_of(replies, &v1::ServerMessage::has_stats));
  auto answered = count_looks(replies);
  EXPECT_GT(answered, 0);
  EXPECT_LT(answered, looks);
  tick();
  post(pause(3));
  while (answered < looks) {
    const TimePoint now = std::chrono::steady_clock::now();
    replies = drain();
    ASSERT_FALSE(replies.empty()) << "a paused world has time for them";
    answered += count_looks(replies);
    if (answered < looks) {
      EXPECT_EQ(world_->next_due(now), now);
    }
  }
  EXPECT_EQ(answered, looks);
}

class HostedWorldOnABudget : public HostedWorldTest {
 protected:
  HostedWorldOnABudget() : HostedWorldTest(ball_scene(), {WorldMemory::unlimited(), StepBudget(0.5)}) {}
};

TEST_F(HostedWorldOnABudget, WaitsWhereItsProcessorTimeIsUsedUp) {
  const TimePoint now = std::chrono::steady_clock::now();
  post(resume(1));
  world_->drain(now, TimePoint::max(), outbox_);
  ASSERT_TRUE(world_->tick_due(now));
  world_->spend(now, std::chrono::milliseconds(625));  // a quarter of a second's share is saved up
  EXPECT_FALSE(world_->tick_due(now));
  EXPECT_EQ(world_->next_due(now), std::nullopt);
  const auto ready_at = world_->next_try(now);
  ASSERT_TRUE(ready_at);
  EXPECT_NEAR(std::chrono::duration<double>(*ready_at - now).count(), 1.0, 1e-6);
  take_replies();
  post(get_stats(2));
  world_->drain(now, TimePoint::max(), outbox_);
  EXPECT_TRUE(take_replies().empty());
  world_->drain(*ready_at, TimePoint::max(), outbox_);
  EXPECT_EQ(take_replies().size(), 1U);
  EXPECT_NEAR(metrics_.held_back_seconds.Value(), 1.0, 1e-3);
}

TEST_F(HostedWorldOnABudget, SaysWhyItIsSlowThoughNobodyAskedMeanwhile) {
  const TimePoint now = std::chrono::steady_clock::now();
  v1::ClientMessage subscribe;
  subscribe.mutable_subscribe()->set_world("w");
  post(subscribe);
  post(resume(1));
  world_->drain(now, TimePoint::max(), outbox_);
  world_->spend(now, std::chrono::milliseconds(625));
  take_replies();
  // The next slice begins when there is time again, and not before: nobody wakes the world.
  const TimePoint ready_at = world_->next_try(now).value_or(now);
  world_->drain(ready_at, TimePoint::max(), outbox_);
  EXPECT_NEAR(metrics_.held_back_seconds.Value(), 1.0, 1e-3);
  ASSERT_TRUE(world_->tick_due(ready_at));
  EXPECT_TRUE(world_->step([] { return false; }));
  world_->end_tick(ready_at, outbox_);
  const auto replies = take_replies();
  const auto slowed =
      std::ranges::find_if(replies, [](const auto& reply) { return reply.event().kind() == v1::Event::WORLD_SLOWED; });
  ASSERT_NE(slowed, replies.end());
  EXPECT_NE(slowed->event().detail().find("it may take 0.5 processor seconds a second"), std::string::npos);
}

TEST_F(HostedWorldOnABudget, CanBeDestroyedWhileItWaits) {
  const TimePoint now = std::chrono::steady_clock::now();
  world_->spend(now, std::chrono::seconds(10));
  v1::ClientMessage destroy;
  destroy.set_request_id(3);
  destroy.mutable_destroy_world()->set_world("w");
  post(destroy);
  world_->drain(now, TimePoint::max(), outbox_);
  EXPECT_NE(world_->destroyed_by(), nullptr);
}

TEST_F(HostedWorldTest, ATickThatTakesLongDoesNotHoldUpTheEndOfItsWorld) {
  v1::ClientMessage destroy;
  destroy.set_request_id(3);
  destroy.mutable_destroy_world()->set_world("w");
  post(step(1, 1));
  drain();
  ASSERT_FALSE(world_->step([] { return true; })) << "the tick is under way";
  post(get_stats(2));
  post(destroy);
  EXPECT_TRUE(drain().empty()) << "a tick that ends soon comes first";
  EXPECT_EQ(world_->destroyed_by(), nullptr);
  world_->drain(std::chrono::steady_clock::now() + std::chrono::minutes(1), TimePoint::max(), outbox_);
  ASSERT_NE(world_->destroyed_by(), nullptr);
  const std::vector<v1::ServerMessage> replies = take_replies();
  ASSERT_EQ(replies.size(), 2U);
  for (const v1::ServerMessage& reply : replies) EXPECT_EQ(reply.error().code(), v1::Error::NOT_FOUND);
  EXPECT_FALSE(tick_due());
}

TEST_F(HostedWorldTest, WhatADrainLeavesStillCountsAgainstTheNumberOfRequests) {
  for (std::size_t i = 0; i < base::world_inbox_requests_max; ++i) ASSERT_EQ(post(get_stats(1)), Inbox::Post::taken);
  EXPECT_EQ(post(get_stats(1)), Inbox::Post::full);
  drain_without_time();
  EXPECT_EQ(post(get_stats(1)), Inbox::Post::full);
  EXPECT_EQ(world_->post(SessionEnded{8}), Inbox::Post::taken) << "the books are kept all the same";
  EXPECT_TRUE(world_->next_due(std::chrono::steady_clock::now()).has_value()) << "what waits brings the world back";
}

TEST_F(HostedWorldTest, WhatADrainLeavesStillCountsAgainstTheirMemory) {
  v1::ClientMessage large;
  large.set_request_id(1);
  auto& mesh = *large.mutable_edit()->mutable_edit()->add_changes()->mutable_add_mesh();
  for (int i = 0; i < 100'000; ++i) mesh.mutable_triangles()->add_positions();
  ASSERT_LT(large.ByteSizeLong(), base::Limits().message_bytes_max);
  const std::size_t room = base::world_inbox_bytes_max / large.SpaceUsedLong();
  for (std::size_t i = 0; i < room; ++i) ASSERT_EQ(post(large), Inbox::Post::taken);
  EXPECT_EQ(post(large), Inbox::Post::full);
  drain_without_time();
  EXPECT_EQ(post(large), Inbox::Post::full);
  drain();
  EXPECT_EQ(post(large), Inbox::Post::taken);
}

TEST_F(HostedWorldTest, APauseEndsTheStepsThatWait) {
  post(step(1, 5));
  post(step(2, 3));
  ASSERT_TRUE(drain().empty());
  ASSERT_TRUE(tick().empty());
  ASSERT_TRUE(tick().empty());
  post(pause(3));
  const auto replies = drain();
  ASSERT_EQ(replies.size(), 3U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(replies[i].request_id(), i + 1);
    EXPECT_EQ(replies[i].error().code(), v1::Error::FAILED_PRECONDITION);
    EXPECT_EQ(replies[i].error().where(), "step");
    EXPECT_EQ(replies[i].error().what(), "a pause ended it at tick 2");
  }
  EXPECT_EQ(replies[2].request_id(), 3U);
  EXPECT_EQ(replies[2].done().tick(), 2U);
  EXPECT_FALSE(tick_due());
}

TEST_F(HostedWorldTest, AResumeEndsTheStepsThatWaitAndTheClockRules) {
  post(step(1, 5));
  ASSERT_TRUE(drain().empty());
  ASSERT_TRUE(tick().empty());
  post(resume(2));
  const auto replies = drain();
  ASSERT_EQ(replies.size(), 2U);
  EXPECT_EQ(replies[0].error().what(), "a resume ended it at tick 1");
  EXPECT_EQ(replies[1].done().tick(), 2U);
  // The first tick is due at once, the one after it a period later.
  const TimePoint before = std::chrono::steady_clock::now();
  ASSERT_TRUE(tick_due());
  ASSERT_TRUE(tick().empty());
  EXPECT_GT(*world_->next_due(before), before);
}

// The due times of two ticks, as far apart as the period asks for, however long the ticks took.
TEST_F(HostedWorldTest, InSlowMotionTicksAreDueLaterAndStepTheSameTime) {
  v1::ClientMessage slow = resume(1);
  slow.mutable_resume()->set_time_scale(0.25);
  post(slow);
  ASSERT_EQ(drain().size(), 1U);
  ASSERT_TRUE(tick().empty());
  const TimePoint first = *world_->next_due(TimePoint());
  EXPECT_EQ(world_->status().listing.time_scale(), 0.25);
  const double time_s = world_->status().listing.time_s();
  const double period_s = 1.0 / world_->status().listing.rate_hz();
  EXPECT_NEAR(time_s, period_s, 1e-12);
  ASSERT_TRUE(tick().empty());
  EXPECT_NEAR(std::chrono::duration<double>(*world_->next_due(TimePoint()) - first).count(), 4.0 * period_s, 1e-6);
  EXPECT_NEAR(world_->status().listing.time_s(), 2.0 * period_s, 1e-12);

  post(resume(2));  // says nothing of it
  drain();
  EXPECT_EQ(world_->status().listing.time_scale(), 0.25);
}

TEST_F(HostedWorldTest, ATimeScaleThatNoWorldHasIsRefused) {
  for (const double scale : {0.0, -1.0, 0.12, 1.01, std::numeric_limits<double>::quiet_NaN()}) {
    v1::ClientMessage message = resume(1);
    message.mutable_resume()->set_time_scale(scale);
    post(message);
    const auto replies = drain();
    ASSERT_EQ(replies.size(), 1U);
    const bool is_past_a_limit = scale > 0.0;
    EXPECT_EQ(replies[0].error().code(), is_past_a_limit ? v1::Error::LIMIT_EXCEEDED : v1::Error::INVALID_ARGUMENT)
        << scale;
    EXPECT_EQ(replies[0].error().where(), "resume.time_scale");
    EXPECT_TRUE(world_->status().listing.paused());
  }
}

TEST_F(HostedWorldTest, ASubscriberWhoAsksIsToldOfEachChangeAndOfNothingElse) {
  const auto ask = [this](const auto& fill) {
    v1::ClientMessage message;
    message.set_request_id(1);
    fill(message);
    ASSERT_EQ(post(message), Inbox::Post::taken);
  };
  ask([](auto& message) { message.mutable_subscribe()->set_commands(true); });
  ask([](auto& message) { message.mutable_impulse()->set_body("nobody"); });  // refused
  ask([](auto& message) { message.mutable_pause(); });                        // it is paused already
  ask([](auto& message) { message.mutable_resume(); });
  ask([](auto& message) { message.mutable_grab()->set_vertex(0); });  // of no body: refused
  ask([](auto& message) { message.mutable_reset(); });
  ask([](auto& message) { message.mutable_get_stats(); });
  std::vector<v1::ClientMessage::RequestCase> told;
  for (const auto& message : drain()) {
    if (!message.has_applied()) continue;
    told.push_back(message.applied().command().request_case());
    EXPECT_EQ(message.applied().session_id(), session_->id());
  }
  EXPECT_EQ(told, (std::vector{v1::ClientMessage::kResume, v1::ClientMessage::kReset}));
}

TEST_F(HostedWorldTest, OfAGrabItsIdIsToldToo) {
  v1::ClientMessage subscribe;
  subscribe.set_request_id(1);
  subscribe.mutable_subscribe()->set_commands(true);
  post(subscribe);
  post(grab_vertex(3));
  post(grab_vertex(5));
  std::vector<std::uint64_t> told;
  std::vector<std::uint64_t> replied;
  for (const auto& message : drain()) {
    if (message.has_applied()) told.push_back(message.applied().grab_id());
    if (message.has_grabbed()) replied.push_back(message.grabbed().grab_id());
  }
  EXPECT_EQ(told.size(), 2U);
  EXPECT_EQ(told, replied);
}

TEST_F(HostedWorldTest, WithoutAHostNobodyLooksBack) {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_take_snapshot()->set_world("w");
  post(message);
  EXPECT_EQ(drain().at(0).error().code(), v1::Error::UNSUPPORTED);
}

TEST_F(HostedWorldTest, ALiveWorldRefusesToSeek) {
  v1::ClientMessage message;
  message.set_request_id(1);
  message.mutable_seek()->set_world("w");
  ASSERT_EQ(post(message), Inbox::Post::taken);
  const auto replies = drain();
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].error().code(), v1::Error::FAILED_PRECONDITION);
}

TEST_F(HostedWorldTest, TheStepsThatWaitAreBoundedTogether) {
  post(step(1, base::step_ticks_max));
  ASSERT_TRUE(drain().empty());
  post(step(2, 1));
  const auto full = drain();
  ASSERT_EQ(full.size(), 1U);
  EXPECT_EQ(full[0].error().code(), v1::Error::LIMIT_EXCEEDED);
  EXPECT_EQ(full[0].error().where(), "step.ticks");
  ASSERT_TRUE(tick().empty());
  post(step(3, 1));
  EXPECT_TRUE(drain().empty());
}

v1::Scene hung_scene() {
  v1::Scene scene = ball_scene();
  v1::Joint& joint = *scene.add_joints();
  joint.set_name("thread");
  joint.mutable_first()->set_soft_body("ball");
  joint.mutable_first()->set_vertex(3);
  joint.set_break_force_n(1.0);
  return scene;
}

class HungWorldTest : public HostedWorldTest {
 protected:
  HungWorldTest() : HostedWorldTest(hung_scene()) {}
};

TEST_F(HungWorldTest, SubscribersAreToldOnceOfAJointThatBreaksAndGetALayoutWithoutIt) {
  v1::ClientMessage subscribe;
  subscribe.mutable_subscribe()->set_world("w");
  post(subscribe);
  std::vector<v1::ServerMessage> messages = drain();
  const auto has_layout = [](const v1::ServerMessage& message) { return message.has_layout(); };
  auto layout = std::ranges::find_if(messages, has_layout);
  ASSERT_NE(layout, messages.end());
  ASSERT_EQ(layout->layout().joints_size(), 1);
  EXPECT_EQ(layout->layout().joints(0).name(), "thread");
  EXPECT_EQ(layout->layout().joints(0).first().vertices(0), 3U);
  messages.clear();
  post(step(1, 5));
  drain();
  for (int i = 0; i < 5; ++i) {
    for (v1::ServerMessage& message : tick()) messages.push_back(std::move(message));
  }
  EXPECT_EQ(std::ranges::count_if(messages,
                                  [](const v1::ServerMessage& message) {
                                    return message.event().kind() == v1::Event::JOINT_BROKEN &&
                                           message.event().joint() == "thread";
                                  }),
            1);
  layout = std::ranges::find_if(messages, has_layout);
  ASSERT_NE(layout, messages.end());
  EXPECT_EQ(layout->layout().joints_size(), 0);
}

v1::Scene bursting_scene() {
  v1::Scene scene = ball_scene();
  scene.mutable_soft_bodies(0)->mutable_gas()->set_burst_pressure_pa(1.0);
  return scene;
}

class BurstingWorldTest : public HostedWorldTest {
 protected:
  BurstingWorldTest() : HostedWorldTest(bursting_scene()) {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_st>(log_)));
    v1::ClientMessage subscribe;
    subscribe.mutable_subscribe()->set_world("w");
    subscribe.mutable_subscribe()->set_simulated(true);
    post(subscribe);
    at_first_ = drain();
  }
  ~BurstingWorldTest() override { spdlog::set_default_logger(logger_before_); }

  static std::size_t bursts(const std::vector<v1::ServerMessage>& messages) {
    return static_cast<std::size_t>(std::ranges::count_if(messages, [](const v1::ServerMessage& message) {
      return message.event().kind() == v1::Event::BODY_BURST && message.event().body() == "ball";
    }));
  }

  /// Whether the last layout that came tells of gas in the ball; nothing without one.
  static std::optional<bool> has_gas(const std::vector<v1::ServerMessage>& messages) {
    std::optional<bool> has;
    for (const v1::ServerMessage& message : messages) {
      if (message.has_layout()) has = message.layout().soft_bodies(0).mechanics().has_gas();
    }
    return has;
  }

  std::vector<v1::ServerMessage> at_first_;
  std::ostringstream log_;
  const std::shared_ptr<spdlog::logger> logger_before_ = spdlog::default_logger();
};

TEST_F(BurstingWorldTest, ABurstIsToldAndLogged) {
  post(step(1, 1));
  drain();
  EXPECT_EQ(bursts(tick()), 1U);
  EXPECT_NE(log_.str().find("world=w body=ball tick=1 burst: "), std::string::npos) << log_.str();
}

TEST_F(BurstingWorldTest, SimulatorsAreToldThatThereIsNoGasAnyMore) {
  EXPECT_EQ(has_gas(at_first_), std::optional(true));
  post(step(1, 61));
  drain();
  std::vector<v1::ServerMessage> messages;
  for (int ticks = 0; ticks < 61; ++ticks) std::ranges::move(tick(), std::back_inserter(messages));
  EXPECT_EQ(bursts(messages), 1U);
  EXPECT_EQ(has_gas(messages), std::optional(false));
}

TEST_F(BurstingWorldTest, ABurstInTheTickThatAStopFinishesIsToldAndLogged) {
  post(step(1, 1));
  drain();
  ASSERT_FALSE(world_->step([] { return true; })) << "a substep in, before any pressure could burst it";
  world_->finish_tick(TimePoint::max(), outbox_);
  EXPECT_EQ(bursts(take_replies()), 1U);
  EXPECT_NE(log_.str().find("world=w body=ball tick=1 burst: "), std::string::npos) << log_.str();
}

}  // namespace
}  // namespace pneuma::app
