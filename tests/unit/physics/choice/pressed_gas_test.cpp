// Shows that a gas that is pressed gets more substeps than were chosen for it, and that how many does not depend on the
// threads that step it.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::physics {
namespace {

SoftBody soft_ball(std::uint32_t subdivisions) {
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(subdivisions, 0.5);
  body.springs = {.stiffness_n_m = 100.0, .damping_n_s_m = 0.02};
  body.gas = Gas{.moles = 7.3 / (gas_constant_j_mol_k * 293.15)};
  body.collision.soft = SoftCollision::none;
  return body;
}

// A gas that a fall presses to a hundredth of its volume is that much faster than the substeps were chosen for.
class SlammedBall : public testing::TestWithParam<Integrator> {};

TEST_P(SlammedBall, GainsNoEnergyAndStaysWhole) {
  for (const double mass_kg : {5.0, 10.0}) {
    Scene scene;
    scene.gravity = {0.0, -10.0, 0.0};
    scene.stepping.integrator = GetParam();
    scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = {}});
    SoftBody body = soft_ball(1);
    body.mass_kg = mass_kg;
    body.position.y() = 2.0;
    body.surface.restitution = 0.9;
    scene.soft_bodies.push_back(body);
    auto world = World::create(scene);
    ASSERT_TRUE(world.ok()) << world.status().message();
    const auto energy_j = [&] {
      const BodyMeasures now = world->measure(0);
      return now.kinetic_j + now.elastic_j + now.gas_j + now.gravity_j;
    };
    const double at_start_j = energy_j();
    Workers workers(1);
    double least_m3 = 1.0;
    for (int tick = 0; tick < 120; ++tick) {
      world->step_tick(workers);
      least_m3 = std::min(least_m3, world->measure(0).volume_m3);
      ASSERT_LT(energy_j(), 1.01 * at_start_j) << mass_kg << " kg at tick " << tick;
    }
    EXPECT_FALSE(world->is_frozen(0)) << mass_kg << " kg";
    EXPECT_LT(least_m3, 0.03) << "the gas was not pressed";
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, SlammedBall,
                         testing::Values(Integrator::automatic, Integrator::midpoint, Integrator::rk4));

// Large bodies that nothing can touch go through a tick one after the other, in several slices.
TEST(PressedGas, HasTheSameBitsOnAnyNumberOfThreads) {
  Scene scene;
  scene.stepping.integrator = Integrator::symplectic_euler;
  for (int i = 0; i < 3; ++i) {
    SoftBody body = soft_ball(5);
    body.name += std::to_string(i);
    body.position.x() = 10.0 * i;
    for (const Vec3d& x : body.mesh->positions_m) body.start_positions_m.push_back((0.2 + 0.05 * i) * x);
    scene.soft_bodies.push_back(body);
  }
  const auto end_of = [&](std::size_t threads) {
    auto world = World::create(scene);
    EXPECT_TRUE(world.ok()) << world.status().message();
    Workers workers(threads);
    for (int tick = 0; tick < 5; ++tick) world->step_tick(workers);
    return world->snapshot();
  };
  const std::string alone = end_of(1);
  for (const std::size_t threads : {2U, 3U, 5U}) EXPECT_EQ(end_of(threads), alone) << threads << " threads";
}

}  // namespace
}  // namespace pneuma::physics
