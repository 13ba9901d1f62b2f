// Shows that a guided load of 1,000 kg, which can only rise and sink, stands on a ball of 1 kg at one substep a tick,
// that the ball carries its weight, and that it stands on a light plate between them as well. That it rests there on a
// stiff ball as well, as high as by an explicit method. And that a plate which the ball reaches round bounces on it.
#include <cmath>

#include "numerics/worlds.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

class GuidedLoad : public testing::TestWithParam<double> {};

Scene load_on_ball(double stiffness_n_m) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60.0, .substeps = 1, .integrator = Integrator::implicit_euler, .sleep = false};
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5);
  ball.position = {0, 0.5, 0};
  ball.springs = {.stiffness_n_m = stiffness_n_m, .damping_n_s_m = 10.0};
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
  return scene;
}

// It stands for a minute, in the mean of which the ball carries the weight to 0.1 %: the load's momentum does not
// change by more. It trembles meanwhile, by 0.12 m/s on the stiff ball; over 20 s, that alone may be 0.16 % of the
// weight.
TEST_P(GuidedLoad, StandsOnALightBallThatCarriesItsWeight) {
  World world = make_world(load_on_ball(GetParam()));
  run_ticks(world, 60 * 10);
  const RigidState& box = world.rigid_bodies()[0];
  const double from_m_s = box.velocity.y();
  const double from_m = box.position.y();
  double squares_m2_s2 = 0.0;
  for (int tick = 0; tick < 60 * 60; ++tick) {
    run_ticks(world, 1);
    squares_m2_s2 += box.velocity.squaredNorm() / (60.0 * 60.0);
  }
  EXPECT_LT(std::abs(box.velocity.y() - from_m_s) / (9.81 * 60.0), 1e-3);
  EXPECT_LT(std::sqrt(squares_m2_s2), 0.2);
  EXPECT_NEAR(box.position.y(), from_m, 0.05);
  EXPECT_GT(box.position.y() - 0.5, 0.5);
  EXPECT_EQ(box.position.x(), 0.1);
  EXPECT_EQ(box.position.z(), 0.05);
  EXPECT_FALSE(world.is_frozen(0));
}

// Where the load stands does not depend on the method. Passes that began from the skin as it would spring back without
// the load left it 7 cm higher by implicit Euler, where it never came to rest.
TEST(LoadOnAStiffBall, ComesToRestAndStandsAsHighAsByAnExplicitMethod) {
  Scene scene = load_on_ball(1e6);
  World world = make_world(scene);
  run_ticks(world, 60 * 10);
  const double rests_m = world.rigid_bodies()[0].position.y();
  double moved_m = 0.0;
  for (int tick = 0; tick < 60; ++tick) {
    run_ticks(world, 1);
    moved_m = std::max(moved_m, std::abs(world.rigid_bodies()[0].position.y() - rests_m));
  }
  EXPECT_LT(moved_m, 1e-3);

  scene.stepping.integrator = Integrator::symplectic_euler;
  scene.stepping.substeps = 0;
  World explicitly = make_world(scene);
  run_ticks(explicitly, 60 * 6);
  double sum_m = 0.0;
  for (int tick = 0; tick < 60 * 4; ++tick) {  // it still swings
    run_ticks(explicitly, 1);
    sum_m += explicitly.rigid_bodies()[0].position.y();
  }
  EXPECT_NEAR(rests_m, sum_m / (60 * 4), 0.05);
}

// The plate weighs as little as the ball. What lies on it is solved together with what it lies on: one after the other,
// the plate went through the ball.
TEST_P(GuidedLoad, StandsOnALightPlateOnALightBall) {
  Scene scene = load_on_ball(GetParam());
  RigidBody plate = scene.rigid_bodies[0];
  plate.name = "plate";
  plate.shape = BoxShape{{0.9, 0.1, 0.9}};  // the ball does not reach round it
  plate.mass_kg = 1.0;
  plate.position = {0, 1.101, 0};
  scene.rigid_bodies[0].position = {0, 1.702, 0};
  plate.surface.restitution = scene.rigid_bodies[0].surface.restitution = 0.0;
  scene.rigid_bodies.push_back(plate);
  World world = make_world(std::move(scene));
  run_ticks(world, 60 * 5);
  for (int tick = 0; tick < 60 * 2; ++tick) {
    run_ticks(world, 1);
    const double over_plate_m = world.rigid_bodies()[0].position.y() - world.rigid_bodies()[1].position.y() - 0.6;
    ASSERT_GT(over_plate_m, -1e-3) << tick;
    ASSERT_LT(over_plate_m, 0.02) << tick;
    ASSERT_GT(world.rigid_bodies()[1].position.y(), 0.5) << tick;
  }
  EXPECT_FALSE(world.is_frozen(0));
}

class GuidedPlate : public testing::TestWithParam<Integrator> {};

// A plate that the ball reaches round sinks in, and is thrown back. What meets its rim and its corners gives no energy.
TEST_P(GuidedPlate, BouncesOnABallThatReachesRoundIt) {
  for (const double half_m : {0.2, 0.3, 0.5}) {
    Scene scene = load_on_ball(1e4);
    scene.stepping.integrator = GetParam();
    scene.stepping.substeps = is_explicit(GetParam()) ? 0 : 4;
    scene.soft_bodies[0].springs.damping_n_s_m = 1.0;
    scene.soft_bodies[0].gas->moles = 2000.0 / (8.314462618 * 293.15);
    RigidBody& plate = scene.rigid_bodies[0];
    plate.shape = BoxShape{{half_m, 0.05, half_m}};
    plate.mass_kg = 50.0;
    plate.position = {0, 1.2, 0};
    World world = make_world(std::move(scene));
    const auto energy_j = [&] {
      const BodyMeasures ball = world.measure(0);
      const RigidState& state = world.rigid_bodies()[0];
      const double of_plate_j = 50.0 * (0.5 * state.velocity.squaredNorm() + 9.81 * state.position.y());
      return ball.kinetic_j + ball.elastic_j + ball.gas_j + ball.gravity_j + of_plate_j;
    };
    run_ticks(world, 10);  // until the gas, which the mesh was not made for, has swung out
    const double first_j = energy_j();
    for (int tick = 0; tick < 60 * 3; ++tick) {
      run_ticks(world, 1);
      ASSERT_LT(energy_j(), 1.01 * first_j) << half_m << " m, tick " << tick;
      ASSERT_GT(world.rigid_bodies()[0].position.y(), world.measure(0).centre_of_mass.y()) << half_m << " m";
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, GuidedPlate,
                         testing::Values(Integrator::symplectic_euler, Integrator::midpoint, Integrator::implicit_euler,
                                         Integrator::tr_bdf2),
                         test_name_of);

INSTANTIATE_TEST_SUITE_P(Stiffness, GuidedLoad, testing::Values(1e4, 1e6));

}  // namespace
}  // namespace pneuma::physics
