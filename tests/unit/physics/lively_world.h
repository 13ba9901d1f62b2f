// A world with something of everything in it, for the tests of what a world promises.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::physics {

inline SoftBody ball(const std::string& name, const Vec3d& position = Vec3d::Zero()) {
  SoftBody body;
  body.name = name;
  body.mesh = *make_icosphere(1, 0.5);
  body.position = position;
  body.mass_kg = 2.0;
  body.springs = {.stiffness_n_m = 200.0, .damping_n_s_m = 0.5};
  body.gas = Gas{.moles = 0.01};
  return body;
}

// Two balls, a rigid ball and a turning room, in gravity: something of everything.
inline Scene lively_scene() {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.stepping.substeps = 16;
  scene.soft_bodies = {ball("a", {0.0, 1.0, 0.0}), ball("b", {1.2, 1.5, 0.3})};
  RigidBody rigid;
  rigid.name = "stone";
  rigid.shape = SphereShape{0.3};
  rigid.position = {-1.0, 2.0, 0.0};
  scene.rigid_bodies.push_back(rigid);
  Collider room;
  room.name = "room";
  room.shape = RoomShape{Vec3d(3.0, 3.0, 3.0)};
  room.angular_velocity = Vec3d(0.0, 0.0, 0.5);
  room.surface = {.restitution = 0.4, .friction = 0.5};
  scene.colliders.push_back(room);
  return scene;
}

inline World make(Scene scene) {
  auto world = World::create(std::move(scene));
  EXPECT_TRUE(world.ok()) << world.status().message();
  return std::move(*world);
}

inline void run(World& world, int ticks) {
  Workers workers(1);
  for (int i = 0; i < ticks; ++i) world.step_tick(workers);
}

inline std::vector<double> positions(const World& world, std::size_t body) {
  std::vector<double> x(3 * world.soft_body(body).mesh->positions_m.size());
  world.copy_positions(body, x);
  return x;
}

}  // namespace pneuma::physics
