// Shows that rigid capsules have the mass of a solid one, rest on every kind of solid, roll down a slope as a cylinder
// with round ends does, and hit each other and soft bodies with momentum kept.
#include <cmath>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "physics/mesh/picking.h"
#include "physics/world.h"
#include "unit/physics/contact/contact_rig.h"

namespace pneuma::physics {
namespace {

const CapsuleShape capsule_shape{.radius_m = 0.2, .half_height_m = 0.5};

// By summing over a grid of cells: an integral that knows nothing of cylinders and half balls.
TEST(CapsuleInertia, IsThatOfASolidOne) {
  const auto& [r, h] = capsule_shape;
  const int cells = 60;
  const double size_m = 2.0 * (r + h) / cells;
  double count = 0.0;
  Vec3d squares = Vec3d::Zero();
  for (int i = 0; i < cells; ++i) {
    for (int j = 0; j < cells; ++j) {
      for (int k = 0; k < cells; ++k) {
        const Vec3d p = (Vec3d(i, j, k).array() + 0.5) * size_m - (r + h);
        if (surface_distance(capsule_shape, p) > 0.0) continue;
        count += 1.0;
        squares += p.cwiseAbs2();
      }
    }
  }
  squares *= 3.0 / count;
  const Vec3d wanted = Vec3d::Constant(squares.sum()) - squares;
  const Vec3d inertia = principal_inertia_kg_m2(capsule_shape, 3.0);
  for (Eigen::Index k = 0; k < 3; ++k) EXPECT_NEAR(inertia[k], wanted[k], 0.02 * wanted[k]);
}

// A ray ends on the surface, and enters where it comes from outside.
TEST(CapsulePicking, RaysMeetTheSurface) {
  int hits = 0;
  for (int i = 0; i < 400; ++i) {
    const Vec3d origin(std::sin(1.3 * i), 1.2 * std::cos(0.7 * i), std::sin(2.1 * i + 1.0));
    const Vec3d target(0.1 * std::cos(3.7 * i), 0.6 * std::sin(5.1 * i), 0.1 * std::sin(0.3 * i));
    const auto distance_m = hit_capsule_m({origin, target - origin}, 0.2, 0.5);
    ASSERT_TRUE(distance_m) << i;
    const Vec3d direction = (target - origin).normalized();
    const Vec3d at = origin + *distance_m * direction;
    EXPECT_NEAR(surface_distance(capsule_shape, at), 0.0, 1e-12) << i;
    const bool outside = surface_distance(capsule_shape, origin) > 0.0;
    EXPECT_EQ(nearest_surface(capsule_shape, at).normal.dot(direction) <= 1e-9, outside) << i;
    hits += outside ? 1 : 0;
  }
  EXPECT_GT(hits, 200);
  EXPECT_FALSE(hit_capsule_m({{1.0, 0.0, 0.21}, Vec3d(-1.0, 0.0, 0.0)}, 0.2, 0.5));
  EXPECT_FALSE(hit_capsule_m({{1.0, 0.8, 0.0}, Vec3d(-1.0, 0.0, 0.0)}, 0.2, 0.5));
}

struct Ground {
  Shape shape;
  Vec3d position;
};

class CapsuleRests : public testing::TestWithParam<Ground> {};

// Lying along x, it comes to rest where its side touches, and stays there.
TEST_P(CapsuleRests, LyingOnIt) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.rigid.push_back(make_rigid(capsule_shape, 2.0, {0.0, 0.25, 0.0}, Vec3d::Zero(), surface(0.0, 0.5)));
  rig.rigid[0].orientation = Eigen::AngleAxisd(0.5 * M_PI, Vec3d::UnitZ());
  rig.colliders.push_back(make_collider(GetParam().shape, GetParam().position, surface(0.0, 0.5)));
  rig.run(1.0);
  EXPECT_NEAR(rig.rigid[0].position.y(), 0.2, 2e-4);
  EXPECT_NEAR((rig.rigid[0].orientation * Vec3d::UnitY()).y(), 0.0, 1e-3);
  EXPECT_LT(rig.rigid[0].velocity.norm(), 1e-3);
}
INSTANTIATE_TEST_SUITE_P(Grounds, CapsuleRests,
                         testing::Values(Ground{PlaneShape{}, Vec3d::Zero()}, Ground{BoxShape{{1, 1, 1}}, {0, -1, 0}},
                                         Ground{BoxShape{{0.2, 1, 1}}, {0, -1, 0}},
                                         Ground{RoomShape{{1, 1, 1}}, {0, 1, 0}}));

// On a rigid box, which lies on a floor, and under another one: a heap of all three shapes.
TEST(CapsuleHeap, StandsWithCapsulesBetweenBoxes) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  const Surface rough = surface(0.0, 0.8);
  rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), rough));
  rig.rigid.push_back(make_rigid(BoxShape{{1, 0.1, 1}}, 2.0, {0, 0.1, 0}, Vec3d::Zero(), rough));
  for (const double z : {-0.5, 0.5}) {
    rig.rigid.push_back(make_rigid(capsule_shape, 1.0, {0, 0.4, z}, Vec3d::Zero(), rough));
    rig.rigid.back().orientation = Eigen::AngleAxisd(0.5 * M_PI, Vec3d::UnitZ());
  }
  rig.rigid.push_back(make_rigid(BoxShape{{1, 0.1, 1}}, 2.0, {0, 0.7, 0}, Vec3d::Zero(), rough));
  rig.run(1.0);
  EXPECT_NEAR(rig.rigid[3].position.y(), 0.7, 2e-3);
  EXPECT_NEAR((rig.rigid[3].orientation * Vec3d::UnitY()).y(), 1.0, 1e-4);
}

// a = g sin(slope) / (1 + I / (m r^2)).
TEST(CapsuleRolls, DownASlopeAsItsInertiaSays) {
  Rig<double> rig;
  const double slope = 0.2;
  rig.gravity_m_s2 = 9.81 * Vec3d(0.0, -std::cos(slope), std::sin(slope));
  rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), surface(0.0, 0.9)));
  rig.rigid.push_back(make_rigid(capsule_shape, 2.0, {0, 0.2, 0}, Vec3d::Zero(), surface(0.0, 0.9)));
  rig.rigid[0].orientation = Eigen::AngleAxisd(0.5 * M_PI, Vec3d::UnitZ());
  rig.run(1.0);
  const double inertia = principal_inertia_kg_m2(capsule_shape, 2.0).y();
  const double wanted_m_s = 9.81 * std::sin(slope) / (1.0 + inertia / (2.0 * 0.04));
  EXPECT_NEAR(rig.rigid[0].velocity.z(), wanted_m_s, 0.01 * wanted_m_s);
  EXPECT_NEAR(rig.rigid[0].angular_velocity.x(), wanted_m_s / 0.2, 0.01 * wanted_m_s / 0.2);
}

// Side to side, and crossed: equal masses exchange what they came with where they meet centre to centre.
TEST(CapsuleHits, AnotherAndTheyExchangeTheirVelocities) {
  for (const double angle : {0.0, 0.5, 0.5 * M_PI}) {
    Rig<double> rig;
    rig.rigid.push_back(make_rigid(capsule_shape, 2.0, {0, 0, 0}, {0, 0, 1.0}, surface(1.0, 0.0)));
    rig.rigid.push_back(make_rigid(capsule_shape, 2.0, {0, 0, 0.6}, {0, 0, -0.5}, surface(1.0, 0.0)));
    rig.rigid[1].orientation = Eigen::AngleAxisd(angle, Vec3d::UnitZ());
    rig.run(0.5);
    EXPECT_NEAR(rig.rigid[0].velocity.z(), -0.5, 1e-9) << angle;
    EXPECT_NEAR(rig.rigid[1].velocity.z(), 1.0, 1e-9) << angle;
  }
}

TEST(CapsuleHits, AnythingWithMomentumKept) {
  const std::array<Shape, 3> others{Shape{SphereShape{0.3}}, Shape{BoxShape{{0.3, 0.2, 0.4}}}, Shape{capsule_shape}};
  for (const Shape& other : others) {
    Rig<double> rig;
    rig.rigid.push_back(make_rigid(other, 3.0, {1.0, 0.1, 0.05}, {-4, 0, 0}, surface(0.4, 0.3)));
    rig.rigid.push_back(make_rigid(capsule_shape, 2.0, {0, 0, 0}, {3, 0, 0}, surface(0.4, 0.3)));
    rig.rigid[1].orientation = Eigen::AngleAxisd(0.7, Vec3d(0.2, 0.1, 1.0).normalized());
    rig.rigid[1].angular_velocity = {1.0, -2.0, 3.0};
    const Vec3d before = rig.momentum();
    rig.run(0.3);
    EXPECT_LT((rig.momentum() - before).norm(), 1e-12);
    EXPECT_LT(rig.rigid[0].velocity.x(), 4.0);
    EXPECT_GT((rig.rigid[0].velocity - Vec3d(-4, 0, 0)).norm(), 0.5) << other.index();
  }
}

class CapsuleOnBall : public testing::TestWithParam<Integrator> {};

// Thinner than the ball's edges are long: it is held by faces and edges, not by vertices alone.
TEST_P(CapsuleOnBall, DoesNotSinkIntoIt) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60.0, .integrator = GetParam()};
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5);
  ball.position = {0, 0.5, 0};
  ball.springs = {.stiffness_n_m = 1e4, .damping_n_s_m = 5.0};
  ball.gas = Gas{.moles = 1.0};
  ball.surface.friction = 0.8;
  scene.soft_bodies.push_back(ball);
  RigidBody rod;
  rod.name = "rod";
  rod.shape = CapsuleShape{.radius_m = 0.08, .half_height_m = 0.6};
  rod.mass_kg = 0.5;
  rod.position = {0, 1.09, 0};
  rod.orientation = Eigen::AngleAxisd(0.5 * M_PI, Vec3d::UnitZ());
  rod.locked = {{true, false, true}, {true, true, true}};
  scene.rigid_bodies.push_back(rod);
  scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = {}});
  auto world = World::create(std::move(scene));
  ASSERT_TRUE(world.ok());
  Workers workers(1);
  for (int tick = 0; tick < 240; ++tick) world->step_tick(workers);
  EXPECT_GT(world->rigid_bodies()[0].position.y(), 0.9);
  EXPECT_LT(world->rigid_bodies()[0].position.y(), 1.2);
}
INSTANTIATE_TEST_SUITE_P(Methods, CapsuleOnBall, testing::Values(Integrator::midpoint, Integrator::implicit_euler));

}  // namespace
}  // namespace pneuma::physics
