// Shows that impulses give the momentum asked for, at the place asked for and to what is free to move, and that grabs
// hold their vertex, however many there are.
#include <gtest/gtest.h>

#include "base/limits.h"
#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

TEST(Impulse, GivesTheMomentumAskedForHoweverItIsAimed) {
  const Vec3d impulse(0.3, -0.2, 0.1);
  const std::vector<At> aims{WholeBody{}, std::uint32_t{4}, NearPoint{{0.0, 2.0, 0.0}, 0.3},
                             NearPoint{{0.0, 2.0, 0.0}, 0.0}, RayPoint{{-5.0, 1.0, 0.0}, Vec3d::UnitX(), 0.2}};
  for (const At& at : aims) {
    World world = make(lively_scene());
    const Vec3d before = world.measure(0).momentum;
    const auto hit = world.apply_impulse("a", at, impulse);
    ASSERT_TRUE(hit.ok()) << hit.status().message();
    EXPECT_EQ(hit->body, "a");
    EXPECT_TRUE((world.measure(0).momentum - before).isApprox(impulse, 1e-12));
  }
}

TEST(Impulse, MovesAWholeBodyAsOneAndAVertexByItsOwnMass) {
  Scene scene;
  scene.soft_bodies = {ball("a")};
  SoftBody& body = scene.soft_bodies[0];
  body.vertex_mass_scale.assign(42, 1.0);
  body.vertex_mass_scale[4] = 59.0;  // of 100
  World world = make(scene);
  ASSERT_TRUE(world.apply_impulse("a", WholeBody{}, {0.6, 0.0, 0.0}).ok());
  EXPECT_NEAR(world.measure(0).momentum.x(), 0.6, 1e-14);
  EXPECT_NEAR(world.measure(0).max_speed_m_s, 0.3, 1e-14);
  EXPECT_NEAR(world.measure(0).kinetic_j, 0.5 * 2.0 * 0.3 * 0.3, 1e-14);
  ASSERT_TRUE(world.apply_impulse("a", std::uint32_t{4}, {1.18, 0.0, 0.0}).ok());
  EXPECT_NEAR(world.measure(0).max_speed_m_s, 0.3 + 1.0, 1e-14);
}

TEST(Impulse, RayWithoutABodyHitsTheFirstOneOnItsWay) {
  World world = make(lively_scene());
  EXPECT_EQ(world.apply_impulse("", RayPoint{{-9.0, 2.0, 0.0}, Vec3d(2.0, 0.0, 0.0), 0.0}, Vec3d::UnitX())->body,
            "stone");
  EXPECT_EQ(world.apply_impulse("", RayPoint{{-9.0, 1.0, 0.0}, Vec3d(1.0, 0.0, 0.0), 0.0}, Vec3d::UnitX())->body, "a");
  EXPECT_EQ(
      world.apply_impulse("", RayPoint{{-9.0, 9.0, 0.0}, Vec3d(1.0, 0.0, 0.0), 0.0}, Vec3d::UnitX()).status().code(),
      base::StatusCode::not_found);
}

// The impulse acts at the surface, wherever the point lies: w = I^-1 (r x J), with r from the centre to the surface.
TEST(Impulse, NearARigidBallActsAtItsSurfaceBeTheAimInsideOrFar) {
  const Vec3d direction = Vec3d(1.0, 2.0, -2.0) / 3.0;
  const Vec3d impulse(0.5, -0.2, 0.3);
  const double radius_m = 0.3;
  const double inertia = 0.4 * 1.0 * radius_m * radius_m;
  for (const double distance_m : {0.01, radius_m, 5.0, 1000.0}) {
    World world = make(lively_scene());
    const Vec3d aim = world.rigid_bodies()[0].position + distance_m * direction;
    ASSERT_TRUE(world.apply_impulse("stone", NearPoint{aim, 0.0}, impulse).ok());
    const Vec3d turn = (radius_m * direction).cross(impulse) / inertia;
    EXPECT_TRUE(world.rigid_bodies()[0].velocity.isApprox(impulse, 1e-12));
    EXPECT_TRUE(world.rigid_bodies()[0].angular_velocity.isApprox(turn, 1e-9)) << distance_m;
  }
}

TEST(Impulse, NearARigidBoxActsAtItsSurfaceBeTheAimInsideOrFar) {
  const Vec3d half_m(0.3, 0.2, 0.1);
  const double mass_kg = 2.0;
  const Vec3d inertia =
      mass_kg / 3.0 *
      Vec3d(half_m.y() * half_m.y() + half_m.z() * half_m.z(), half_m.x() * half_m.x() + half_m.z() * half_m.z(),
            half_m.x() * half_m.x() + half_m.y() * half_m.y());
  const Vec3d impulse(0.5, -0.2, 0.3);
  // Aims in the box's own frame, and the points of its surface that are nearest: a corner, a side, and from inside the
  // side that is nearest.
  const std::vector<std::pair<Vec3d, Vec3d>> aims{{{9.0, 8.0, -7.0}, {0.3, 0.2, -0.1}},
                                                  {{0.1, 40.0, 0.05}, {0.1, 0.2, 0.05}},
                                                  {{0.25, 0.05, 0.02}, {0.3, 0.05, 0.02}}};
  for (const auto& [aim, surface] : aims) {
    Scene scene = lively_scene();
    RigidBody& box = scene.rigid_bodies[0];
    box.shape = BoxShape{half_m};
    box.mass_kg = mass_kg;
    box.orientation = Quatd(Eigen::AngleAxisd(0.7, Vec3d(1.0, -1.0, 0.5).normalized()));
    World world = make(scene);
    ASSERT_TRUE(world.apply_impulse("stone", NearPoint{box.position + box.orientation * aim, 0.0}, impulse).ok());
    const Vec3d torque = surface.cross(box.orientation.conjugate() * impulse);
    const Vec3d turn = box.orientation * torque.cwiseQuotient(inertia);
    EXPECT_TRUE(world.rigid_bodies()[0].velocity.isApprox(impulse / mass_kg, 1e-12));
    EXPECT_TRUE(world.rigid_bodies()[0].angular_velocity.isApprox(turn, 1e-9)) << aim.transpose();
  }
}

TEST(Impulse, PinnedVerticesLeaveTheirShareToTheFreeOnes) {
  const Vec3d impulse(0.3, -0.2, 0.1);
  const std::vector<At> aims{WholeBody{}, NearPoint{{0.0, 2.0, 0.0}, 0.6},
                             RayPoint{{-5.0, 1.3, 0.1}, Vec3d::UnitX(), 0.5}};
  for (const At& at : aims) {
    Scene scene = lively_scene();
    for (std::uint32_t vertex = 0; vertex < 42; vertex += 2) scene.soft_bodies[0].pins.push_back(vertex);
    World world = make(scene);
    const auto hit = world.apply_impulse("a", at, impulse);
    ASSERT_TRUE(hit.ok()) << hit.status().message();
    if (hit->vertex) {
      EXPECT_EQ(*hit->vertex % 2, 1U) << "the vertex named is one that moves";
    }
    EXPECT_TRUE(world.measure(0).momentum.isApprox(impulse, 1e-12));
  }
}

TEST(Impulse, WhereEveryVertexIsPinnedItIsRefusedAndChangesNothing) {
  Scene scene = lively_scene();
  for (std::uint32_t vertex = 0; vertex < 42; ++vertex) scene.soft_bodies[0].pins.push_back(vertex);
  scene.soft_bodies[1].pins = {4};
  World world = make(scene);
  const std::uint64_t hash = world.state_hash();
  const auto refused = [&](const std::string& body, const At& at) {
    const auto hit = world.apply_impulse(body, at, Vec3d::UnitX());
    ASSERT_FALSE(hit.ok());
    EXPECT_EQ(hit.status().code(), base::StatusCode::failed_precondition);
    EXPECT_EQ(hit.status().message(), "at: every vertex of \"" + body + "\" that it would push is pinned");
  };
  refused("a", WholeBody{});
  refused("a", NearPoint{{0.0, 2.0, 0.0}, 0.6});
  refused("a", RayPoint{{-5.0, 1.0, 0.0}, Vec3d::UnitX(), 0.2});
  refused("b", std::uint32_t{4});
  EXPECT_EQ(world.state_hash(), hash);
}

TEST(Impulse, BadAimsAreRefusedByName) {
  World world = make(lively_scene());
  EXPECT_EQ(world.apply_impulse("nobody", WholeBody{}, Vec3d::UnitX()).status().code(), base::StatusCode::not_found);
  EXPECT_EQ(world.apply_impulse("a", std::uint32_t{42}, Vec3d::UnitX()).status().where(), "vertex");
  EXPECT_EQ(world.apply_impulse("stone", std::uint32_t{0}, Vec3d::UnitX()).status().where(), "vertex");
  EXPECT_EQ(world.apply_impulse("", WholeBody{}, Vec3d::UnitX()).status().where(), "body");
}

TEST(Grab, PullsItsVertexToTheTargetAndLetsGo) {
  Scene scene;
  scene.soft_bodies = {ball("a")};
  World world = make(scene);
  // Along the line through the centre, so that the pull does not set the ball spinning.
  const Vec3d vertex = scene.soft_bodies[0].mesh->positions_m[0];
  ASSERT_TRUE(world.add_grab(1, "a", std::uint32_t{0}, 3.0 * vertex, 20.0, 4.0).ok());
  run(world, 1200);
  const std::vector<double> held = positions(world, 0);
  EXPECT_LT((Vec3d(held[0], held[1], held[2]) - 3.0 * vertex).norm(), 1e-3);
  ASSERT_TRUE(world.move_grab(1, 6.0 * vertex).ok());
  run(world, 1200);
  const std::vector<double> moved = positions(world, 0);
  EXPECT_LT((Vec3d(moved[0], moved[1], moved[2]) - 6.0 * vertex).norm(), 1e-3);
  ASSERT_TRUE(world.release_grab(1).ok());
  EXPECT_FALSE(world.release_grab(1).ok());
  EXPECT_FALSE(world.move_grab(1, vertex).ok());
  ASSERT_TRUE(world.apply_impulse("a", WholeBody{}, Vec3d(1.0, 0.0, 0.0)).ok());
  const Vec3d momentum = world.measure(0).momentum;
  run(world, 60);
  EXPECT_LT((world.measure(0).momentum - momentum).norm(), 1e-9);
}

// A few among them hold another vertex.
TEST(Grab, AsManyHandsOnOneVertexAsThereMayBeStillHoldIt) {
  for (const Integrator integrator :
       {Integrator::explicit_euler, Integrator::midpoint, Integrator::rk4, Integrator::symplectic_euler}) {
    Scene scene;
    scene.stepping = {.substeps = 8, .integrator = integrator};
    scene.soft_bodies = {ball("a")};
    scene.soft_bodies[0].springs.stiffness_n_m = 20.0;  // stable at this step by every method
    World world = make(scene);
    const Vec3d target = 3.0 * scene.soft_bodies[0].mesh->positions_m[0];
    std::uint64_t id = 0;
    for (std::size_t i = 0; i < base::body_grabs_max; ++i) {
      const std::uint32_t vertex = i % 16 == 1 ? 1 : 0;
      const Vec3d place = vertex == 1 ? target + 0.5 * scene.soft_bodies[0].mesh->positions_m[1] : target;
      ASSERT_TRUE(world.add_grab(++id, "a", vertex, place, 1e8, 1e8).ok());
    }
    EXPECT_EQ(world.add_grab(++id, "a", std::uint32_t{0}, target, 1e8, 1e8).status().code(),
              base::StatusCode::limit_exceeded);
    run(world, 1200);
    ASSERT_FALSE(world.is_frozen(0)) << static_cast<int>(integrator);
    const std::vector<double> held = positions(world, 0);
    EXPECT_LT((Vec3d(held[0], held[1], held[2]) - target).norm(), 0.01);
  }
}

}  // namespace
}  // namespace pneuma::physics
