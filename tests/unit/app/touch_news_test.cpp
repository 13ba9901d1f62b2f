// Shows that who asks for touches can follow what touches what: each begins and ends once, sleepers touch on, what was
// removed touches no more, and where there is no room the news come later and the impulses that are left out are
// counted.
#include "app/touch_news.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "unit/physics/lively_world.h"

namespace pneuma::app {
namespace {

using physics::Vec3d;
using physics::World;
using Touch = v1::Touches::Touch;

physics::RigidBody stone(const std::string& name, const Vec3d& position) {
  physics::RigidBody body;
  body.name = name;
  body.shape = physics::SphereShape{0.1};
  body.position = position;
  return body;
}

physics::Scene over_a_floor() {
  physics::Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  physics::Collider floor;
  floor.name = "floor";
  floor.shape = physics::PlaneShape{Vec3d::UnitY()};
  scene.colliders = {floor};
  return scene;
}

World noting(physics::Scene scene) {
  World world = physics::make(std::move(scene));
  world.note_contacts(true);
  return world;
}

/// What a client makes of the news: it fails where they do not go together.
class Follower {
 public:
  explicit Follower(v1::TouchWish wish = {}) : news_(std::move(wish)) {}

  v1::Touches step(World& world) {
    physics::run(world, 1);
    const v1::Touches told = news_.tell(TickTouches(world)).value_or(v1::Touches());
    for (const Touch& touch : told.touches()) {
      const std::pair pair(touch.first(), touch.second());
      if (touch.kind() == Touch::BEGAN) {
        EXPECT_TRUE(touching.insert(pair).second) << "began twice";
      }
      if (touch.kind() == Touch::ENDED) {
        EXPECT_EQ(touching.erase(pair), 1U) << "ended before it began";
      }
      if (touch.kind() == Touch::PRESSED) {
        EXPECT_TRUE(touching.contains(pair));
      }
      EXPECT_EQ(touch.kind() == Touch::ENDED, touch.impulse_n_s() == 0.0);
    }
    return told;
  }
  void edited() { news_.edited(); }
  void forget() {
    news_.forget();
    touching.clear();
  }
  std::set<std::pair<std::string, std::string>> touching;

 private:
  TouchNews news_;
};

v1::TouchWish with_impulses(double least_n_s) {
  v1::TouchWish wish;
  wish.set_impulse_min_n_s(least_n_s);
  return wish;
}

TEST(TouchNews, ABounceBeginsAndEnds) {
  physics::Scene scene = over_a_floor();
  scene.stepping.substeps = 32;
  scene.rigid_bodies = {stone("stone", {0.0, 0.5, 0.0})};
  scene.rigid_bodies[0].surface.restitution = 0.8;
  World world = noting(scene);
  Follower follower;
  std::vector<Touch::Kind> kinds;
  double impulse_n_s = 0.0;
  for (int tick = 0; tick < 40; ++tick) {
    const v1::Touches told = follower.step(world);
    for (const Touch& touch : told.touches()) {
      kinds.push_back(touch.kind());
      EXPECT_EQ(touch.first(), "stone");
      EXPECT_EQ(touch.second(), "floor");
      impulse_n_s += touch.impulse_n_s();
      if (touch.kind() != Touch::BEGAN) continue;
      EXPECT_EQ(touch.normal().y(), 1.0);
      EXPECT_NEAR(touch.position().y(), 0.0, 1e-3);
    }
  }
  EXPECT_EQ(kinds, (std::vector{Touch::BEGAN, Touch::ENDED}));
  // It came with sqrt(2 g h) from 0.4 m and went with 0.8 of that.
  EXPECT_NEAR(impulse_n_s, 1.8 * std::sqrt(2.0 * 9.81 * 0.4), 0.02);
}

TEST(TouchNews, WhatRestsIsTouchedOnceAndTouchesOnAsleep) {
  physics::Scene scene = over_a_floor();
  scene.soft_bodies = {physics::ball("ball", {0.0, 0.55, 0.0})};
  scene.soft_bodies[0].springs.damping_n_s_m = 5.0;
  World world = noting(scene);
  Follower follower;
  for (int tick = 0; tick < 3'000 && !world.is_asleep(0); ++tick) (void)follower.step(world);
  ASSERT_TRUE(world.is_asleep(0));
  for (int tick = 0; tick < 10; ++tick) EXPECT_TRUE(follower.step(world).touches().empty());
  EXPECT_EQ(follower.touching.size(), 1U);
  ASSERT_TRUE(world.apply_impulse("ball", physics::WholeBody{}, {0.0, 20.0, 0.0}).ok());
  for (int tick = 0; tick < 20; ++tick) (void)follower.step(world);
  EXPECT_TRUE(follower.touching.empty());
}

TEST(TouchNews, WhatIsRemovedTouchesNoMore) {
  physics::Scene scene = over_a_floor();
  scene.rigid_bodies = {stone("left", {-1.0, 0.1, 0.0}), stone("right", {1.0, 0.1, 0.0})};
  World world = noting(scene);
  Follower follower;
  for (int tick = 0; tick < 5; ++tick) (void)follower.step(world);
  ASSERT_EQ(follower.touching.size(), 2U);
  physics::Scene without = world.scene();
  without.rigid_bodies.erase(without.rigid_bodies.begin());
  ASSERT_TRUE(world.apply(without).ok());
  follower.edited();
  const v1::Touches told = follower.step(world);
  ASSERT_EQ(told.touches_size(), 1);
  EXPECT_EQ(told.touches(0).kind(), Touch::ENDED);
  EXPECT_EQ(told.touches(0).first(), "left");
}

TEST(TouchNews, OnlyWhatIsAskedForIsTold) {
  physics::Scene scene = over_a_floor();
  scene.rigid_bodies = {stone("left", {-1.0, 0.1, 0.0}), stone("right", {1.0, 0.1, 0.0})};
  World world = noting(scene);
  v1::TouchWish wish;
  wish.add_bodies("right");
  Follower follower(wish);
  for (int tick = 0; tick < 10; ++tick) (void)follower.step(world);
  EXPECT_EQ(follower.touching, (decltype(follower.touching){{"right", "floor"}}));
}

TEST(TouchNews, ImpulsesAreThoseOfAtLeastTheSizeAskedFor) {
  physics::Scene scene = over_a_floor();
  scene.stepping.sleep = false;
  scene.rigid_bodies = {stone("stone", {0.0, 0.1, 0.0})};
  const double weight_n_s = 9.81 / 60.0;
  for (const double share : {0.5, 2.0}) {
    World world = noting(scene);
    Follower follower(with_impulses(share * weight_n_s));
    int pressed = 0;
    for (int tick = 0; tick < 60; ++tick) {
      const v1::Touches told = follower.step(world);
      for (const Touch& touch : told.touches()) {
        if (touch.kind() != Touch::PRESSED) continue;
        ++pressed;
        EXPECT_NEAR(touch.impulse_n_s(), weight_n_s, 0.01 * weight_n_s);
      }
    }
    if (share < 1.0) {
      EXPECT_GE(pressed, 58);
    }
    if (share > 1.0) {
      EXPECT_EQ(pressed, 0);
    }
  }
}

/// Stones side by side, each heavier than the one before, on the floor.
physics::Scene stones_on_a_floor(int count) {
  physics::Scene scene = over_a_floor();
  scene.stepping.sleep = false;
  for (int i = 0; i < count; ++i) {
    scene.rigid_bodies.push_back(stone(std::string("stone ").append(std::to_string(i)), {0.5 * i - 50.0, 0.1, 0.0}));
    scene.rigid_bodies.back().mass_kg = 1.0 + i;
  }
  return scene;
}

TEST(TouchNews, WhereThereIsNoRoomForAllEachBeginsInTurnAndNothingIsDropped) {
  constexpr int stones = 200;
  World world = noting(stones_on_a_floor(stones));
  Follower follower;
  int told_in_all = 0;
  for (int tick = 0; tick < 10; ++tick) {
    const v1::Touches told = follower.step(world);
    EXPECT_LE(told.touches_size(), static_cast<int>(base::touches_a_tick_max));
    EXPECT_EQ(told.dropped(), 0U);
    told_in_all += told.touches_size();
  }
  EXPECT_EQ(told_in_all, stones);
  EXPECT_EQ(follower.touching.size(), static_cast<std::size_t>(stones));
}

TEST(TouchNews, OfImpulsesTheHardestAreToldAndTheOthersCounted) {
  constexpr int stones = 200;
  World world = noting(stones_on_a_floor(stones));
  Follower follower(with_impulses(0.0));
  double told_in_all = 0.0;
  constexpr int ticks = 60;
  for (int tick = 0; tick < ticks; ++tick) {
    const std::size_t before = follower.touching.size();
    const v1::Touches told = follower.step(world);
    told_in_all += told.touches_size();
    const auto is_pressed = [](const Touch& touch) { return touch.kind() == Touch::PRESSED; };
    EXPECT_EQ(std::ranges::count_if(told.touches(), is_pressed) + told.dropped(), before) << tick;
    double least_n_s = 1e9;
    for (const Touch& touch : told.touches()) {
      if (!is_pressed(touch)) continue;
      EXPECT_LE(touch.impulse_n_s(), least_n_s);
      least_n_s = touch.impulse_n_s();
    }
  }
  EXPECT_LE(told_in_all, static_cast<double>(base::touches_a_tick_max) + base::touches_per_s_max * ticks / 60.0);
  EXPECT_EQ(follower.touching.size(), static_cast<std::size_t>(stones));
}

// They bounce once, all in the same tick, and are up again in the next one.
TEST(TouchNews, TouchesThatAreOverBeforeTheirTurnAreCounted) {
  constexpr int stones = 200;
  physics::Scene scene = stones_on_a_floor(stones);
  scene.stepping.substeps = 16;
  for (physics::RigidBody& body : scene.rigid_bodies) {
    body.position.y() = 0.3;
    body.surface.restitution = 0.9;
  }
  World world = noting(scene);
  Follower follower;
  std::size_t began = 0;
  std::size_t dropped = 0;
  for (int tick = 0; tick < 20; ++tick) {
    const v1::Touches told = follower.step(world);
    for (const Touch& touch : told.touches()) began += touch.kind() == Touch::BEGAN ? 1 : 0;
    dropped += told.dropped();
  }
  EXPECT_GT(dropped, 0U);
  EXPECT_EQ(began + dropped, static_cast<std::size_t>(stones));
  EXPECT_TRUE(follower.touching.empty());
}

TEST(TouchNews, WhatIsAddedBeforeOthersLeavesTheirTouchesAsTheyAre) {
  physics::Scene scene = stones_on_a_floor(2);
  World world = noting(scene);
  Follower follower;
  for (int tick = 0; tick < 3; ++tick) (void)follower.step(world);
  physics::Scene more = world.scene();
  more.rigid_bodies.insert(more.rigid_bodies.begin(), stone("first", {20.0, 5.0, 0.0}));
  ASSERT_TRUE(world.apply(more).ok());
  follower.edited();
  EXPECT_TRUE(follower.step(world).touches().empty());
  EXPECT_EQ(follower.touching.size(), 2U);
}

TEST(TouchNews, AWorldThatIsResetBeginsItsTouchesAnew) {
  World world = noting(stones_on_a_floor(1));
  Follower follower;
  for (int tick = 0; tick < 3; ++tick) (void)follower.step(world);
  follower.forget();
  const v1::Touches told = follower.step(world);
  ASSERT_EQ(told.touches_size(), 1);
  EXPECT_EQ(told.touches(0).kind(), Touch::BEGAN);
}

TEST(TouchWish, NamesWhatThereIs) {
  const World world = physics::make(physics::lively_scene());
  v1::TouchWish wish;
  for (const char* name : {"a", "stone", "room"}) wish.add_bodies(name);
  EXPECT_TRUE(check_touch_wish(world, wish).ok());
  wish.add_bodies("stone");
  EXPECT_EQ(check_touch_wish(world, wish).where(), "subscribe.touches.bodies[3]") << "twice";
  wish.set_bodies(3, "nobody");
  const base::Status unknown = check_touch_wish(world, wish);
  EXPECT_EQ(unknown.code(), base::StatusCode::not_found);
  EXPECT_EQ(unknown.where(), "subscribe.touches.bodies[3]");
  EXPECT_EQ(check_touch_wish(world, with_impulses(-1.0)).where(), "subscribe.touches.impulse_min_n_s");
  EXPECT_FALSE(check_touch_wish(world, with_impulses(std::nan(""))).ok());
}

}  // namespace
}  // namespace pneuma::app
