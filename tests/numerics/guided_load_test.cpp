// Shows that a guided load of 1,000 kg, which can only rise and sink, stands on a ball of 1 kg at one substep a tick,
// and that the ball carries its weight.
#include <cmath>

#include "numerics/worlds.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

class GuidedLoad : public testing::TestWithParam<double> {};

// It stands. In the mean of the last 20 s the ball carries the weight to 0.1 %: the load's momentum does not change by
// more. (So it does over a minute, which takes a quarter of one to run.)
TEST_P(GuidedLoad, StandsOnALightBallThatCarriesItsWeight) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60.0, .substeps = 1, .integrator = Integrator::implicit_euler, .sleep = false};
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5);
  ball.position = {0, 0.5, 0};
  ball.springs = {.stiffness_n_m = GetParam(), .damping_n_s_m = 10.0};
  ball.gas = Gas{.moles = 5.0};
  ball.surface = {.restitution = 0.5, .friction = 0.5};
  scene.soft_bodies.push_back(ball);
  RigidBody load;
  load.name = "load";
  load.shape = BoxShape{{0.5, 0.5, 0.5}};
  load.mass_kg = 1000.0;
  load.position = {0.1, 1.501, 0.05};
  load.surface = {.restitution = 0.5, .friction = 0.5};
  load.locked = {{true, false, true}, {true, true, true}};
  scene.rigid_bodies.push_back(load);
  scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = {.restitution = 0.5, .friction = 0.5}});
  World world = make_world(std::move(scene));
  run_ticks(world, 60 * 10);
  const RigidState& box = world.rigid_bodies()[0];
  const double from_m_s = box.velocity.y();
  const double from_m = box.position.y();
  run_ticks(world, 60 * 20);
  EXPECT_LT(std::abs(box.velocity.y() - from_m_s) / (9.81 * 20.0), 1e-3);
  EXPECT_NEAR(box.position.y(), from_m, 0.05);
  EXPECT_GT(box.position.y() - 0.5, 0.5);
  EXPECT_EQ(box.position.x(), 0.1);
  EXPECT_EQ(box.position.z(), 0.05);
  EXPECT_FALSE(world.is_frozen(0));
}
INSTANTIATE_TEST_SUITE_P(Stiffness, GuidedLoad, testing::Values(1e4, 1e6));

}  // namespace
}  // namespace pneuma::physics
