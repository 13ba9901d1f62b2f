// Shows that contact leaves nothing of a world in the room that the next one works in.
#include <gtest/gtest.h>

#include "physics/contact/contact.h"
#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

// A heap of balls, a sheet that folds on itself, something of everything, and a ball without a solid.
std::vector<Scene> unlike_scenes(Integrator integrator) {
  std::vector<Scene> all(3, lively_scene());
  for (int i = 0; i < 3; ++i) {
    all[0].soft_bodies.push_back(ball("c" + std::to_string(i), {-1.0 + 0.7 * i, 1.2 + 0.9 * (i % 2), -1.0}));
  }
  SoftBody& sheet = all[1].soft_bodies[0];
  sheet.mesh = *make_grid(8, 8, 1.0, 1.0);
  sheet.gas.reset();
  sheet.collision.self = true;
  all[1].rigid_bodies.clear();
  Scene& pair = all.emplace_back(lively_scene());
  pair.rigid_bodies.clear();
  pair.colliders.clear();
  pair.soft_bodies[1].velocity = Vec3d(-4.0, 0.0, 0.0);
  pair.soft_bodies[1].position = Vec3d(1.15, 1.2, 0.3);
  for (Scene& scene : all) {
    scene.stepping.integrator = integrator;
    scene.stepping.substeps = integrator == Integrator::implicit_euler ? 2 : 8;
    for (SoftBody& body : scene.soft_bodies) body.velocity.y() = -8.0;
  }
  return all;
}

class PooledRooms : public testing::TestWithParam<Integrator> {};

TEST_P(PooledRooms, WorldsThatTakeTurnsHaveTheBitsOfEachAlone) {
  constexpr int ticks = 40;
  std::vector<World> in_turns;
  std::vector<World> alone;
  for (const Scene& scene : unlike_scenes(GetParam())) {
    in_turns.push_back(make(scene));
    alone.push_back(make(scene));
  }
  for (World& world : alone) run(world, ticks);
  for (int tick = 0; tick < ticks; ++tick) {
    for (World& world : in_turns) run(world, 1);
  }
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(in_turns[i].state_hash(), alone[i].state_hash()) << "world " << i;
    EXPECT_GT(alone[i].row_counts().rows, 0U) << "world " << i;
    EXPECT_EQ(in_turns[i].row_counts().rows, alone[i].row_counts().rows) << "world " << i;
  }
  EXPECT_GT(pooled_contact_bytes(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Methods, PooledRooms,
                         testing::Values(Integrator::symplectic_euler, Integrator::xpbd, Integrator::implicit_euler));

}  // namespace
}  // namespace pneuma::physics
