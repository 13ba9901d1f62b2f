// Shows when bodies sleep and what wakes them: they keep their place to the bit, only what is at rest sleeps, whatever
// touches or changes a sleeper wakes it and those it rests on, and others have the same bits whether or not it sleeps.
#include "physics/rest/sleep.h"

#include <functional>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "unit/physics/rest/sleep_rig.h"

namespace pneuma::physics {
namespace {

SoftBody resting_ball(const std::string& name, const Vec3d& position) {
  SoftBody body;
  body.name = name;
  body.mesh = *make_icosphere(1, 0.5);
  body.position = position;
  body.springs = {.stiffness_n_m = 4000.0, .damping_n_s_m = 20.0};
  body.gas = Gas{.moles = 0.02};
  body.surface.friction = 0.3;
  return body;
}

RigidBody stone(const std::string& name, const Vec3d& position) {
  RigidBody body;
  body.name = name;
  body.shape = BoxShape{Vec3d::Constant(0.2)};
  body.position = position;
  body.surface.friction = 0.5;
  return body;
}

/// A pile of two balls in a shaft, a ball beside it, and a pile of two boxes, on a floor.
Scene still_life() {
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping.integrator = Integrator::symplectic_euler;
  scene.soft_bodies = {resting_ball("low", {0.0, 0.5, 0.0}), resting_ball("high", {0.0, 1.5, 0.0}),
                       resting_ball("apart", {5.0, 0.5, 0.0})};
  scene.rigid_bodies = {stone("under", {-4.0, 0.2, 0.0}), stone("over", {-4.0, 0.6, 0.0})};
  const auto add = [&](const std::string& name, const Shape& shape, const Vec3d& position) {
    Collider collider;
    collider.name = name;
    collider.shape = shape;
    collider.position = position;
    scene.colliders.push_back(collider);
  };
  add("floor", PlaneShape{}, Vec3d::Zero());
  for (const double side : {-1.0, 1.0}) {
    const Vec3d thick(0.5, 2.0, 0.5);
    add(side < 0 ? "west" : "east", BoxShape{thick}, {side * 1.05, 2.0, 0.0});
    add(side < 0 ? "north" : "south", BoxShape{thick}, {0.0, 2.0, side * 1.05});
  }
  return scene;
}

/// Runs until all sleep; the ticks it took.
int run_until_asleep(World& world, int ticks_max = 3000) {
  const std::size_t bodies = world.soft_body_count() + world.rigid_bodies().size();
  int ticks = 0;
  for (; count_asleep(world) < bodies && ticks < ticks_max; ++ticks) run_on(world, 1);
  EXPECT_LT(ticks, ticks_max) << count_asleep(world) << " of " << bodies << " sleep";
  return ticks;
}

/// The still life asleep, made once.
const std::string& sleeping_snapshot() {
  static const std::string snapshot = [] {
    World world = make_awake(still_life());
    run_until_asleep(world);
    return world.snapshot();
  }();
  return snapshot;
}

World asleep() {
  World world = make_awake(still_life());
  EXPECT_TRUE(world.restore(sleeping_snapshot()).ok());
  EXPECT_EQ(count_asleep(world), 5U);
  return world;
}

enum Body : std::size_t { low, high, apart, under, over };

bool sleeps(const World& world, std::size_t body) {
  return body < 3 ? world.is_asleep(body) : world.rigid_bodies()[body - 3].rest.asleep;
}

/// After one tick these are awake, and the others still sleep.
void expect_awake(World& world, const std::vector<std::size_t>& awake) {
  run_on(world, 1);
  for (const std::size_t body : {low, high, apart, under, over}) {
    EXPECT_EQ(sleeps(world, body), std::ranges::find(awake, body) == awake.end()) << "body " << body;
  }
}

TEST(Sleep, SleepersKeepTheirPlaceToTheBitAndCostNothing) {
  World world = asleep();
  std::vector<std::vector<double>> before;
  for (std::size_t i = 0; i < 3; ++i) before.push_back(positions_of_body(world, i));
  const Vec3d stone_before = world.rigid_bodies()[1].position;
  const std::uint64_t tick = world.tick();
  world.set_profiling(true);
  run_on(world, 200);
  EXPECT_EQ(world.tick(), tick + 200);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(positions_of_body(world, i), before[i]);
    EXPECT_EQ(world.measure(i).max_speed_m_s, 0.0);
  }
  EXPECT_EQ(world.rigid_bodies()[1].position, stone_before);
  const Profile profile = world.profile();
  for (std::size_t stage = 0; stage < stage_count; ++stage) EXPECT_EQ(profile[stage].calls, 0U) << stage_names[stage];
}

TEST(Sleep, FallingAsleepTakesNoMoreEnergyThanStated) {
  World world = make_awake(still_life());
  double kinetic_j = 0.0;
  while (!world.is_asleep(apart)) {
    kinetic_j = world.measure(apart).kinetic_j;
    run_on(world, 1);
    ASSERT_LT(world.tick(), 3000U);
  }
  const double length_m = 1.0 * std::sqrt(3.0);  // no more than the diagonal of the box about the ball
  const double speed_m_s = rest_speed_1_s * length_m;
  EXPECT_LE(kinetic_j, 0.5 * world.soft_body(apart).mass_kg * speed_m_s * speed_m_s);
}

TEST(Sleep, NothingSleepsBeforeItsTime) {
  Scene scene = still_life();
  scene.gravity.setZero();  // at rest from the start, but for the gas
  scene.soft_bodies.clear();
  World world = make_awake(scene);
  run_on(world, 30);
  EXPECT_EQ(count_asleep(world), 0U);
  run_on(world, 2);
  EXPECT_EQ(count_asleep(world), 2U);
}

TEST(Sleep, OffIsOff) {
  Scene scene = still_life();
  scene.stepping.sleep = false;
  World world = make_awake(scene);
  run_on(world, 150);
  EXPECT_EQ(count_asleep(world), 0U);
}

// In weak gravity a body thrown up lingers at its top, nearly still for seconds.
TEST(Sleep, AThrownBodyDoesNotSleepAtTheTopOfItsFlight) {
  for (const double gravity_m_s2 : {9.81, 1e-2, 1e-4}) {
    Scene scene;
    scene.gravity = {0.0, -gravity_m_s2, 0.0};
    scene.stepping.integrator = Integrator::symplectic_euler;
    scene.soft_bodies = {resting_ball("soft", {0.0, 0.0, 0.0})};
    scene.soft_bodies[0].gas.reset();
    scene.soft_bodies[0].velocity = {0.0, 2.0 * gravity_m_s2, 0.0};
    scene.rigid_bodies = {stone("stone", {5.0, 0.0, 0.0})};
    scene.rigid_bodies[0].velocity = {0.0, 2.0 * gravity_m_s2, 0.0};
    World world = make_awake(scene);
    for (int tick = 0; tick < 240; ++tick) {
      run_on(world, 1);
      ASSERT_EQ(count_asleep(world), 0U) << gravity_m_s2 << ", tick " << tick;
    }
    EXPECT_NEAR(world.measure(0).centre_of_mass.y(), 0.0, 0.05 * gravity_m_s2);
  }
}

TEST(Sleep, WhatSomethingActsOnDoesNotSleep) {
  const auto after_ten_seconds = [](const std::function<void(SoftBody&)>& change) {
    Scene scene = still_life();
    scene.atmosphere = {.density_kg_m3 = 1.2, .wind = {0.1, 0.0, 0.0}};
    scene.soft_bodies = {resting_ball("ball", {5.0, 0.5, 0.0})};
    scene.rigid_bodies.clear();
    change(scene.soft_bodies[0]);
    World world = make_awake(scene);
    run_on(world, 600);
    return world.is_asleep(0);
  };
  EXPECT_TRUE(after_ten_seconds([](SoftBody&) {}));
  EXPECT_FALSE(after_ten_seconds([](SoftBody& body) { body.drag.normal = 1.0; }));
  EXPECT_FALSE(after_ten_seconds([](SoftBody& body) { body.gas->flow_mol_s = 1e-9; }));
  EXPECT_FALSE(after_ten_seconds([](SoftBody& body) { body.gas->leak_mol_s_pa = 1e-12; }));
  EXPECT_FALSE(after_ten_seconds([](SoftBody& body) { body.springs.damping_n_s_m = 0.0; }));
}

TEST(Sleep, APileSleepsTogetherAndWakesTogether) {
  World world = make_awake(still_life());
  for (int tick = 0; tick < 3000 && !world.is_asleep(low); ++tick) {
    EXPECT_EQ(world.is_asleep(low), world.is_asleep(high));
    EXPECT_EQ(world.rigid_bodies()[0].rest.asleep, world.rigid_bodies()[1].rest.asleep);
    run_on(world, 1);
  }
  EXPECT_TRUE(world.is_asleep(high));
  world = asleep();
  ASSERT_TRUE(world.apply_impulse("low", WholeBody{}, {0.0, 0.0, 0.01}).ok());
  expect_awake(world, {low, high});
}

TEST(Sleep, AnImpulseOrAHandWakes) {
  World world = asleep();
  ASSERT_TRUE(world.apply_impulse("over", WholeBody{}, {0.01, 0.0, 0.0}).ok());
  expect_awake(world, {under, over});

  world = asleep();
  EXPECT_FALSE(world.apply_impulse("apart", std::uint32_t{99}, Vec3d::UnitX()).ok());  // refused: changes nothing
  const Vec3d at = {positions_of_body(world, apart)[0], positions_of_body(world, apart)[1],
                    positions_of_body(world, apart)[2]};
  EXPECT_EQ(count_asleep(world), 5U);
  ASSERT_TRUE(world.add_grab(1, "apart", std::uint32_t{0}, {at, 10.0, 0.0}).ok());
  expect_awake(world, {apart});
  run_on(world, 600);
  EXPECT_FALSE(world.is_asleep(apart));  // as long as it is held
  ASSERT_TRUE(world.release_grab(1).ok());
  run_until_asleep(world);
}

TEST(Sleep, AnEditWakesWhatItChangesOrActsOn) {
  const auto after = [](const std::function<void(Scene&)>& change, const std::vector<std::size_t>& awake) {
    World world = asleep();
    Scene scene = world.scene();
    change(scene);
    ASSERT_TRUE(world.apply(scene).ok());
    expect_awake(world, awake);
  };
  const std::vector<std::size_t> all{low, high, apart, under, over};
  after([](Scene&) {}, {});
  after([](Scene& scene) { scene.name = "other"; }, {});
  after([](Scene& scene) { scene.gravity.x() = 0.1; }, all);
  after([](Scene& scene) { scene.atmosphere.wind.x() = 1.0; }, all);
  after([](Scene& scene) { scene.atmosphere.pressure_pa = 1.0; }, all);
  after([](Scene& scene) { scene.stepping.rate_hz = 50.0; }, all);
  after([](Scene& scene) { scene.stepping.sleep = false; }, all);
  after([](Scene& scene) { scene.colliders.pop_back(); }, all);
  after([](Scene& scene) { scene.colliders[0].velocity.y() = -0.1; }, all);
  after([](Scene& scene) { scene.soft_bodies[apart].gas->moles = 0.03; }, {apart});
  after([](Scene& scene) { scene.soft_bodies[high].mass_kg = 1.5; }, {low, high});
  after([](Scene& scene) { scene.soft_bodies[apart].pins = {0}; }, {apart});
  after(
      [](Scene& scene) {
        SoftBody& body = scene.soft_bodies[apart];
        body.springs.vertex_stiffness_scale.assign(body.mesh->positions_m.size(), 2.0);
        body.vertex_mass_scale.assign(body.mesh->positions_m.size(), 1.0);
        body.vertex_mass_scale[0] = 2.0;
      },
      {apart});
  after([](Scene& scene) { scene.rigid_bodies[0].mass_kg = 2.0; }, {under, over});
  after([](Scene& scene) { scene.rigid_bodies[1].orientation = Quatd(-1.0, 0.0, 0.0, 1e-3).normalized(); },
        {under, over});
}

TEST(Sleep, WhatStoodOnARemovedBodyFalls) {
  World world = asleep();
  Scene scene = world.scene();
  scene.soft_bodies.erase(scene.soft_bodies.begin());
  scene.rigid_bodies.erase(scene.rigid_bodies.begin());
  const double high_m = world.measure(high).centre_of_mass.y();
  ASSERT_TRUE(world.apply(scene).ok());
  run_on(world, 30);
  EXPECT_LT(world.measure(0).centre_of_mass.y(), high_m - 0.3);
  EXPECT_LT(world.rigid_bodies()[0].position.y(), 0.4);
  EXPECT_TRUE(world.is_asleep(1));
}

TEST(Sleep, ATouchWakesAndHandsOnTheMomentum) {
  for (const bool rigid : {false, true}) {
    World world = asleep();
    Scene scene = world.scene();
    const Vec3d from(5.0, 0.5, 2.0);
    if (rigid) {
      scene.rigid_bodies.push_back(stone("thrown", from));
      scene.rigid_bodies.back().velocity = {0.0, 1.0, -4.0};
    } else {
      scene.soft_bodies.push_back(resting_ball("thrown", from));
      scene.soft_bodies.back().velocity = {0.0, 1.0, -4.0};
    }
    ASSERT_TRUE(world.apply(scene).ok());
    const double before_m = world.measure(apart).centre_of_mass.z();
    run_on(world, 5);
    EXPECT_TRUE(world.is_asleep(apart)) << rigid;  // it is not there yet
    run_on(world, 60);
    EXPECT_FALSE(world.is_asleep(apart)) << rigid;
    EXPECT_LT(world.measure(apart).centre_of_mass.z(), before_m - 0.2) << rigid;
    for (const std::size_t body : {low, high}) EXPECT_TRUE(world.is_asleep(body));
  }
}

TEST(Sleep, ASoftOrRigidBodyWakesASleepingStone) {
  for (const bool rigid : {false, true}) {
    World world = asleep();
    Scene scene = world.scene();
    if (rigid) {
      scene.rigid_bodies.push_back(stone("thrown", {-4.0, 0.9, 1.5}));
      scene.rigid_bodies.back().velocity = {0.0, 0.5, -4.0};
    } else {
      scene.soft_bodies.push_back(resting_ball("thrown", {-4.0, 0.9, 1.5}));
      scene.soft_bodies.back().velocity = {0.0, 0.5, -4.0};
    }
    ASSERT_TRUE(world.apply(scene).ok());
    run_on(world, 40);
    EXPECT_FALSE(world.rigid_bodies()[1].rest.asleep) << rigid;
    EXPECT_LT(world.rigid_bodies()[1].position.z(), -0.05) << rigid;
    EXPECT_TRUE(world.is_asleep(apart)) << rigid;
  }
}

TEST(Sleep, AMovingColliderWakesWhatItComesNearTo) {
  World world = asleep();
  Scene scene = world.scene();
  Collider paddle;
  paddle.name = "paddle";
  paddle.shape = SphereShape{0.3};
  paddle.position = {5.0, 0.5, 3.0};
  paddle.velocity = {0.0, 0.0, -1.0};
  scene.colliders.push_back(paddle);
  ASSERT_TRUE(world.apply(scene).ok());
  run_until_asleep(world, 90);  // an edit of the colliders wakes all; the paddle is 1.3 m away by then
  const double before_m = world.measure(apart).centre_of_mass.z();
  run_on(world, 120);
  EXPECT_FALSE(world.is_asleep(apart));
  EXPECT_LT(world.measure(apart).centre_of_mass.z(), before_m - 0.2);
  EXPECT_TRUE(world.is_asleep(low));
}

TEST(Sleep, TheAwakeHaveTheSameBitsWhoeverSleeps) {
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    const auto run_beside = [&](bool sleep) {
      Scene scene = still_life();
      scene.stepping.sleep = sleep;
      scene.stepping.precision = precision;
      // Undamped, or never still: these stay awake, and never come near the others.
      for (int i = 0; i < 3; ++i) {
        scene.soft_bodies.push_back(resting_ball(std::string("lively-").append(1, static_cast<char>('a' + i)),
                                                 {40.0 + 0.9 * i, 0.6 + 0.7 * i, 0.0}));
        scene.soft_bodies.back().springs.damping_n_s_m = 0.0;
        scene.soft_bodies.back().surface.restitution = 0.9;
      }
      scene.rigid_bodies.push_back(stone("tumbling", {-40.0, 1.0, 0.0}));
      scene.rigid_bodies.back().angular_velocity = {1.0, 2.0, 3.0};
      scene.rigid_bodies.back().surface = {.restitution = 0.99, .friction = 0.0};
      World world = make_awake(scene);
      run_on(world, 240);
      return world;
    };
    const World with = run_beside(true);
    const World without = run_beside(false);
    EXPECT_GE(count_asleep(with), 3U);
    EXPECT_EQ(count_asleep(without), 0U);
    for (const std::size_t body : {3U, 4U, 5U}) {
      EXPECT_FALSE(with.is_asleep(body));
      EXPECT_EQ(positions_of_body(with, body), positions_of_body(without, body));
    }
    const RigidState& stone_with = with.rigid_bodies()[2];
    const RigidState& stone_without = without.rigid_bodies()[2];
    EXPECT_EQ(stone_with.position, stone_without.position);
    EXPECT_EQ(stone_with.angular_velocity, stone_without.angular_velocity);
  }
}

// Before anything rests, while rest is counted, asleep, and awake again. One world runs on without a stop; each
// snapshot of it goes on in another, with two threads, and comes to the hash that the first has at that tick.
TEST(Sleep, ASnapshotAtAnyTimeGoesOnWithTheSameBits) {
  constexpr std::size_t ticks_on = 60;
  struct Moment {
    std::string snapshot;
    std::uint64_t hash;
    std::size_t asleep;
  };
  std::vector<Moment> moments;  // by the tick
  World one = make_awake(still_life());
  const auto note = [&] { moments.push_back({one.snapshot(), one.state_hash(), count_asleep(one)}); };
  note();
  while (count_asleep(one) < 5) {
    ASSERT_LT(moments.size(), 3000U);
    run_on(one, 1);
    note();
  }
  const std::size_t fallen_asleep = moments.size() - 1;
  const std::size_t woken = fallen_asleep + ticks_on + 5;
  while (one.tick() < woken) {
    run_on(one, 1);
    note();
  }
  ASSERT_TRUE(one.apply_impulse("high", WholeBody{}, {0.1, 0.0, 0.0}).ok());
  moments.pop_back();
  note();
  for (std::size_t tick = 0; tick < ticks_on; ++tick) {
    run_on(one, 1);
    note();
  }
  for (const std::size_t at : {fallen_asleep / 2, fallen_asleep - 20, fallen_asleep - 1, fallen_asleep, woken}) {
    World other = make_awake(still_life());
    ASSERT_TRUE(other.restore(moments[at].snapshot).ok());
    EXPECT_EQ(other.state_hash(), moments[at].hash);
    run_on(other, ticks_on, 2);
    EXPECT_EQ(other.state_hash(), moments[at + ticks_on].hash) << "from tick " << at;
    EXPECT_EQ(count_asleep(other), moments[at + ticks_on].asleep);
  }
}

TEST(Sleep, ARestoredWorldForgetsWhereOthersSlept) {
  World world = asleep();
  run_on(world, 3);
  World moving = make_awake(still_life());
  run_on(moving, 5);
  ASSERT_TRUE(world.restore(moving.snapshot()).ok());
  run_on(world, 200);
  run_on(moving, 200);
  EXPECT_EQ(world.state_hash(), moving.state_hash());
}

}  // namespace
}  // namespace pneuma::physics
