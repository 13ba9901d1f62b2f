// Shows that the touches of a tick tell who pressed whom, and by how much: what a body's momentum gained beyond what
// gravity gave it, by every stepping method and for every kind of partner.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "physics/contact/contact_note.h"
#include "support/stepping_methods.h"
#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

constexpr BodyRef soft_0{BodyKind::soft, 0};
constexpr BodyRef soft_1{BodyKind::soft, 1};
constexpr BodyRef rigid_0{BodyKind::rigid, 0};
constexpr BodyRef rigid_1{BodyKind::rigid, 1};
constexpr BodyRef collider_1{BodyKind::collider, 1};

Collider floor_at(double height_m) {
  Collider floor;
  floor.name = "floor at " + std::to_string(height_m);
  floor.shape = PlaneShape{Vec3d::UnitY()};
  floor.position.y() = height_m;
  return floor;
}

RigidBody stone(const std::string& name, const Shape& shape, const Vec3d& position) {
  RigidBody body;
  body.name = name;
  body.shape = shape;
  body.position = position;
  body.mass_kg = 3.0;
  return body;
}

/// The second floor is the one that is reached.
Scene above_a_floor() {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.stepping.substeps = 16;
  scene.stepping.on_unstable = OnUnstable::allow;
  scene.colliders = {floor_at(-50.0), floor_at(0.0)};
  return scene;
}

TEST(TouchTally, AddsUpPairsInEitherOrder) {
  TouchTally tally;
  tally.add(rigid_0, soft_1, {1.0, 0.5, 0.0}, {0.0, 0.0, 0.0}, Vec3d::UnitX());
  tally.add(soft_1, rigid_0, {-3.0, 0.0, 0.25}, {4.0, 0.0, 0.0}, -Vec3d::UnitX());
  tally.add(soft_0, soft_0, Vec3d::UnitX(), {}, Vec3d::UnitX());      // folds
  tally.add(soft_0, collider_1, Vec3d::UnitX(), {}, Vec3d::UnitY());  // rubs
  tally.add(soft_0, rigid_0, Vec3d::UnitX() / 0.0, {}, Vec3d::UnitX());
  const std::vector<BodyTouch> touches = tally.touches();
  ASSERT_EQ(touches.size(), 1U);
  EXPECT_EQ(touches[0].first, soft_1);
  EXPECT_EQ(touches[0].second, rigid_0);
  EXPECT_EQ(touches[0].impulse_n_s, 4.0);
  EXPECT_EQ(touches[0].push_n_s, Vec3d(-4.0, -0.5, 0.25));
  EXPECT_EQ(touches[0].position, Vec3d(3.0, 0.0, 0.0));
  EXPECT_EQ(touches[0].normal, -Vec3d(Vec3d::UnitX()));
  tally.clear();
  EXPECT_TRUE(tally.touches().empty());
}

/// The impulses on `body` in the tick.
Vec3d pushed_n_s(const World& world, BodyRef body) {
  Vec3d sum = Vec3d::Zero();
  for (const BodyTouch& touch : world.touches()) {
    if (touch.first == body) sum += touch.push_n_s;
    if (touch.second == body) sum -= touch.push_n_s;
  }
  return sum;
}

/// Steps, and compares each tick's touches with what the body's momentum (of what `momentum()` gives) gained.
template <class Momentum>
void expect_balance(World& world, BodyRef body, double mass_kg, int ticks, double tolerance_n_s,
                    const Momentum& momentum) {
  world.note_contacts(true);
  double most_n_s = 0.0;
  for (int tick = 0; tick < ticks; ++tick) {
    const Vec3d before = momentum();
    run(world, 1);
    const Vec3d gained = momentum() - before - mass_kg * world.tick_period_s() * world.gravity_m_s2();
    const Vec3d pushed = pushed_n_s(world, body);
    ASSERT_LT((gained - pushed).norm(), tolerance_n_s)
        << "tick " << tick << ": " << gained.transpose() << " and " << pushed.transpose();
    most_n_s = std::max(most_n_s, pushed.norm());
  }
  EXPECT_GT(most_n_s, 0.1) << "it was touched";
}

class TouchesByMethod : public testing::TestWithParam<SteppingMethod> {
 protected:
  static void step_as_asked(Scene& scene) {
    scene.stepping.integrator = GetParam().integrator;
    scene.stepping.precision = GetParam().precision;
  }
};
INSTANTIATE_TEST_SUITE_P(Every, TouchesByMethod, testing::ValuesIn(every_stepping_method()), name_of_stepping_method);

TEST_P(TouchesByMethod, OnAFloorTheyAreWhatABallGains) {
  Scene scene = above_a_floor();
  step_as_asked(scene);
  scene.soft_bodies = {ball("ball", {0.0, 0.7, 0.0})};
  scene.soft_bodies[0].springs.damping_n_s_m = 5.0;
  scene.soft_bodies[0].velocity.x() = 1.0;
  scene.soft_bodies[0].surface.friction = 0.5;
  World world = make(scene);
  expect_balance(world, soft_0, 2.0, 60, 2e-3, [&] { return world.measure(0).momentum; });
  const std::vector<BodyTouch> touches = world.touches();
  ASSERT_EQ(touches.size(), 1U);
  EXPECT_EQ(touches[0].second, collider_1);
  EXPECT_NEAR(touches[0].position.y(), 0.0, 1e-3);
  EXPECT_NEAR(touches[0].position.x(), world.measure(0).centre_of_mass.x(), 0.05);
}

TEST_P(TouchesByMethod, OfTwoBallsTheyAreWhatEachGains) {
  Scene scene;
  scene.stepping.substeps = 16;
  scene.stepping.on_unstable = OnUnstable::allow;
  step_as_asked(scene);
  scene.soft_bodies = {ball("left", {-0.6, 0.0, 0.0}), ball("right", {0.6, 0.0, 0.0})};
  scene.soft_bodies[0].velocity.x() = 2.0;
  World world = make(scene);
  expect_balance(world, soft_0, 2.0, 40, 2e-2, [&] { return world.measure(0).momentum; });
  EXPECT_LT(world.measure(0).momentum.x(), 3.0);
}

TEST_P(TouchesByMethod, OnAStoneTheyAreWhatTheBallGains) {
  Scene scene = above_a_floor();
  step_as_asked(scene);
  scene.rigid_bodies = {stone("slab", BoxShape{Vec3d(2.0, 0.1, 2.0)}, {0.0, 0.1, 0.0})};
  scene.rigid_bodies[0].mass_kg = 100.0;
  scene.soft_bodies = {ball("ball", {0.0, 0.8, 0.0})};
  scene.soft_bodies[0].springs.damping_n_s_m = 5.0;
  World world = make(scene);
  expect_balance(world, soft_0, 2.0, 40, 5e-3, [&] { return world.measure(0).momentum; });
  const std::vector<BodyTouch> touches = world.touches();
  EXPECT_TRUE(std::ranges::any_of(touches, [](const BodyTouch& touch) {
    return touch.first == rigid_0 && touch.second == collider_1;
  })) << "the slab on the floor";
}

TEST(Touches, OfBoundsTheyAreWhatEachGains) {
  Scene scene;
  scene.stepping.substeps = 16;
  scene.soft_bodies = {ball("left", {-0.6, 0.0, 0.0}), ball("right", {0.6, 0.0, 0.0})};
  scene.soft_bodies[0].velocity.x() = 2.0;
  for (SoftBody& body : scene.soft_bodies) body.collision.soft = SoftCollision::bounds;
  World world = make(scene);
  expect_balance(world, soft_0, 2.0, 40, 1e-3, [&] { return world.measure(0).momentum; });
}

// With a soft body far away or without one, at rest and bouncing, turning or not.
TEST(Touches, OfStonesTheyAreWhatEachGains) {
  for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::implicit_euler}) {
    for (const double restitution : {0.0, 0.7}) {
      for (const double spin_rad_s : {0.0, 30.0}) {
        Scene scene = above_a_floor();
        scene.stepping.integrator = integrator;
        scene.stepping.sleep = false;
        scene.soft_bodies = {ball("far", {20.0, 40.0, 0.0})};
        scene.rigid_bodies = {stone("lower", BoxShape{Vec3d(0.5, 0.2, 0.5)}, {0.0, 0.5, 0.0}),
                              stone("upper", SphereShape{0.3}, {0.02, 1.3, 0.0})};
        for (RigidBody& body : scene.rigid_bodies) body.surface = {.restitution = restitution, .friction = 0.5};
        scene.rigid_bodies[0].angular_velocity.z() = spin_rad_s;
        for (const BodyRef body : {rigid_0, rigid_1}) {
          SCOPED_TRACE(testing::Message() << restitution << " " << spin_rad_s << " body " << body.index);
          World fresh = make(scene);
          expect_balance(fresh, body, 3.0, 60, 1e-6,
                         [&] { return Vec3d(3.0 * fresh.rigid_bodies()[body.index].velocity); });
        }
      }
    }
  }
}

TEST(Touches, AreNoneWhereNobodyAsksAndGoWithTheNotes) {
  World world = make(lively_scene());
  run(world, 60);
  EXPECT_TRUE(world.touches().empty());
  world.note_contacts(true);
  run(world, 60);
  EXPECT_FALSE(world.touches().empty());
  const std::string snapshot = world.snapshot();
  ASSERT_TRUE(world.restore(snapshot).ok());
  EXPECT_TRUE(world.touches().empty());
  run(world, 10);
  world.note_contacts(false);
  EXPECT_TRUE(world.touches().empty());
}

}  // namespace
}  // namespace pneuma::physics
