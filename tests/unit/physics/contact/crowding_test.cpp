// Shows that what comes near too much at once is stopped and told, whatever brought it there, while its world and the
// bodies that have nothing to do with it go on; and that what looks at contacts then took neither long nor much memory.
#include "physics/contact/crowding.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "physics/contact/candidates.h"
#include "physics/machine/workers.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"
#include "unit/physics/contact/surface_rig.h"

namespace pneuma::physics {
namespace {

using Names = std::set<std::string>;

SoftBody gas_ball(const std::string& name, std::uint32_t subdivisions, const Vec3d& position) {
  SoftBody body;
  body.name = name;
  body.mesh = *make_icosphere(subdivisions, 0.5);
  body.position = position;
  body.gas = Gas{.moles = 0.0287};
  return body;
}

Scene room_with(std::vector<SoftBody> balls, Integrator integrator) {
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping.integrator = integrator;
  scene.soft_bodies = std::move(balls);
  return scene;
}

/// The names of those that a few ticks stop.
Names stopped_by_ticks(World& world, int ticks) {
  Workers workers(1);
  Names stopped;
  for (int i = 0; i < ticks; ++i) {
    world.step_tick(workers);
    for (const FrozenBody& frozen : world.take_frozen()) {
      EXPECT_TRUE(std::string(frozen.reason).find("more came near it") != std::string::npos) << frozen.reason;
      stopped.insert(frozen.name);
    }
  }
  return stopped;
}

class Crowd : public testing::TestWithParam<Integrator> {};

// 642 vertices each: all pairs of their features are ten times what is looked at.
TEST_P(Crowd, OfTwoThickSkinsIsStoppedAndTheOthersFallOn) {
  std::vector<SoftBody> balls{gas_ball("thick", 3, Vec3d(0.0, 0.0, 0.0)), gas_ball("other", 3, Vec3d(3.0, 0.0, 0.0)),
                              gas_ball("far", 2, Vec3d(500.0, 0.0, 0.0))};
  balls[0].surface.thickness_m = 100.0;
  World world = std::move(*World::create(room_with(balls, GetParam())));
  EXPECT_EQ(stopped_by_ticks(world, 3), (Names{"thick", "other"}));
  EXPECT_TRUE(world.is_frozen(0));
  EXPECT_FALSE(world.is_frozen(2));
  EXPECT_LT(world.measure(2).centre_of_mass.y(), -0.005) << "it falls";
}

TEST_P(Crowd, OfOneSkinWithItselfIsStopped) {
  std::vector<SoftBody> balls{gas_ball("itself", 3, Vec3d::Zero()), gas_ball("far", 2, Vec3d(500.0, 0.0, 0.0))};
  balls[0].collision.self = true;
  balls[0].surface.thickness_m = 100.0;
  World world = std::move(*World::create(room_with(balls, GetParam())));
  EXPECT_EQ(stopped_by_ticks(world, 2), Names{"itself"});
}

// As an edit may do while the body falls.
TEST_P(Crowd, ThatAnEditBringsAboutIsStopped) {
  std::vector<SoftBody> balls{gas_ball("one", 3, Vec3d::Zero()), gas_ball("other", 3, Vec3d(3.0, 0.0, 0.0))};
  World world = std::move(*World::create(room_with(balls, GetParam())));
  EXPECT_EQ(stopped_by_ticks(world, 5), Names());
  Scene edited = world.scene();
  edited.soft_bodies[1].surface.thickness_m = 100.0;
  ASSERT_TRUE(world.apply(edited).ok());
  EXPECT_EQ(stopped_by_ticks(world, 2), (Names{"one", "other"}));
}

TEST_P(Crowd, OfASkinAmidCollidersIsStopped) {
  Scene scene = room_with({gas_ball("amid", 3, Vec3d::Zero()), gas_ball("far", 2, Vec3d(500.0, 0.0, 0.0))}, GetParam());
  for (int i = 0; i < 200; ++i) {
    Collider collider;
    collider.name = "c" + std::to_string(i);
    collider.shape = SphereShape{0.8 + 0.001 * i};
    scene.colliders.push_back(collider);
  }
  World world = std::move(*World::create(scene));
  EXPECT_EQ(stopped_by_ticks(world, 2), Names{"amid"});
}

INSTANTIATE_TEST_SUITE_P(Methods, Crowd,
                         testing::Values(Integrator::symplectic_euler, Integrator::implicit_euler, Integrator::xpbd));

// Two hundred boxes of 100 km in a room of a metre, each of which turns: 48 contacts with the room and more with each
// other, looked at in pieces.
TEST(RigidCrowd, OfBoxesInOnePlaceIsStopped) {
  Scene scene;
  Collider room;
  room.name = "room";
  room.shape = RoomShape{Vec3d::Constant(0.5)};
  room.position = Vec3d(0.0, 0.2, 0.0);
  scene.colliders = {room};
  for (int i = 0; i < 200; ++i) {
    RigidBody box;
    box.name = "b" + std::to_string(i);
    box.shape = BoxShape{Vec3d::Constant(1e5)};
    box.position = Vec3d(0.001 * i, 0.0, 0.0);
    box.angular_velocity = Vec3d(300.0 * std::sin(i), 300.0, 0.0);
    scene.rigid_bodies.push_back(box);
  }
  World world = std::move(*World::create(scene));
  EXPECT_GT(stopped_by_ticks(world, 1).size(), 100U);
}

TEST(Takings, NameThoseThatTookAtLeastHalfOfTheMost) {
  Takings takings;
  takings.begin(4);
  EXPECT_TRUE(takings.greatest().empty());
  takings.add(0, 3);
  takings.add(2, 10);
  takings.add(3, 5);
  EXPECT_EQ(takings.greatest(), (std::vector<std::uint32_t>{2, 3}));
  takings.forget(2);
  EXPECT_EQ(takings.greatest(), (std::vector<std::uint32_t>{0, 3}));
}

TEST(Candidates, EndWhereTheLooksDo) {
  std::vector<SurfaceBody> bodies{askew_surface(*make_icosphere(2, 0.5), Vec3d::Zero(), 1, 10.0),
                                  askew_surface(*make_icosphere(2, 0.5), Vec3d(1.1, 0.0, 0.0), 2, 10.0)};
  for (SurfaceBody& body : bodies) fit_way(body);
  constexpr std::size_t looks = 1'000;
  for (const std::uint32_t second : {0U, 1U}) {
    SurfacePair pair{0, second};
    CandidateFinder finder;
    finder.find(pair, bodies);
    const std::size_t all = pair.candidates.size();
    EXPECT_GT(all, 20 * looks);
    finder.allow(looks);
    finder.find(pair, bodies);
    EXPECT_TRUE(finder.is_exhausted());
    EXPECT_LE(pair.candidates.size(), looks + 16);
    finder.allow(20 * all);
    finder.find(pair, bodies);
    EXPECT_FALSE(finder.is_exhausted());
    EXPECT_EQ(pair.candidates.size(), all);
  }
}

}  // namespace
}  // namespace pneuma::physics
