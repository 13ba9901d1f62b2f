// Shows that a soft body which begins deep in a solid leaves it slowly, as a whole, and is not thrown: by every kind of
// method but XPBD, whose skins are softer than the bound, and however stiff.
#include <algorithm>
#include <vector>

#include "numerics/worlds.h"

namespace pneuma::physics {
namespace {

constexpr double deep_m = 0.15;
constexpr double ball_radius_m = 0.5;

struct DeepStart {
  Integrator integrator;
  std::uint32_t substeps;
  double stiffness_n_m;
};

/// A ball whose lowest point is 15 cm under y = 0.
Scene deep_ball(const DeepStart& start) {
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping = {.substeps = start.substeps, .integrator = start.integrator};
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, ball_radius_m);
  ball.springs = {.stiffness_n_m = start.stiffness_n_m, .damping_n_s_m = 1.0};
  ball.gas = Gas{.moles = 10.0 / (gas_constant_j_mol_k * 293.15)};
  ball.position = {0.0, ball_radius_m - deep_m, 0.0};
  scene.soft_bodies.push_back(ball);
  return scene;
}

struct Way {
  double highest_m = 0.0;    // its centre
  double fastest_m_s = 0.0;  // likewise
  double lowest_m = 0.0;     // vertex, at the end
};

Way way_out(World& world, int ticks) {
  Way way;
  for (int tick = 0; tick < ticks; ++tick) {
    run_ticks(world, 1);
    const BodyMeasures of = world.measure(0);
    way.highest_m = std::max(way.highest_m, of.centre_of_mass.y());
    way.fastest_m_s = std::max(way.fastest_m_s, of.momentum.norm() / world.soft_body(0).mass_kg);
  }
  std::vector<double> numbers(3 * world.soft_body(0).mesh->positions_m.size());
  world.copy_positions(0, numbers);
  way.lowest_m = numbers[1];
  for (std::size_t i = 1; i < numbers.size(); i += 3) way.lowest_m = std::min(way.lowest_m, numbers[i]);
  EXPECT_TRUE(world.take_frozen().empty());
  return way;
}

class DeepStarts : public testing::TestWithParam<DeepStart> {};

TEST_P(DeepStarts, LeaveAFloorSlowly) {
  Scene scene = deep_ball(GetParam());
  scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = {}});
  World world = make_world(std::move(scene));
  const Way way = way_out(world, 240);
  EXPECT_GT(way.lowest_m, -0.005);
  EXPECT_LT(way.highest_m, ball_radius_m + 0.02);
  EXPECT_LT(way.fastest_m_s, 1.0);
}

// Until it is out: then it rolls off.
TEST_P(DeepStarts, LeaveABallSlowly) {
  Scene scene = deep_ball(GetParam());
  scene.colliders.push_back({.name = "post", .shape = SphereShape{0.5}, .position = {0.0, -0.5, 0.0}, .surface = {}});
  World world = make_world(std::move(scene));
  const Way way = way_out(world, 60);
  EXPECT_GT(way.lowest_m, -0.04);
  EXPECT_LT(way.highest_m, ball_radius_m + 0.02);
  EXPECT_LT(way.fastest_m_s, 1.0);
}

// Both go their way, by their masses, and keep their momentum.
TEST_P(DeepStarts, PushARigidBallAway) {
  Scene scene = deep_ball(GetParam());
  scene.gravity.setZero();
  RigidBody rigid;
  rigid.name = "rigid";
  rigid.shape = SphereShape{0.5};
  rigid.mass_kg = 3.0;
  rigid.position = {0.0, -0.5, 0.0};
  scene.rigid_bodies.push_back(rigid);
  World world = make_world(std::move(scene));
  const Way way = way_out(world, 120);
  EXPECT_LT(way.fastest_m_s, 1.0);
  const Vec3d ball = world.measure(0).centre_of_mass;
  const Vec3d other = world.rigid_bodies()[0].position;
  EXPECT_GT((ball - other).norm(), 0.95);
  EXPECT_LT((ball - other).norm(), 1.5);
  EXPECT_LT((ball + 3.0 * other - Vec3d(0.0, 0.35 - 1.5, 0.0)).norm(), 1e-5);
}

INSTANTIATE_TEST_SUITE_P(
    Methods, DeepStarts,
    testing::Values(DeepStart{Integrator::midpoint, 0, 1e4}, DeepStart{Integrator::symplectic_euler, 0, 1e6},
                    DeepStart{Integrator::implicit_euler, 1, 1e4}, DeepStart{Integrator::implicit_euler, 4, 1e6},
                    DeepStart{Integrator::tr_bdf2, 1, 1e6}, DeepStart{Integrator::automatic, 0, 1e4}));

}  // namespace
}  // namespace pneuma::physics
