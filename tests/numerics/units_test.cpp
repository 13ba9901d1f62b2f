// Shows that a scene does not depend on its unit of length: with lengths, gravity and velocities s times as large, and
// s^2 times the gas, every force is s times as large and the motion is the same, s times as large. By powers of two it
// is so to the bit, contact included, in both precisions; by others to the rounding of the numbers.
#include <cmath>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"
#include "support/stepping_methods.h"

namespace pneuma::physics {
namespace {

/// A ball with gas under gravity.
Scene ball_scene(const SteppingMethod& method, double unit) {
  Scene scene;
  scene.stepping.integrator = method.integrator;
  scene.stepping.precision = method.precision;
  scene.stepping.substeps = 16;
  scene.gravity = {0, -9.81 * unit, 0};
  scene.atmosphere.pressure_pa = 20.0 / unit;
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5 * unit);
  ball.springs = {.stiffness_n_m = 60.0, .damping_n_s_m = 0.1};
  ball.gas = Gas{.moles = 0.02 * unit * unit};
  ball.position = Vec3d(0.3, 0.9, -0.2) * unit;
  ball.velocity = Vec3d(0.4, -0.3, 0.1) * unit;
  scene.soft_bodies = {ball};
  return scene;
}

Scene hanging_ball(const SteppingMethod& method, double unit) {
  Scene scene = ball_scene(method, unit);
  scene.soft_bodies[0].pins = {0};
  return scene;
}

/// Two balls that meet each other, a rubbing floor, and a post.
Scene bouncing_balls(const SteppingMethod& method, double unit) {
  Scene scene = ball_scene(method, unit);
  SoftBody other = scene.soft_bodies[0];
  other.name = "other";
  other.position += Vec3d(0.2, 1.3, 0.1) * unit;
  scene.soft_bodies.push_back(other);
  Collider floor;
  floor.name = "floor";
  floor.surface = {.restitution = 0.7, .friction = 0.3};
  Collider post;
  post.name = "post";
  post.shape = SphereShape{0.25 * unit};
  post.position = Vec3d(0.9, 0.2, 0.0) * unit;
  scene.colliders = {floor, post};
  return scene;
}

/// Every vertex of every body after so many ticks, in units.
std::vector<double> places(Scene scene, double unit, int ticks) {
  auto world = World::create(std::move(scene));
  EXPECT_TRUE(world.ok()) << world.status().message();
  Workers workers(1);
  for (int i = 0; i < ticks; ++i) world->step_tick(workers);
  std::vector<double> all;
  for (std::size_t body = 0; body < world->soft_body_count(); ++body) {
    EXPECT_FALSE(world->is_frozen(body));
    std::vector<double> of_body(3 * world->soft_body(body).mesh->positions_m.size());
    world->copy_positions(body, of_body);
    for (const double coordinate : of_body) all.push_back(coordinate / unit);
  }
  return all;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

constexpr double body_length = 1.7;  // in units

class Units : public testing::TestWithParam<SteppingMethod> {};

TEST_P(Units, OfPowersOfTwoGiveTheSameBits) {
  for (const double unit : {0x1p-10, 0x1p10}) {
    EXPECT_TRUE(places(hanging_ball(GetParam(), 1.0), 1.0, 90) == places(hanging_ball(GetParam(), unit), unit, 90))
        << "hanging, in units of " << unit << " m";
    EXPECT_TRUE(places(bouncing_balls(GetParam(), 1.0), 1.0, 90) == places(bouncing_balls(GetParam(), unit), unit, 90))
        << "bouncing, in units of " << unit << " m";
  }
}

// Steps short enough for explicit Euler, which magnifies rounding as it does motion.
TEST_P(Units, FromAMillimetreToAKilometreAgree) {
  const auto hang = [](double unit) {
    Scene scene = hanging_ball(GetParam(), unit);
    scene.stepping.substeps = 64;
    return places(scene, unit, 60);
  };
  const std::vector<double> in_metres = hang(1.0);
  for (const double unit : {1e-3, 1e3}) {
    EXPECT_LT(largest_difference(in_metres, hang(unit)), 1e-5 * body_length) << unit << " m";
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Units, testing::ValuesIn(every_stepping_method()), name_of_stepping_method);

}  // namespace
}  // namespace pneuma::physics
