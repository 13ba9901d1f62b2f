// Shows that the steps chosen for a scene hold the motion of its bodies as a whole: a fall by a body's own length, and
// a turn by a radian, come within the error target.
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "physics/choice/stability.h"
#include "physics/choice/step_choice.h"
#include "physics/machine/workers.h"
#include "physics/mesh/mesh.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::physics {
namespace {

constexpr double target = 0.01;

// Its breathing is too fast to be seen, so that it asks nothing of the implicit methods.
Scene stiff_ball(Integrator integrator) {
  Scene scene;
  scene.stepping = {.substeps = 0, .integrator = integrator, .error_target = target};
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(2, 1.0);
  body.springs.stiffness_n_m = 1e6;
  body.gas = Gas{.moles = 100.0 / (gas_constant_j_mol_k * 293.15)};
  scene.soft_bodies.push_back(std::move(body));
  return scene;
}

SubstepChoice choose(const Scene& scene) {
  FrequencyTable none_known;
  return *choose_substeps(scene, none_known);
}

class StiffBall : public testing::TestWithParam<Integrator> {};

TEST_P(StiffBall, FallsByItsOwnLengthWithinTheTarget) {
  Scene scene = stiff_ball(GetParam());
  scene.gravity = {0.0, -9.81, 0.0};
  const double length_m = diagonal_m(scene.soft_bodies.front().mesh->positions_m);
  World world = std::move(*World::create(scene));
  Workers workers(1);
  double error_m = 0.0;
  double fallen_m = 0.0;
  while (fallen_m < length_m) {
    world.step_tick(workers);
    fallen_m = 0.5 * 9.81 * world.time_s() * world.time_s();
    error_m = std::abs(world.measure(0).centre_of_mass.y() + fallen_m);
  }
  EXPECT_LT(error_m, 1.05 * target * length_m);
  if (GetParam() == Integrator::implicit_euler) {
    EXPECT_LT(error_m, 1e-9) << "it falls by a parabola";
  }
}

// Nor is it of a body that drag or a joint holds, or whose contacts come after the step; and what lands softly would
// lose its bounce in one substep.
TEST(StiffBallByImplicitEuler, AsksForStepsOfItsFallWhereThatIsNotExact) {
  Scene scene = stiff_ball(Integrator::implicit_euler);
  scene.gravity = {0.0, -9.81, 0.0};
  EXPECT_EQ(choose(scene).substeps, 1U);
  EXPECT_TRUE(choose(scene).falls_by_parabola);
  Scene in_drag = scene;
  in_drag.soft_bodies.front().drag = {.normal = 0.1, .tangential = 0.1};
  EXPECT_GT(choose(in_drag).substeps, 1U);
  Scene hung = scene;
  Joint& hook = hung.joints.emplace_back();
  hook.first = {.of = Anchor::Of::soft, .body = "ball", .vertex = 0};
  EXPECT_GT(choose(hung).substeps, 1U);
  Scene landing = scene;
  Collider& floor = landing.colliders.emplace_back();
  floor.name = "floor";
  floor.shape = PlaneShape{};
  floor.position = {0.0, -3.0, 0.0};
  EXPECT_EQ(choose(landing).substeps, 1U);
  landing.soft_bodies.front().springs.stiffness_n_m = 1e4;
  EXPECT_GT(choose(landing).substeps, 1U);
  landing.colliders.clear();
  EXPECT_EQ(choose(landing).substeps, 1U);
  Scene by_bounds = scene;
  by_bounds.soft_bodies.push_back(by_bounds.soft_bodies.front());
  by_bounds.soft_bodies.back().name = "other";
  by_bounds.soft_bodies.back().position = {10.0, 0.0, 0.0};
  EXPECT_TRUE(choose(by_bounds).falls_by_parabola);
  by_bounds.soft_bodies.back().collision.soft = SoftCollision::bounds;
  EXPECT_GT(choose(by_bounds).substeps, 1U);
  EXPECT_FALSE(choose(by_bounds).falls_by_parabola);
}

TEST_P(StiffBall, TurnsByARadianWithinTheTarget) {
  Scene scene = stiff_ball(GetParam());
  constexpr double spin_rad_s = 10.0;
  scene.soft_bodies.front().angular_velocity = {0.0, spin_rad_s, 0.0};
  World world = std::move(*World::create(scene));
  Workers workers(1);
  const auto angle = [&world] {
    std::vector<double> at_m(3 * world.soft_body(0).mesh->positions_m.size());
    world.copy_positions(0, at_m);
    return std::atan2(-at_m[2], at_m[0]);  // of the first vertex
  };
  const double start = angle();
  for (int tick = 0; tick < 6; ++tick) world.step_tick(workers);  // a radian at 60 Hz
  const double turned = std::remainder(angle() - start, 2.0 * std::numbers::pi);
  EXPECT_NEAR(turned, spin_rad_s * world.time_s(), 1.1 * target);
  if (GetParam() == Integrator::implicit_euler) {
    EXPECT_LT(turned, spin_rad_s * world.time_s() - 0.4 * target) << "more substeps than it asks for";
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, StiffBall,
                         testing::Values(Integrator::symplectic_euler, Integrator::rk4, Integrator::implicit_euler,
                                         Integrator::tr_bdf2, Integrator::xpbd),
                         [](const auto& instance) { return std::string(name_of(instance.param)); });

TEST(FlightStep, WhatIsPinnedDoesNotFall) {
  Scene scene = stiff_ball(Integrator::implicit_euler);
  scene.gravity = {0.0, -9.81, 0.0};
  scene.soft_bodies.front().drag = {.normal = 0.1, .tangential = 0.1};
  EXPECT_GT(choose(scene).substeps, 1U);
  EXPECT_NE(choose(scene).reason.find("\"ball\" falls by its own length in 0.8"), std::string::npos)
      << choose(scene).reason;
  scene.soft_bodies.front().pins = {0};
  EXPECT_EQ(choose(scene).substeps, 1U);
}

TEST(FlightStep, AutoAsksMoreOfABallThatTurns) {
  Scene scene = stiff_ball(Integrator::automatic);
  EXPECT_EQ(choose(scene).integrator, Integrator::implicit_euler) << choose(scene).reason;
  EXPECT_EQ(choose(scene).substeps, 1U);
  scene.soft_bodies.front().angular_velocity = {0.0, 20.0, 0.0};
  EXPECT_EQ(choose(scene).integrator, Integrator::implicit_euler) << choose(scene).reason;
  EXPECT_EQ(choose(scene).substeps, 4U);
  EXPECT_NE(choose(scene).reason.find("\"ball\" turns at 20 rad/s"), std::string::npos) << choose(scene).reason;
}

// By implicit Euler's steps it shrank as it turned, and turned the faster, until nothing was left of it.
TEST(FlightStep, AutoKeepsATurningBallWholeWhoseDampingOutweighsItsSprings) {
  Scene scene;
  scene.stepping.integrator = Integrator::automatic;
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(1, 0.5);
  body.springs = {.stiffness_n_m = 1e3, .damping_n_s_m = 1e4, .rest_scale = 0.8};
  body.gas = Gas{.moles = 0.04};
  body.angular_velocity.y() = 3.0;
  scene.soft_bodies.push_back(body);
  auto world = World::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  const auto energy_j = [&] {
    const BodyMeasures now = world->measure(0);
    return now.kinetic_j + now.elastic_j + now.gas_j;
  };
  const double start_j = energy_j();
  const double start_m3 = world->measure(0).volume_m3;
  Workers workers(1);
  for (int tick = 0; tick < 900; ++tick) {
    world->step_tick(workers);
    ASSERT_LT(energy_j(), 1.001 * start_j) << tick;
  }
  EXPECT_GT(world->measure(0).volume_m3, 0.5 * start_m3);
}

}  // namespace
}  // namespace pneuma::physics
