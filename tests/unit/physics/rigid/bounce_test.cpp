// Shows that rigid bodies that bounce, slide and turn do so as in nature at one substep a tick.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "physics/rigid/rigid_mass.h"
#include "physics/world.h"

namespace pneuma::physics {
namespace {

Scene one_substep() {
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping.substeps = 1;
  scene.stepping.integrator = Integrator::symplectic_euler;
  return scene;
}

RigidBody box(const Vec3d& half_extents_m, const Vec3d& position) {
  return {.name = "box", .shape = BoxShape{half_extents_m}, .position = position, .surface = {}};
}

double lowest_m(const RigidState& state, const Vec3d& half_extents_m) {
  return state.position.y() - (state.orientation.toRotationMatrix().row(1).transpose().cwiseAbs()).dot(half_extents_m);
}

// Where one corner bounces, another one must not be pushed into the floor.
TEST(RigidBounce, ATiltedBoxStaysAboveTheFloor) {
  const Vec3d half_extents_m(0.1, 0.1, 0.1);
  Scene scene = one_substep();
  scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = {}});
  RigidBody cube = box(half_extents_m, {0.0, 1.5, 0.0});
  cube.surface.friction = 0.5;
  cube.surface.restitution = 0.9;
  for (int tilt = 0; tilt < 12; ++tilt) {
    const Vec3d axis = Vec3d(1.0, 0.3, std::cos(tilt)).normalized();
    cube.orientation = Quatd(Eigen::AngleAxisd(0.2 + 0.5 * tilt, axis));
    scene.rigid_bodies = {cube};
    auto world = World::create(scene);
    ASSERT_TRUE(world.ok()) << world.status().message();
    Workers workers(1);
    double lowest = 0.0;
    for (int tick = 0; tick < 180; ++tick) {
      world->step_tick(workers);
      lowest = std::min(lowest, lowest_m(world->rigid_bodies()[0], half_extents_m));
    }
    EXPECT_GT(lowest, -0.005) << "tilt " << tilt;
  }
}

// The impulse goes through both centres, so neither their angular momentum nor the share of the energy that e leaves
// depends on when within a substep they meet.
TEST(RigidBounce, BallsThatMeetObliquelyKeepTheirAngularMomentum) {
  constexpr double restitution = 0.5;
  constexpr double offset_m = 0.05;
  for (const double gap_m : {0.0, 0.003, 0.011, 0.02, 0.031}) {
    Scene scene = one_substep();
    scene.gravity = Vec3d::Zero();
    const double half_m = std::sqrt(0.01 - offset_m * offset_m) + 0.5 * gap_m;
    for (const double side : {-1.0, 1.0}) {
      RigidBody ball{.name = side < 0.0 ? "a" : "b", .shape = SphereShape{0.1}, .surface = {}};
      ball.position = {side * half_m, -side * offset_m, 0.0};
      ball.velocity = {-side * 2.0, 0.0, 0.0};
      ball.surface.friction = 0.0;
      ball.surface.restitution = restitution;
      scene.rigid_bodies.push_back(ball);
    }
    auto world = World::create(scene);
    ASSERT_TRUE(world.ok()) << world.status().message();
    const auto momentum = [&] {
      Vec3d sum = Vec3d::Zero();
      for (const RigidState& ball : world->rigid_bodies()) sum += ball.position.cross(ball.velocity);
      return sum.z();
    };
    const double at_start = momentum();
    Workers workers(1);
    for (int tick = 0; tick < 6; ++tick) world->step_tick(workers);
    EXPECT_NEAR(momentum(), at_start, 0.01 * std::abs(at_start)) << gap_m;
    double energy_j = 0.0;
    for (const RigidState& ball : world->rigid_bodies()) energy_j += 0.5 * ball.velocity.squaredNorm();
    // sin^2 of the angle between the centres and the way is a quarter.
    EXPECT_NEAR(energy_j, 4.0 * (0.25 + restitution * restitution * 0.75), 0.02) << gap_m;
  }
}

// Friction carries it round: w^2 r is less than mu g.
TEST(RigidBounce, ABoxStaysWhereItIsOnATurntable) {
  Scene scene = one_substep();
  scene.colliders.push_back({.name = "table",
                             .shape = BoxShape{{5.0, 0.5, 5.0}},
                             .position = {0.0, -0.5, 0.0},
                             .angular_velocity = {0.0, 2.0, 0.0},
                             .surface = {}});
  scene.colliders[0].surface.friction = 0.8;
  RigidBody cube = box({0.1, 0.1, 0.1}, {1.0, 0.1, 0.0});
  cube.velocity = {0.0, 0.0, -2.0};
  cube.angular_velocity = {0.0, 2.0, 0.0};
  cube.surface.friction = 0.8;
  scene.rigid_bodies.push_back(cube);
  auto world = World::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  Workers workers(1);
  for (int tick = 0; tick < 300; ++tick) world->step_tick(workers);  // ten radians
  const Vec3d& at = world->rigid_bodies()[0].position;
  EXPECT_NEAR(std::hypot(at.x(), at.z()), 1.0, 0.02);
}

// About its middle axis a box tumbles over and over, at times that Euler's equations give.
TEST(RigidTurn, ABoxTumblesWhenItShould) {
  const Vec3d half_extents_m(0.1, 0.2, 0.4);
  const Vec3d inertia = principal_inertia_kg_m2(BoxShape{half_extents_m}, 1.0);
  Scene scene = one_substep();
  scene.gravity = Vec3d::Zero();
  RigidBody body = box(half_extents_m, Vec3d::Zero());
  body.mass_kg = 1.0;
  body.angular_velocity = {0.1, 10.0, 0.0};
  scene.rigid_bodies.push_back(body);
  auto world = World::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();

  // The body's own angular velocity by small steps of Euler's equations.
  Vec3d w = body.angular_velocity;
  std::vector<double> wanted_s;
  constexpr double step_s = 1e-5;
  const auto rate = [&](const Vec3d& at) -> Vec3d {
    return (-at.cross(inertia.cwiseProduct(at))).cwiseQuotient(inertia);
  };
  for (int i = 0; i < 500'000; ++i) {
    const Vec3d middle = w + 0.5 * step_s * rate(w);
    const Vec3d next = w + step_s * rate(middle);
    if (next.y() * w.y() < 0.0) wanted_s.push_back(i * step_s);
    w = next;
  }
  ASSERT_GE(wanted_s.size(), 3U);
  std::vector<double> found_s;
  Workers workers(1);
  double before = 10.0;
  for (int tick = 1; tick <= 300; ++tick) {
    world->step_tick(workers);
    const RigidState& state = world->rigid_bodies()[0];
    const double now = (state.orientation.conjugate() * state.angular_velocity).y();
    if (now * before < 0.0) found_s.push_back(tick / 60.0);
    before = now;
  }
  ASSERT_EQ(found_s.size(), wanted_s.size());
  for (std::size_t i = 0; i < wanted_s.size(); ++i) EXPECT_NEAR(found_s[i], wanted_s[i], 0.04) << i;
}

TEST(RigidTurn, AFastOneKeepsItsEnergy) {
  Scene scene = one_substep();
  scene.gravity = Vec3d::Zero();
  const Vec3d half_extents_m(0.1, 0.2, 0.4);
  RigidBody body = box(half_extents_m, Vec3d::Zero());
  body.angular_velocity = {3.0, 300.0, 0.0};
  scene.rigid_bodies.push_back(body);
  auto world = World::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  const Vec3d inertia = principal_inertia_kg_m2(BoxShape{half_extents_m}, body.mass_kg);
  const auto energy_j = [&] {
    const RigidState& state = world->rigid_bodies()[0];
    return 0.5 * inertia.dot((state.orientation.conjugate() * state.angular_velocity).cwiseAbs2());
  };
  const double at_start_j = energy_j();
  Workers workers(1);
  for (int tick = 0; tick < 300; ++tick) {
    world->step_tick(workers);
    ASSERT_NEAR(energy_j(), at_start_j, 0.01 * at_start_j) << tick;
  }
}

}  // namespace
}  // namespace pneuma::physics
