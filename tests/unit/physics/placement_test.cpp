// Shows that bodies lie where they are put, to the last bit that their precision has, go on from there as a body that
// came there by itself, and that what cannot be changes nothing.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

std::vector<double> velocities(const World& world, std::size_t body) {
  std::vector<double> v(3 * world.soft_body(body).mesh->positions_m.size());
  world.copy_velocities(body, v);
  return v;
}

SoftPlacement placement_of(const World& world, std::size_t body) {
  return {world.soft_body(body).name, positions(world, body), velocities(world, body)};
}

RigidPlacement placement_of(const RigidState& body) {
  return {body.body.name, body.position, body.orientation, body.velocity, body.angular_velocity};
}

TEST(Placement, PutsBodiesWhereAnotherWorldHasThem) {
  World there = make(lively_scene());
  World here = make(lively_scene());
  run(there, 90);
  const base::Status placed =
      here.place({placement_of(there, 0), placement_of(there, 1)}, {placement_of(there.rigid_bodies()[0])});
  ASSERT_TRUE(placed.ok()) << placed.message();
  for (const std::size_t body : {0U, 1U}) {
    EXPECT_EQ(positions(here, body), positions(there, body));
    EXPECT_EQ(velocities(here, body), velocities(there, body));
  }
  EXPECT_EQ(here.rigid_bodies()[0].position, there.rigid_bodies()[0].position);
  EXPECT_EQ(here.rigid_bodies()[0].orientation.coeffs(), there.rigid_bodies()[0].orientation.coeffs());
  EXPECT_EQ(here.rigid_bodies()[0].velocity, there.rigid_bodies()[0].velocity);
  EXPECT_EQ(here.rigid_bodies()[0].angular_velocity, there.rigid_bodies()[0].angular_velocity);
}

// The gas keeps its temperature, so places and velocities are all there is of the state.
TEST(Placement, BodiesAloneGoOnBitForBit) {
  Scene scene;
  scene.stepping.substeps = 8;
  scene.soft_bodies = {ball("a")};
  World there = make(scene);
  World here = make(scene);
  ASSERT_TRUE(there.apply_impulse("a", std::uint32_t{3}, {4.0, -1.0, 2.0}).ok());
  run(there, 30);
  ASSERT_TRUE(here.place({placement_of(there, 0)}, {}).ok());
  run(there, 30);
  run(here, 30);
  EXPECT_EQ(positions(here, 0), positions(there, 0));
}

// Single precision sees a body from near it: its places are kept to a part in 2^24 of its own size, not of where it is.
TEST(Placement, InSinglePrecisionABodyFarOffKeepsItsShape) {
  Scene scene;
  scene.stepping.precision = Precision::single_precision;
  scene.soft_bodies = {ball("a")};
  World world = make(scene);
  std::vector<double> wanted = positions(world, 0);
  for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] += 1e5 + 0.25 * static_cast<double>(i % 3);
  ASSERT_TRUE(world.place({{"a", wanted, {}}}, {}).ok());
  const std::vector<double> found = positions(world, 0);
  for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(found[i], wanted[i], 1e-6);
}

TEST(Placement, WakesASleeper) {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.soft_bodies = {ball("a", {0.0, 0.6, 0.0})};
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  scene.colliders = {floor};
  World world = make(scene);
  for (int i = 0; i < 50 && !world.is_asleep(0); ++i) run(world, 60);
  ASSERT_TRUE(world.is_asleep(0));
  std::vector<double> lifted = positions(world, 0);
  for (std::size_t i = 1; i < lifted.size(); i += 3) lifted[i] += 1.0;
  ASSERT_TRUE(world.place({{"a", lifted, {}}}, {}).ok());
  EXPECT_FALSE(world.is_asleep(0));
  const double before_m = world.measure(0).centre_of_mass.y();
  run(world, 10);
  EXPECT_LT(world.measure(0).centre_of_mass.y(), before_m);
}

TEST(Placement, PinnedVerticesAndLockedAxesGetNoVelocity) {
  Scene scene = lively_scene();
  scene.soft_bodies[0].pins = {5};
  scene.rigid_bodies[0].locked.translation = {true, false, false};
  scene.rigid_bodies[0].locked.rotation = {false, true, false};
  World world = make(scene);
  const std::vector<double> fast(3 * 42, 2.0);
  const Vec3d wanted(1.0, 2.0, 3.0);
  ASSERT_TRUE(world.place({{"a", {}, fast}}, {{"stone", {}, {}, wanted, wanted}}).ok());
  const std::vector<double> found = velocities(world, 0);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], i / 3 == 5 ? 0.0 : 2.0);
  EXPECT_EQ(world.rigid_bodies()[0].velocity, Vec3d(0.0, 2.0, 3.0));
  EXPECT_EQ(world.rigid_bodies()[0].angular_velocity, Vec3d(1.0, 0.0, 3.0));
}

TEST(Placement, WhatCannotBeChangesNothingAndIsNamed) {
  World world = make(lively_scene());
  run(world, 5);
  const std::uint64_t before = world.state_hash();
  const std::vector<double> good = positions(world, 0);
  std::vector<double> bad = good;
  bad[7] = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> far = good;
  far[9] = 2.0 * base::coordinate_max_m;
  const std::vector<double> too_fast(good.size(), 2.0 * base::speed_max_m_s);
  const std::vector<double> too_few(good.size() - 3, 0.0);
  struct Case {
    std::vector<SoftPlacement> soft;
    std::vector<RigidPlacement> rigid;
    base::StatusCode code;
    std::string where;
  };
  using enum base::StatusCode;
  const std::vector<Case> cases{
      {{{"a", good, {}}, {"c", good, {}}}, {}, not_found, "soft_bodies[1].name"},
      {{{"a", good, {}}, {"a", good, {}}}, {}, invalid_argument, "soft_bodies[1].name"},
      {{{"a", bad, {}}}, {}, invalid_argument, "soft_bodies[0].positions[2]"},
      {{{"a", far, {}}}, {}, limit_exceeded, "soft_bodies[0].positions[3]"},
      {{{"a", {}, too_fast}}, {}, limit_exceeded, "soft_bodies[0].velocities[0]"},
      {{{"b", too_few, {}}}, {}, invalid_argument, "soft_bodies[0].positions"},
      {{{"a", good, {}}}, {{"pebble", {}, {}, {}, {}}}, not_found, "rigid_bodies[0].name"},
      {{}, {{"stone", Vec3d(0.0, bad[7], 0.0), {}, {}, {}}}, invalid_argument, "rigid_bodies[0].position.y"},
      {{}, {{"stone", {}, Quatd(2.0, 0.0, 0.0, 0.0), {}, {}}}, invalid_argument, "rigid_bodies[0].orientation"},
      {{}, {{"stone", {}, {}, {}, Vec3d(0.0, 0.0, far[9])}}, limit_exceeded, "rigid_bodies[0].angular_velocity.z"},
  };
  for (const Case& each : cases) {
    const base::Status status = world.place(each.soft, each.rigid);
    EXPECT_EQ(status.code(), each.code) << each.where;
    EXPECT_EQ(status.where(), each.where);
    EXPECT_EQ(world.state_hash(), before) << each.where;
  }
}

}  // namespace
}  // namespace pneuma::physics
