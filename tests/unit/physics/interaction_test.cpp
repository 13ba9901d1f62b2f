// Shows that impulses give the momentum asked for, at the place asked for and to what is free to move, and that grabs
// hold their vertex or patch, however many there are.
#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/mesh/picking.h"
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
  ASSERT_TRUE(world.add_grab(1, "a", std::uint32_t{0}, {3.0 * vertex, 20.0, 4.0}).ok());
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
      ASSERT_TRUE(world.add_grab(++id, "a", vertex, {place, 1e8, 1e8}).ok());
    }
    EXPECT_EQ(world.add_grab(++id, "a", std::uint32_t{0}, {target, 1e8, 1e8}).status().code(),
              base::StatusCode::limit_exceeded);
    run(world, 1200);
    ASSERT_FALSE(world.is_frozen(0)) << static_cast<int>(integrator);
    const std::vector<double> held = positions(world, 0);
    EXPECT_LT((Vec3d(held[0], held[1], held[2]) - target).norm(), 0.01);
  }
}

// Two worlds that differ in the patch alone.
TEST(Grab, APatchMovesWithTheHandWhereOneVertexMakesASpike) {
  // How far the vertex gets ahead of its neighbours, past where it was.
  const auto spike_m = [](double radius_m) {
    Scene scene;
    scene.soft_bodies = {ball("a")};
    World world = make(scene);
    const Vec3d vertex = scene.soft_bodies[0].mesh->positions_m[0];
    const Hold hold{.target = vertex, .stiffness_n_m = 400.0, .radius_m = radius_m};
    EXPECT_TRUE(world.add_grab(1, "a", std::uint32_t{0}, hold).ok());
    EXPECT_TRUE(world.move_grab(1, 2.0 * vertex).ok());
    const auto lead_m = [&] {
      const std::vector<double> at = positions(world, 0);
      const auto height = [&](std::uint32_t i) {
        return Vec3d(at[3 * i], at[3 * i + 1], at[3 * i + 2]).dot(vertex.normalized());
      };
      double highest_m = -std::numeric_limits<double>::infinity();
      for (const Edge& edge : scene.soft_bodies[0].mesh->edges) {
        if (edge[0] == 0) highest_m = std::max(highest_m, height(edge[1]));
      }
      return height(0) - highest_m;
    };
    const double before_m = lead_m();
    double most_m = 0.0;
    for (int tick = 0; tick < 30; ++tick) {
      run(world, 1);
      most_m = std::max(most_m, lead_m() - before_m);
    }
    return most_m;
  };
  EXPECT_LT(spike_m(0.5), 0.5 * spike_m(0.0));
}

// By one vertex alone a body turns as it is pulled aside.
TEST(Grab, APatchKeepsItsShapeAsTheHandMovesAndIsLetGoWhole) {
  constexpr std::uint32_t held = 7;
  const auto furthest_off_m = [&](double radius_m) {
    Scene scene;
    scene.soft_bodies = {ball("a")};
    World world = make(scene);
    const std::vector<Vec3d>& rest = scene.soft_bodies[0].mesh->positions_m;
    const Hold hold{.target = rest[held], .stiffness_n_m = 2e3, .radius_m = radius_m};
    EXPECT_TRUE(world.add_grab(1, "a", held, hold).ok());
    const Vec3d aside = rest[held].cross(Vec3d::UnitY()).normalized();
    const Vec3d hand = rest[held] + 2.0 * aside;
    EXPECT_TRUE(world.move_grab(1, Vec3d(7.0, 1.0, 1.0)).ok());
    EXPECT_TRUE(world.move_grab(1, hand).ok());
    run(world, 600);
    const std::vector<double> at = positions(world, 0);
    double most_m = 0.0;
    for (const auto& [i, share] : weights_along_skin(rest, scene.soft_bodies[0].mesh->edges, held, 0.4, 100)) {
      const Vec3d from_hand = Vec3d(at[3 * i], at[3 * i + 1], at[3 * i + 2]) - hand;
      most_m = std::max(most_m, (from_hand - (rest[i] - rest[held])).norm());
    }
    EXPECT_TRUE(world.release_grab(1).ok());
    EXPECT_FALSE(world.release_grab(1).ok());
    EXPECT_TRUE(world.apply_impulse("a", WholeBody{}, Vec3d(1.0, 0.0, 0.0)).ok());
    const Vec3d momentum = world.measure(0).momentum;
    run(world, 60);
    EXPECT_LT((world.measure(0).momentum - momentum).norm(), 1e-9);
    return most_m;
  };
  EXPECT_LT(furthest_off_m(0.5), 0.05);
  EXPECT_GT(furthest_off_m(0.0), 0.1);
}

TEST(Grab, APatchGoesThroughASnapshot) {
  Scene scene;
  scene.soft_bodies = {ball("a")};
  World world = make(scene);
  ASSERT_TRUE(world.add_grab(1, "a", std::uint32_t{0}, {.target = Vec3d(0, 2, 0), .radius_m = 0.5}).ok());
  run(world, 5);
  World again = make(scene);
  ASSERT_TRUE(again.restore(world.snapshot()).ok());
  for (World* each : {&world, &again}) {
    ASSERT_TRUE(each->move_grab(1, Vec3d(1, 2, 0)).ok());
    run(*each, 20);
  }
  EXPECT_EQ(again.state_hash(), world.state_hash());
}

TEST(Grab, APatchOfTooManyVerticesIsRefused) {
  Scene scene;
  scene.soft_bodies = {ball("a")};
  scene.soft_bodies[0].mesh = *make_icosphere(5, 1.0);
  World world = make(scene);
  const std::uint64_t hash = world.state_hash();
  const base::Status refused =
      world.add_grab(1, "a", std::uint32_t{0}, {.target = Vec3d(0, 2, 0), .radius_m = 3.0}).status();
  EXPECT_EQ(refused.code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(refused.where(), "radius_m");
  EXPECT_EQ(world.state_hash(), hash);
  EXPECT_TRUE(world.add_grab(1, "a", std::uint32_t{0}, {.target = Vec3d(0, 2, 0), .radius_m = 0.5}).ok());
}

}  // namespace
}  // namespace pneuma::physics
