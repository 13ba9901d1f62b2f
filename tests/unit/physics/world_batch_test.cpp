// Shows that worlds which are stepped together have the bits of each one alone: bodies that share lanes with those of
// other worlds, and bodies that cannot; whatever happens to one of them.
#include "physics/world_batch.h"

#include <gtest/gtest.h>

#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

Scene flight(Integrator integrator, Precision precision) {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.stepping.substeps = 8;
  scene.stepping.integrator = integrator;
  scene.stepping.precision = precision;
  scene.soft_bodies = {ball("ball", {0.3, 1.0, -0.2})};
  scene.soft_bodies[0].velocity = Vec3d(1.0, 2.0, 0.5);
  return scene;
}

// As many alike as fill the widest lanes twice, and among them one of each kind that cannot share with these.
std::vector<Scene> scenes(Integrator integrator, Precision precision) {
  std::vector<Scene> all;
  for (std::size_t i = 0; i < 48; ++i) {
    Scene scene = flight(integrator, precision);
    SoftBody& body = scene.soft_bodies[0];
    body.velocity.x() = 0.1 * static_cast<double>(i);
    body.springs.stiffness_n_m += static_cast<double>(i);
    switch (i) {
      case 2:
        scene.gravity = Vec3d(0.0, -1.62, 0.0);
        break;
      case 4:
        scene.stepping.substeps = 5;
        break;
      case 5:
        scene.stepping.rate_hz = 120.0;
        scene.stepping.substeps = 4;  // as long as the others', but fewer
        break;
      case 6:
        scene.stepping.rate_hz = 120.0;
        break;
      case 7:
        body.gas.reset();
        break;
      case 8:
        body.springs.damping_n_s_m = 0.0;
        break;
      case 10:
        body.gas->burst_pressure_pa = 1e-3;
        break;
      case 11:
        body.velocity.y() = 1.0 - 1e5;  // it falls past the limit
        break;
      case 13:
        scene.atmosphere = {.pressure_pa = 100.0, .density_kg_m3 = 1.2, .wind = Vec3d(3.0, 0.0, 0.0)};
        break;
      case 14:
        body.mesh = *make_icosphere(2, 0.4);
        break;
      case 16:
        scene.soft_bodies.push_back(ball("other", {0.5, 1.5, 0.0}));
        break;  // they meet
      case 17:
        scene.soft_bodies.push_back(ball("ghost", {0.5, 1.5, 0.0}));
        scene.soft_bodies[1].collision.soft = SoftCollision::none;
        break;
      case 18:  // two run away at once
        scene.soft_bodies.push_back(ball("first", {0.5, 1.5, 0.0}));
        scene.soft_bodies[1].collision.soft = SoftCollision::none;
        scene.soft_bodies[1].springs.damping_n_s_m = 0.0;
        for (SoftBody& each : scene.soft_bodies) each.velocity = Vec3d(0.0, 1.0 - 1e5, 0.0);
        break;
      case 19:
        scene.soft_bodies.clear();
        break;
      default:
        break;
    }
    all.push_back(std::move(scene));
  }
  return all;
}

class WorldBatches : public testing::TestWithParam<std::tuple<Integrator, Precision>> {};

// The worlds of a fleet are copies of one, and share its tables; here each makes its own, so those that are to share
// lanes are copied.
TEST_P(WorldBatches, HaveTheBitsOfWorldsAlone) {
  const auto [integrator, precision] = GetParam();
  World start = make(flight(integrator, precision));
  WorldBatch::prepare(start);
  std::vector<World> together;
  std::vector<World> alone;
  for (const Scene& scene : scenes(integrator, precision)) {
    together.push_back(start.copy());
    const base::Status applied = together.back().apply(scene);
    ASSERT_TRUE(applied.ok()) << "world " << together.size() - 1 << ": " << applied.message();
    alone.push_back(make(flight(integrator, precision)));
    ASSERT_TRUE(alone.back().apply(scene).ok());
  }
  std::vector<World*> worlds;
  for (World& world : together) worlds.push_back(&world);
  WorldBatch batch;
  for (int tick = 0; tick < 20; ++tick) {
    if (tick == 10) {
      for (World* const world : {&together[3], &alone[3]}) {
        ASSERT_TRUE(world->apply_impulse("ball", WholeBody{}, {1.0, 0.0, 0.0}).ok());
        ASSERT_TRUE(world->apply_impulse("ball", 5U, {0.1, 0.0, 0.3}).ok());
      }
    }
    const std::size_t shared = batch.step_tick(worlds);
    if (is_explicit(together[0].integrator())) {
      EXPECT_GE(shared, 32U);
    }
    for (std::size_t i = 0; i < alone.size(); ++i) {
      run(alone[i], 1);
      ASSERT_EQ(together[i].state_hash(), alone[i].state_hash()) << "world " << i << ", tick " << tick;
    }
  }
  EXPECT_TRUE(together[11].is_frozen(0));
  EXPECT_EQ(together[10].take_gas_events().size(), 1U);
  const auto names = [](World& world) {
    std::vector<std::string> all;
    for (const FrozenBody& frozen : world.take_frozen()) all.push_back(frozen.name);
    return all;
  };
  const std::vector<std::string> both = names(together[18]);
  EXPECT_EQ(both.size(), 2U);
  EXPECT_EQ(both, names(alone[18]));
}

INSTANTIATE_TEST_SUITE_P(Methods, WorldBatches,
                         testing::Combine(testing::Values(Integrator::symplectic_euler, Integrator::rk4,
                                                          Integrator::midpoint, Integrator::automatic,
                                                          Integrator::implicit_euler, Integrator::xpbd),
                                          testing::Values(Precision::single_precision, Precision::double_precision)));

}  // namespace
}  // namespace pneuma::physics
