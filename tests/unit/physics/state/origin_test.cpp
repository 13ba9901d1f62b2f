// Shows that single precision holds far from the world's origin: a body keeps its shape on a way of 1e6 m; that its
// origin moves without moving a vertex; and that double precision has none.
#include "physics/state/origin.h"

#include <cmath>
#include <random>
#include <utility>

#include <gtest/gtest.h>

#include "physics/forces/soft_setup.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::physics {
namespace {

SoftBody far_ball(const Vec3d& position) {
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(2, 0.5);
  body.springs = {.stiffness_n_m = 60.0, .damping_n_s_m = 0.5};
  body.gas = Gas{.moles = 0.01};
  body.position = position;
  return body;
}

World world_of(Scene scene) {
  auto world = World::create(std::move(scene));
  EXPECT_TRUE(world.ok()) << world.status().message();
  return std::move(*world);
}

void run_far(World& world, int ticks) {
  Workers workers(1);
  for (int i = 0; i < ticks; ++i) world.step_tick(workers);
}

TEST(Origin, ABodyKeepsItsShapeOnAWayOfAMillionMetres) {
  Scene scene;
  scene.stepping = {.rate_hz = 60, .precision = Precision::single_precision};
  scene.soft_bodies = {far_ball(Vec3d::Zero())};
  scene.soft_bodies[0].velocity = {5e3, 0, -5e3};
  World moving = world_of(scene);
  scene.soft_bodies[0].velocity.setZero();
  World still = world_of(scene);
  const int ticks = 200 * 60;
  run_far(moving, ticks);
  run_far(still, ticks);
  const BodyMeasures moved = moving.measure(0);
  EXPECT_NEAR(moved.centre_of_mass.x(), 1e6, 1e-4 * 1e6);
  EXPECT_NEAR(moved.centre_of_mass.z(), -1e6, 1e-4 * 1e6);
  EXPECT_NEAR(moved.volume_m3 / still.measure(0).volume_m3, 1.0, 1e-3);
}

TEST(Origin, MovesWithoutMovingAVertex) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere_m(-300.0, 300.0);
  std::size_t moved = 0;
  for (int run_far = 0; run_far < 200; ++run_far) {
    SoftState<float> body = make_soft_state<float>(far_ball(Vec3d::Zero()));
    const Vec3d way{anywhere_m(random), anywhere_m(random), anywhere_m(random)};
    for (Vec3<float>& x : body.x) x += way.cast<float>();
    std::vector<Vec3d> before;
    for (std::size_t i = 0; i < body.x.size(); ++i) before.push_back(body.position_m(i));
    recentre(body);
    if (!body.origin_m.isZero(0)) ++moved;
    for (std::size_t i = 0; i < body.x.size(); ++i) ASSERT_EQ(body.position_m(i), before[i]);
    EXPECT_LT(body.x[0].cwiseAbs().maxCoeff(), 4.0F * 2.0F + 1.0F);  // four lengths, to the power of two above
  }
  EXPECT_GT(moved, 150U);
}

TEST(Origin, ScalesWithTheBodyByPowersOfTwo) {
  const Vec3d at(123.4, -5.6, 0.7);
  EXPECT_EQ(origin_near(1024.0 * at, 1024.0 * 1.7), 1024.0 * origin_near(at, 1.7));
}

TEST(Origin, OfDoublePrecisionIsTheWorlds) {
  SoftState<double> body = make_soft_state<double>(far_ball({1e6, 2e6, 3e6}));
  recentre(body);
  EXPECT_TRUE(body.origin_m.isZero(0));
}

TEST(Origin, IsPartOfTheSnapshot) {
  Scene scene;
  scene.stepping.precision = Precision::single_precision;
  scene.soft_bodies = {far_ball(Vec3d::Zero())};
  scene.soft_bodies[0].velocity = {100, 0, 0};
  World whole = world_of(scene);
  World cut = world_of(scene);
  run_far(whole, 60);
  run_far(cut, 30);
  World restored = world_of(scene);
  ASSERT_TRUE(restored.restore(cut.snapshot()).ok());
  run_far(restored, 30);
  EXPECT_EQ(restored.state_hash(), whole.state_hash());
}

TEST(Origin, AGrabHoldsAVertexWhereItIsAskedToFarAway) {
  for (const Integrator integrator : {Integrator::midpoint, Integrator::implicit_euler, Integrator::xpbd}) {
    Scene scene;
    scene.stepping = {.substeps = 24, .integrator = integrator, .precision = Precision::single_precision};
    scene.soft_bodies = {far_ball({1e6, 0, 0})};
    scene.soft_bodies[0].springs.damping_n_s_m = 1.0;
    World world = world_of(scene);
    const Vec3d target(1e6 + 2.0, 1.0, 0.0);
    ASSERT_TRUE(world.add_grab(1, "ball", std::uint32_t{3}, {target, 200.0, 5.0}).ok());
    run_far(world, 300);
    std::vector<double> positions(3 * 162);
    world.copy_positions(0, positions);
    EXPECT_LT((Vec3d(positions[9], positions[10], positions[11]) - target).norm(),
              0.02);  // a float there has steps of 0.06
  }
}

TEST(Origin, TwoBodiesFarAwayMeet) {
  Scene scene;
  scene.stepping.precision = Precision::single_precision;
  for (const double side : {-1.0, 1.0}) {
    scene.soft_bodies.push_back(far_ball({1e6 + 0.9 * side, 0, 1e6}));
    scene.soft_bodies.back().name = side < 0 ? "left" : "right";
    scene.soft_bodies.back().velocity = {-2.0 * side, 0, 0};
  }
  World world = world_of(scene);
  run_far(world, 120);
  EXPECT_LT(world.measure(0).momentum.x(), -0.1);
  EXPECT_GT(world.measure(1).momentum.x(), 0.1);
}

}  // namespace
}  // namespace pneuma::physics
