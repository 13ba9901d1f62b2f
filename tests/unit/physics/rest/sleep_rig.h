// What tests of sleep share: worlds that run, and who sleeps in them.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "physics/world.h"

namespace pneuma::physics {

inline World make_awake(Scene scene) {
  auto world = World::create(std::move(scene));
  EXPECT_TRUE(world.ok()) << world.status().message();
  return std::move(*world);
}

inline void run_on(World& world, int ticks, std::size_t threads = 1) {
  Workers workers(threads);
  for (int i = 0; i < ticks; ++i) world.step_tick(workers);
}

inline std::vector<double> positions_of_body(const World& world, std::size_t body) {
  std::vector<double> x(3 * world.soft_body(body).mesh->positions_m.size());
  world.copy_positions(body, x);
  return x;
}

inline std::size_t count_asleep(const World& world) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) count += world.is_asleep(i) ? 1 : 0;
  for (const RigidState& body : world.rigid_bodies()) count += body.rest.asleep ? 1 : 0;
  return count;
}

}  // namespace pneuma::physics
