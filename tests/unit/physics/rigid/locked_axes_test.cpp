// Shows that what is locked of a rigid body never changes by a bit: in flight, hit by soft and rigid bodies, on floors
// and by impulses, by every kind of method. That what is free moves as the laws say for a guided body.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "physics/rigid/rigid_mass.h"
#include "physics/rigid/rigid_motion.h"
#include "physics/world.h"
#include "support/eigen_solvers.h"

namespace pneuma::physics {
namespace {

constexpr std::array all_locked{true, true, true};

World guided_world(Scene scene) {
  auto world = World::create(std::move(scene));
  EXPECT_TRUE(world.ok()) << world.status().message();
  return std::move(*world);
}

void run_guided(World& world, int ticks) {
  Workers workers(1);
  for (int tick = 0; tick < ticks; ++tick) world.step_tick(workers);
}

SoftBody ball_below(const Vec3d& position, const Vec3d& velocity, double stiffness_n_m = 1e4) {
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5);
  ball.position = position;
  ball.velocity = velocity;
  ball.mass_kg = 1.0;
  ball.springs = {.stiffness_n_m = stiffness_n_m, .damping_n_s_m = 1.0};
  ball.gas = Gas{.moles = 1.0};
  ball.surface = {.restitution = 0.5, .friction = 0.5};
  return ball;
}

RigidBody box_of(const Vec3d& half_extents_m, double mass_kg, const Vec3d& position) {
  RigidBody body;
  body.name = "box";
  body.shape = BoxShape{half_extents_m};
  body.mass_kg = mass_kg;
  body.position = position;
  body.surface = {.restitution = 0.5, .friction = 0.5};
  return body;
}

std::array<std::uint64_t, 3> bits_of(const Vec3d& v) {
  return {std::bit_cast<std::uint64_t>(v.x()), std::bit_cast<std::uint64_t>(v.y()),
          std::bit_cast<std::uint64_t>(v.z())};
}

class LockedBody : public testing::TestWithParam<Integrator> {};

// A crowded room: a box that may only rise and sink, and turn about z, among a soft ball, a stone and a tilted box.
TEST_P(LockedBody, KeepsWhatIsLockedToTheBitWhateverHitsIt) {
  Scene scene;
  scene.gravity = {0.3, -9.81, 0.2};
  scene.stepping.integrator = GetParam();
  scene.stepping.sleep = false;
  scene.soft_bodies.push_back(ball_below({-0.9, 1.7, 0.1}, {3.0, 0.0, 0.5}));
  RigidBody guided = box_of({0.4, 0.3, 0.4}, 2.0, {0.123, 1.0, -0.0456});
  guided.locked = {{true, false, true}, {true, true, false}};
  RigidBody stone = box_of({0.2, 0.2, 0.2}, 3.0, {0.3, 2.5, 0.1});
  stone.name = "stone";
  stone.orientation = Eigen::AngleAxisd(0.5, Vec3d(1.0, 1.0, 0.2).normalized());
  RigidBody still = box_of({0.3, 0.1, 0.3}, 1.0, {1.1, 0.7, 0.2});
  still.name = "still";
  still.orientation = Eigen::AngleAxisd(0.3, Vec3d(0.1, 1.0, 0.2).normalized());
  still.locked = {all_locked, all_locked};
  scene.rigid_bodies = {guided, stone, still};
  scene.colliders.push_back({.name = "room",
                             .shape = RoomShape{{1.5, 4.0, 1.0}},
                             .position = {0, 4, 0},
                             .surface = {.restitution = 0.5, .friction = 0.3}});
  World world = guided_world(std::move(scene));
  const Quatd still_at_first = world.rigid_bodies()[2].orientation;
  double highest_m = 0.0;
  for (int tick = 0; tick < 180; ++tick) {
    if (tick == 60) {
      ASSERT_TRUE(world.apply_impulse("box", NearPoint{{0.5, 1.2, 0.3}, 0.0}, {5.0, 9.0, -4.0}).ok());
      ASSERT_TRUE(world.apply_impulse("still", NearPoint{{1.2, 0.9, 0.3}, 0.0}, {5.0, 9.0, -4.0}).ok());
    }
    run_guided(world, 1);
    const RigidState& box = world.rigid_bodies()[0];
    const RigidState& held = world.rigid_bodies()[2];
    ASSERT_EQ(bits_of({box.position.x(), 0.0, box.position.z()}), bits_of({0.123, 0.0, -0.0456})) << tick;
    ASSERT_EQ(box.velocity.x(), 0.0);
    ASSERT_EQ(box.velocity.z(), 0.0);
    ASSERT_EQ(box.orientation.x(), 0.0) << tick;
    ASSERT_EQ(box.orientation.y(), 0.0) << tick;
    ASSERT_EQ(bits_of(held.position), bits_of({1.1, 0.7, 0.2})) << tick;
    ASSERT_EQ(held.orientation.coeffs(), still_at_first.coeffs()) << tick;
    ASSERT_TRUE(held.velocity.isZero(0.0) && held.angular_velocity.isZero(0.0)) << tick;
    highest_m = std::max(highest_m, std::abs(box.position.y() - 1.0));
  }
  EXPECT_GT(highest_m, 0.3);                                          // it fell
  EXPECT_GT(std::abs(world.rigid_bodies()[0].orientation.z()), 0.0);  // and was turned
  EXPECT_FALSE(world.is_frozen(0));
}
INSTANTIATE_TEST_SUITE_P(Methods, LockedBody,
                         testing::Values(Integrator::midpoint, Integrator::xpbd, Integrator::implicit_euler,
                                         Integrator::tr_bdf2));

RigidState locked_state(const LockedAxes& locked) {
  RigidState state;
  state.body = box_of({0.1, 0.4, 0.7}, 3.0, Vec3d::Zero());
  state.body.locked = locked;
  state.orientation = Eigen::AngleAxisd(0.7, Vec3d(0.3, -1.0, 0.5).normalized());
  state.inverse_mass_1_kg = 1.0 / 3.0;
  state.inverse_inertia_1_kg_m2 = principal_inertia_kg_m2(state.body.shape, 3.0).cwiseInverse();
  return state;
}

// For each set of locked axes: no torque turns the body about those, and about the others w = (P I P)^+ t.
TEST(LockedInertia, IsTheInverseAboutTheFreeAxesAndNothingElse) {
  for (unsigned set = 0; set < 8; ++set) {
    const std::array locked{(set & 1U) != 0, (set & 2U) != 0, (set & 4U) != 0};
    const RigidState state = locked_state({{}, locked});
    const Eigen::Matrix3d inverse = inverse_inertia_1_kg_m2(state);
    EXPECT_LT((inverse - inverse.transpose()).norm(), 1e-15 * inverse.norm() + 1e-300) << set;
    EXPECT_GE(support::eigenvalues(inverse).minCoeff(), -1e-12) << set;
    const Eigen::Matrix3d rotation = state.orientation.toRotationMatrix();
    const Eigen::Matrix3d inertia =
        rotation * state.inverse_inertia_1_kg_m2.cwiseInverse().asDiagonal() * rotation.transpose();
    for (const Vec3d& torque : {Vec3d(1.0, 2.0, -3.0), Vec3d(-0.2, 5.0, 1.0)}) {
      const Vec3d turning = inverse_inertia_times(state, torque);
      EXPECT_LE((turning - inverse * torque).norm(), 1e-13 * inverse.norm() * torque.norm()) << set;
      for (Eigen::Index k = 0; k < 3; ++k) {
        if (locked[static_cast<std::size_t>(k)]) {
          EXPECT_EQ(turning[k], 0.0) << set;
        }
      }
      EXPECT_LT(free_part(locked, inertia * turning - torque).norm(), 1e-12 * torque.norm()) << set;
    }
  }
}

// A body that may not turn about y: what it turns by about x and z keeps its energy, which a drift would show.
TEST(LockedInertia, ABodyThatTurnsAboutTwoAxesKeepsItsEnergyAndThoseMomenta) {
  RigidState state = locked_state({{}, {false, true, false}});
  state.angular_velocity = {3.0, 0.0, -2.0};
  const auto momentum = [](const RigidState& at) -> Vec3d {
    const Eigen::Matrix3d rotation = at.orientation.toRotationMatrix();
    return rotation * at.inverse_inertia_1_kg_m2.cwiseInverse().asDiagonal() * rotation.transpose() *
           at.angular_velocity;
  };
  const Vec3d first = momentum(state);
  const double energy_j = 0.5 * first.dot(state.angular_velocity);
  for (int i = 0; i < 4'000; ++i) {
    move_rigid(state, 1e-3);
    ASSERT_EQ(state.angular_velocity.y(), 0.0);
  }
  EXPECT_NEAR(momentum(state).x(), first.x(), 1e-10);
  EXPECT_NEAR(momentum(state).z(), first.z(), 1e-10);
  EXPECT_NEAR(0.5 * momentum(state).dot(state.angular_velocity), energy_j, 1e-2 * energy_j);
}

// A bead on a rail along (1, 0, 0), pushed by m g sin(slope) less what the rail takes: gravity's part along x.
TEST(LockedAxes, ABeadOnARailFallsWithGravitysPartAlongIt) {
  Scene scene;
  scene.gravity = {2.0, -9.81, 1.0};
  RigidBody bead = box_of({0.1, 0.1, 0.1}, 1.0, {0, 1, 0});
  bead.velocity = {0.0, 4.0, 0.0};  // along a locked axis: none
  bead.locked = {{false, true, true}, all_locked};
  scene.rigid_bodies.push_back(bead);
  World world = guided_world(std::move(scene));
  run_guided(world, 120);
  EXPECT_NEAR(world.rigid_bodies()[0].position.x(), 0.5 * 2.0 * 4.0, 1e-9);
  EXPECT_EQ(bits_of({0, world.rigid_bodies()[0].position.y(), world.rigid_bodies()[0].position.z()}),
            bits_of({0, 1.0, 0.0}));
}

// A stone falls onto the end of a beam that may only turn about z at its middle: angular momentum about the pivot is
// what the stone brought. With e = 0: w = m v l / (I + m l^2).
TEST(LockedAxes, AHitTurnsABeamAboutItsPivotAsTheLawsSay) {
  Scene scene;
  RigidBody beam = box_of({1.0, 0.05, 0.05}, 3.0, Vec3d::Zero());
  beam.name = "beam";
  beam.locked = {all_locked, {true, true, false}};
  beam.surface = {.restitution = 0.0, .friction = 0.0};
  RigidBody stone = beam;
  stone.name = "stone";
  stone.shape = SphereShape{0.05};
  stone.mass_kg = 0.5;
  stone.locked = {};
  stone.position = {0.8, 0.11, 0.0};
  stone.velocity = {0.0, -2.0, 0.0};
  scene.rigid_bodies = {beam, stone};
  World world = guided_world(std::move(scene));
  run_guided(world, 2);
  const double inertia = 3.0 / 3.0 * (1.0 + 0.0025);
  const double wanted = -0.5 * 2.0 * 0.8 / (inertia + 0.5 * 0.64);
  EXPECT_NEAR(world.rigid_bodies()[0].angular_velocity.z(), wanted, 0.01 * std::abs(wanted));
}

// Set and unset while the world runs: it hangs where it was locked, and falls on when it is free again.
TEST(LockedAxes, AreSetAndUnsetWhileTheWorldRuns) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.rigid_bodies.push_back(box_of({0.1, 0.1, 0.1}, 1.0, {0, 10, 0}));
  World world = guided_world(std::move(scene));
  run_guided(world, 30);
  Scene edited = world.scene();
  edited.rigid_bodies[0].locked.translation = all_locked;
  const double held_m = edited.rigid_bodies[0].position.y();
  ASSERT_TRUE(world.apply(edited).ok());
  run_guided(world, 120);  // long enough to fall asleep
  EXPECT_EQ(world.rigid_bodies()[0].position.y(), held_m);
  edited = world.scene();
  edited.rigid_bodies[0].locked = {};
  ASSERT_TRUE(world.apply(edited).ok());
  run_guided(world, 60);
  EXPECT_NEAR(world.rigid_bodies()[0].position.y(), held_m - 0.5 * 9.81, 1e-6);
}

}  // namespace
}  // namespace pneuma::physics
