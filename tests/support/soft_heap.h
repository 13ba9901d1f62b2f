// Soft balls in a shaft.
#pragma once

#include <cmath>
#include <cstddef>
#include <string>

#include "physics/mesh/mesh_builders.h"
#include "physics/scene/scene.h"

namespace pneuma::support {

/// Layers of four balls of 42 vertices, each askew, over each other. The shaft is twice `half_width_m` wide.
[[nodiscard]] inline physics::Scene soft_heap(std::size_t balls, double half_width_m, physics::Integrator integrator) {
  physics::Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping.integrator = integrator;
  const auto mesh = *physics::make_icosphere(1, 0.25);
  for (std::size_t i = 0; i < balls; ++i) {
    physics::SoftBody ball;
    ball.name = "ball-" + std::to_string(i);
    ball.mesh = mesh;
    const double askew_m = 0.02 * std::sin(static_cast<double>(i));
    const std::size_t layer = i / 4;
    const std::size_t row = i / 2 % 2;
    const std::size_t column = i % 2;
    ball.position = {0.6 * (static_cast<double>(column) - 0.5) + askew_m, 0.4 + 0.6 * static_cast<double>(layer),
                     0.6 * (static_cast<double>(row) - 0.5) - askew_m};
    ball.springs = {.stiffness_n_m = 500.0, .damping_n_s_m = 1.0};
    ball.gas = physics::Gas{.moles = 0.0287};
    ball.surface.friction = 0.5;
    scene.soft_bodies.push_back(ball);
  }
  physics::Collider shaft;
  shaft.name = "shaft";
  shaft.shape = physics::RoomShape{physics::Vec3d(half_width_m, 5.0, half_width_m)};
  shaft.position.y() = 5.0;
  shaft.surface.friction = 0.5;
  scene.colliders = {shaft};
  return scene;
}

}  // namespace pneuma::support
