// Shows that a rigid convex mesh is a solid: a box made of triangles moves as a box does, others rest flat on each of
// their faces on every kind of ground and stack, hit everything with momentum kept, and hold on soft bodies.
#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "physics/rigid/rigid_box_box.h"
#include "physics/rigid/rigid_polyhedron.h"
#include "physics/world.h"
#include "support/eigen_solvers.h"
#include "unit/physics/contact/contact_rig.h"
#include "unit/physics/mesh/convex_meshes.h"

namespace pneuma::physics {
namespace {

const Vec3d mesh_box_half_m(0.3, 0.2, 0.4);
const ConvexShape mesh_box = convex(built(make_box(mesh_box_half_m, 1)));
const Surface rough_skin = surface(0.0, 0.6);

/// Turned so that the side looks down.
Quatd with_side_down(const Polyhedron::Side& side) {
  return support::turn_between(side.normal, -Vec3d::UnitY());
}

MeshShape flat_sheet() {
  return {"sheet", built(make_grid(7, 7, 6.0, 6.0))};
}

double turn_between_rad(const Quatd& a, const Quatd& b) {
  return 2.0 * (a.conjugate() * b).vec().norm();
}

/// A box of each kind, on a collider.
std::array<RigidState, 2> two_boxes_after(double seconds, const RigidState& start, const ColliderState& ground) {
  std::array<RigidState, 2> after;
  for (const bool is_mesh : {false, true}) {
    Rig<double> rig;
    rig.gravity_m_s2 = earth_gravity;
    rig.rigid.push_back(start);
    if (is_mesh) rig.rigid[0].body.shape = mesh_box;
    rig.colliders.push_back(ground);
    rig.run(seconds);
    after[is_mesh ? 1 : 0] = rig.rigid[0];
  }
  return after;
}

TEST(MeshBox, RestsAsABoxDoes) {
  const RigidState start = make_rigid(BoxShape{mesh_box_half_m}, 3.0, {0, 0.25, 0}, Vec3d::Zero(), rough_skin);
  for (const Shape& ground : {Shape(PlaneShape{}), Shape(BoxShape{{2, 1, 2}}), Shape(RoomShape{{2, 1, 2}})}) {
    const double top_m = std::holds_alternative<BoxShape>(ground)    ? 1.0
                         : std::holds_alternative<RoomShape>(ground) ? -1.0
                                                                     : 0.0;
    const auto [box, mesh] = two_boxes_after(2.0, start, make_collider(ground, {0, -top_m, 0}, rough_skin));
    EXPECT_NEAR(mesh.position.y(), 0.2, 1e-4) << ground.index();
    EXPECT_LT((mesh.position - box.position).norm(), 1e-6) << ground.index();
    EXPECT_LT(mesh.velocity.norm(), 1e-6) << ground.index();
  }
}

TEST(MeshBox, SlidesByTheSameFriction) {
  for (const double slope_rad : {0.1, 0.3, 0.5}) {
    for (const double share : {0.5, 0.98, 1.02}) {
      const Quatd tilt(Eigen::AngleAxisd(-slope_rad, Vec3d::UnitZ()));
      RigidState start = make_rigid(BoxShape{mesh_box_half_m}, 1.0, tilt * Vec3d(0, 0.2, 0));
      start.orientation = tilt;
      const auto slope =
          make_collider(PlaneShape{tilt * Vec3d::UnitY()}, Vec3d::Zero(), surface(0.0, share * std::tan(slope_rad)));
      const auto [box, mesh] = two_boxes_after(1.0, start, slope);
      const double way_m = (box.position - start.position).norm();
      EXPECT_NEAR((mesh.position - start.position).norm(), way_m, 1e-6 + 1e-3 * way_m) << slope_rad << ' ' << share;
      const double wanted_m = 0.5 * 9.81 * (std::sin(slope_rad) - share * std::tan(slope_rad) * std::cos(slope_rad));
      EXPECT_NEAR((mesh.position - start.position).norm(), std::max(0.0, wanted_m), 5e-3) << slope_rad << ' ' << share;
    }
  }
}

TEST(MeshBox, BouncesAlike) {
  for (const double restitution : {0.3, 0.7, 1.0}) {
    const RigidState start =
        make_rigid(BoxShape{mesh_box_half_m}, 1.0, {0, 1.2, 0}, Vec3d::Zero(), surface(restitution, 0.0));
    double highest_m[2] = {0.0, 0.0};
    for (const bool is_mesh : {false, true}) {
      Rig<double> rig;
      rig.gravity_m_s2 = earth_gravity;
      rig.rigid.push_back(start);
      if (is_mesh) rig.rigid[0].body.shape = mesh_box;
      rig.colliders.push_back(make_collider(PlaneShape{}));
      rig.run(std::sqrt(2.0 / 9.81) + 0.01);
      const double ended_s = std::sqrt(2.0 / 9.81) * (1.0 + restitution);
      for (int i = 0; i < ended_s / rig.dt_s; ++i) {
        rig.step();
        highest_m[is_mesh ? 1 : 0] = std::max(highest_m[is_mesh ? 1 : 0], rig.rigid[0].position.y() - 0.2);
      }
    }
    EXPECT_NEAR(highest_m[1], highest_m[0], 1e-6);
    EXPECT_NEAR(highest_m[1], restitution * restitution, 0.01);
  }
}

// Two ways to one answer: the 15 axes of two boxes, and the faces and pairs of edges of two polyhedra.
TEST(MeshBox, TouchesABoxWhereABoxDoes) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  int touching = 0;
  for (int i = 0; i < 3'000; ++i) {
    const auto frame = [&](double reach_m) {
      const Vec3d origin = reach_m * Vec3d{within(random), within(random), within(random)};
      return Frame(origin, Quatd{within(random), within(random), within(random), within(random)}.normalized());
    };
    const Vec3d other_half_m(0.2, 0.5, 0.3);
    const Frame a = frame(0.0);
    const Frame b = frame(0.8);
    const Manifold wanted = touch_boxes({mesh_box_half_m, a}, {other_half_m, b}, 0.05);
    std::vector<MeshTouch> touches;
    touch_polyhedra(polyhedron_pose(mesh_box, a), polyhedron_pose(BoxShape{other_half_m}, b), 0.05, touches);
    ASSERT_EQ(touches.size(), wanted.count) << i;
    if (touches.empty()) continue;
    ++touching;
    ASSERT_LT((touches[0].normal - wanted.normal).norm(), 1e-9) << i;
    for (const MeshTouch& touch : touches) {
      double nearest_m = 1.0;
      for (std::size_t k = 0; k < wanted.count; ++k) {
        nearest_m = std::min(nearest_m, (wanted.points[k].point - touch.point).norm() +
                                            std::abs(wanted.points[k].distance_m - touch.distance_m));
      }
      ASSERT_LT(nearest_m, 1e-9) << i;
    }
  }
  EXPECT_GT(touching, 300);
}

// The free motion of a body whose principal axes are not those of its mesh.
TEST(ConvexSpin, IsThatOfTheSameSolidHoweverItsMeshIsTurned) {
  const Quatd turn(Eigen::AngleAxisd(0.8, Vec3d(1, 2, -1).normalized()));
  RigidState box = make_rigid(BoxShape{mesh_box_half_m}, 2.0, Vec3d::Zero());
  RigidState mesh = make_rigid(convex(turned_and_shifted(*mesh_box.mesh, turn, {1, 2, 3})), 2.0, Vec3d::Zero());
  EXPECT_TRUE(mesh.principal_axes.has_value());
  EXPECT_TRUE(inverse_inertia_1_kg_m2(mesh).isApprox(
      turn.toRotationMatrix() * inverse_inertia_1_kg_m2(box) * turn.toRotationMatrix().transpose(), 1e-12));
  mesh.orientation = turn.conjugate();
  box.angular_velocity = mesh.angular_velocity = Vec3d(3, -5, 4);
  std::array<RigidState, 1> boxes{box};
  std::array<RigidState, 1> meshes{mesh};
  for (int i = 0; i < 480; ++i) {
    move_solids(boxes, {}, rig_dt_s);
    move_solids(meshes, {}, rig_dt_s);
  }
  EXPECT_LT((boxes[0].angular_velocity - meshes[0].angular_velocity).norm(), 1e-9);
  EXPECT_LT(turn_between_rad(boxes[0].orientation, meshes[0].orientation * turn), 1e-9);
}

struct ConvexGround {
  Shape shape;
  Vec3d position;
};

class ConvexRests : public testing::TestWithParam<ConvexGround> {};

// Flat on each face, at the height of its plane, upright for a second.
TEST_P(ConvexRests, FlatOnEachOfItsFaces) {
  for (const MeshPtr& mesh : {tetrahedron(0.6), octahedron(0.5), mesh_box.mesh}) {
    const ConvexShape shape = convex(mesh);
    for (const Polyhedron::Side& side : shape.solid->sides) {
      Rig<double> rig;
      rig.gravity_m_s2 = earth_gravity;
      rig.rigid.push_back(make_rigid(shape, 2.0, {0.1, side.level_m + 0.01, 0.07}, Vec3d::Zero(), rough_skin));
      rig.rigid[0].orientation = with_side_down(side);
      rig.colliders.push_back(make_collider(GetParam().shape, GetParam().position, rough_skin));
      rig.run(1.0);
      const RigidState& body = rig.rigid[0];
      EXPECT_NEAR(body.position.y(), side.level_m, 1e-4);
      EXPECT_LT((body.orientation * side.normal + Vec3d::UnitY()).norm(), 1e-4);
      EXPECT_LT(body.velocity.norm() + body.angular_velocity.norm(), 1e-5);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Grounds, ConvexRests,
                         testing::Values(ConvexGround{PlaneShape{}, Vec3d::Zero()},
                                         ConvexGround{BoxShape{{2, 1, 2}}, {0, -1, 0}},
                                         ConvexGround{RoomShape{{1, 1, 1}}, {0, 1, 0}},
                                         ConvexGround{flat_sheet(), Vec3d::Zero()}));

TEST(ConvexRests, OnRoundColliders) {
  const ConvexShape plate = convex(built(make_box({0.3, 0.1, 0.3}, 1)));
  for (const Shape& shape :
       {Shape(SphereShape{0.5}), Shape(EllipsoidShape{{1, 0.5, 1}}), Shape(CapsuleShape{0.25, 0.25})}) {
    Rig<double> rig;
    rig.gravity_m_s2 = earth_gravity;
    rig.rigid.push_back(make_rigid(plate, 1.0, {0, 0.65, 0}));
    rig.colliders.push_back(make_collider(shape, Vec3d::Zero(), surface(0.0, 0.8)));
    rig.run(1.0);
    EXPECT_NEAR(rig.rigid[0].position.y(), 0.6, 2e-3) << shape.index();
  }
}

// Across a lying capsule: a line holds it, not a point.
TEST(ConvexRests, AcrossALyingCapsule) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.rigid.push_back(make_rigid(convex(built(make_box({0.3, 0.1, 0.3}, 1))), 1.0, {0, 0.62, 0}));
  rig.colliders.push_back(make_collider(CapsuleShape{0.5, 1.0}, Vec3d::Zero(), surface(0.0, 0.8)));
  rig.colliders[0].orientation = Eigen::AngleAxisd(0.5 * M_PI, Vec3d::UnitZ());
  rig.run(2.0);
  EXPECT_NEAR(rig.rigid[0].position.y(), 0.6, 1e-3);
  EXPECT_LT(turn_between_rad(rig.rigid[0].orientation, Quatd::Identity()), 0.02);
}

// Face on face, on a plane: two octahedra, and each shape on another.
TEST(ConvexStack, Stands) {
  const std::array<Shape, 3> above{Shape(convex(octahedron(0.5))), Shape(convex(built(make_box({0.2, 0.2, 0.2}, 1)))),
                                   Shape(BoxShape{{0.2, 0.2, 0.2}})};
  const ConvexShape under = convex(octahedron(0.8));
  const Polyhedron::Side& side = under.solid->sides[0];
  for (const Shape& shape : above) {
    Rig<double> rig;
    rig.gravity_m_s2 = earth_gravity;
    rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), rough_skin));
    rig.rigid.push_back(make_rigid(under, 2.0, {0, side.level_m, 0}, Vec3d::Zero(), rough_skin));
    rig.rigid[0].orientation = with_side_down(side);
    double height_m = 0.2;
    Quatd turn = Quatd::Identity();
    if (above[0] == shape) {
      height_m = convex(octahedron(0.5)).solid->sides[0].level_m;
      turn = with_side_down(side);
    }
    const double wanted_m = 2.0 * side.level_m + height_m;
    rig.rigid.push_back(make_rigid(shape, 1.0, {0, wanted_m + 0.01, 0}, Vec3d::Zero(), rough_skin));
    rig.rigid[1].orientation = turn;
    rig.run(3.0);
    EXPECT_NEAR(rig.rigid[1].position.y(), wanted_m, 1e-3) << shape.index();
    EXPECT_LT((rig.rigid[1].position - Vec3d(0, rig.rigid[1].position.y(), 0)).norm(), 2e-3) << shape.index();
    EXPECT_LT(turn_between_rad(rig.rigid[1].orientation, turn), 2e-3) << shape.index();
    EXPECT_LT(rig.rigid[1].velocity.norm(), 1e-4) << shape.index();
  }
}

/// Points with a ball about each, whose convex hull is the body.
struct RoundedHull {
  std::vector<Vec3d> points;
  double radius_m = 0.0;

  [[nodiscard]] double reach_m(const Vec3d& way) const {
    double furthest_m = -std::numeric_limits<double>::infinity();
    for (const Vec3d& point : points) furthest_m = std::max(furthest_m, point.dot(way));
    return furthest_m + radius_m;
  }
};

RoundedHull hull_of(const RigidState& body) {
  RoundedHull hull;
  const Shape& shape = body.body.shape;
  if (const auto* ball = std::get_if<SphereShape>(&shape)) hull = {std::vector<Vec3d>{Vec3d::Zero()}, ball->radius_m};
  if (const auto* rod = std::get_if<CapsuleShape>(&shape)) {
    hull = {std::vector<Vec3d>{{0, rod->half_height_m, 0}, {0, -rod->half_height_m, 0}}, rod->radius_m};
  }
  if (const auto* box = std::get_if<BoxShape>(&shape)) {
    hull.points = built(make_box(box->half_extents_m, 1))->positions_m;
  }
  if (const auto* solid = std::get_if<ConvexShape>(&shape)) hull.points = solid->mesh->positions_m;
  EXPECT_FALSE(hull.points.empty());
  for (Vec3d& point : hull.points) point = body.position + body.orientation * point;
  return hull;
}

/// How far one must at least move to be clear of the other, found among the directions of a sphere's vertices.
double overlap_m(const RoundedHull& a, const RoundedHull& b) {
  static const MeshPtr sphere = built(make_icosphere(3, 1.0));
  double least_m = std::numeric_limits<double>::infinity();
  for (const Vec3d& way : sphere->positions_m) least_m = std::min(least_m, a.reach_m(way) + b.reach_m(-way));
  return least_m;
}

// Momentum goes from one to the other. At 10 m/s none enters the other by more than it moves in four steps.
TEST(ConvexHits, AnythingWithMomentumKeptAndEntersNothing) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  const std::array<Shape, 5> others{Shape{SphereShape{0.3}}, Shape{BoxShape{{0.3, 0.2, 0.4}}},
                                    Shape{CapsuleShape{0.2, 0.3}}, Shape{convex(tetrahedron(0.8))},
                                    Shape{convex(built(make_icosphere(1, 0.3)))}};
  for (const Shape& other : others) {
    for (const bool is_first : {false, true}) {
      for (int i = 0; i < 40; ++i) {
        Rig<double> rig;
        rig.rigid.push_back(make_rigid(convex(octahedron(0.5)), 2.0, {-1.2, 0, 0}, {6, 0, 0}, surface(0.4, 0.3)));
        rig.rigid.push_back(
            make_rigid(other, 3.0, {0, 0.1 * within(random), 0.1 * within(random)}, {-4, 0, 0}, surface(0.4, 0.3)));
        for (RigidState& body : rig.rigid) {
          body.orientation = Quatd{within(random), within(random), within(random), within(random)}.normalized();
          body.angular_velocity = 5.0 * Vec3d{within(random), within(random), within(random)};
        }
        if (is_first) std::swap(rig.rigid[0], rig.rigid[1]);
        const Vec3d before = rig.momentum();
        for (int look = 0; look < 48; ++look) {
          for (int step = 0; step < 4; ++step) rig.step();
          ASSERT_LT(overlap_m(hull_of(rig.rigid[0]), hull_of(rig.rigid[1])), 0.08) << other.index() << ' ' << i;
        }
        ASSERT_LT(overlap_m(hull_of(rig.rigid[0]), hull_of(rig.rigid[1])), 1e-3) << other.index() << ' ' << i;
        ASSERT_LT((rig.momentum() - before).norm(), 1e-12) << other.index() << ' ' << i;
        const RigidState& mine = rig.rigid[is_first ? 1 : 0];
        ASSERT_GT((mine.velocity - Vec3d(6, 0, 0)).norm(), 1.0) << other.index() << ' ' << i;
      }
    }
  }
}

TEST(ConvexHits, AThinWallAndDoesNotPassIt) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  const ConvexShape slab = convex(turned_and_shifted(
      *built(make_box({0.005, 1, 1}, 1)), Quatd(Eigen::AngleAxisd(0.7, Vec3d(1, 1, 1).normalized())), Vec3d::Ones()));
  for (const Shape& shape : {Shape(slab), Shape(convex(tetrahedron(0.5)))}) {
    for (const Shape& wall : {Shape(BoxShape{{0.005, 2000, 2000}}), Shape(PlaneShape{-Vec3d::UnitX()})}) {
      for (const double speed_m_s : {10.0, 1'000.0}) {
        for (int i = 0; i < 20; ++i) {
          Rig<double> rig;
          rig.rigid.push_back(make_rigid(shape, 1.0, {-3, 0, 0}, {speed_m_s, 0, 0}, surface(0.5, 0.5)));
          rig.rigid[0].orientation = Quatd{within(random), within(random), within(random), within(random)}.normalized();
          rig.rigid[0].angular_velocity = 30.0 * Vec3d{within(random), within(random), within(random)};
          rig.colliders.push_back(make_collider(wall));
          for (int step = 0; step < 20 + static_cast<int>(6.0 / speed_m_s * 480.0); ++step) {
            rig.step();
            ASSERT_LT(rig.rigid[0].position.x(), 0.0) << speed_m_s << " m/s, " << i;
          }
        }
      }
    }
  }
}

Scene stone_on_ball(Integrator integrator, const Shape& shape, const Quatd& orientation, double height_m) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60.0, .integrator = integrator};
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5);
  ball.position = {0, 0.5, 0};
  ball.springs = {.stiffness_n_m = 1e4, .damping_n_s_m = 5.0};
  ball.gas = Gas{.moles = 1.0};
  ball.surface.friction = 0.8;
  scene.soft_bodies.push_back(ball);
  RigidBody stone;
  stone.name = "stone";
  stone.shape = shape;
  stone.mass_kg = 0.5;
  stone.position = {0, 1.02 + height_m, 0};
  stone.orientation = orientation;
  stone.locked = {{true, false, true}, {true, true, true}};
  scene.rigid_bodies.push_back(stone);
  scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = {}});
  return scene;
}

World world_after(Scene scene, int ticks) {
  auto world = World::create(std::move(scene));
  EXPECT_TRUE(world.ok()) << world.status().message();
  Workers workers(1);
  for (int tick = 0; tick < ticks; ++tick) world->step_tick(workers);
  return std::move(*world);
}

class ConvexOnBall : public testing::TestWithParam<Integrator> {};

TEST_P(ConvexOnBall, DoesNotSinkIntoIt) {
  for (const MeshPtr& mesh : {tetrahedron(0.6), octahedron(0.5)}) {
    const ConvexShape shape = convex(mesh);
    const Polyhedron::Side& side = shape.solid->sides[0];
    Scene scene = stone_on_ball(GetParam(), shape, with_side_down(side), side.level_m);
    SoftBody& ball = scene.soft_bodies[0];
    const auto lowest = std::ranges::min_element(ball.mesh->positions_m, {}, [](const Vec3d& x) { return x.y(); });
    ball.pins = {static_cast<std::uint32_t>(lowest - ball.mesh->positions_m.begin())};  // or it would roll away
    const World world = world_after(std::move(scene), 480);
    const double bottom_m = world.rigid_bodies()[0].position.y() - side.level_m;
    EXPECT_GT(bottom_m, 0.85);
    EXPECT_LT(bottom_m, 1.1);
  }
}

// On its edge, and on its corner, held upright.
TEST_P(ConvexOnBall, IsHeldByItsEdgeAndItsCorner) {
  const ConvexShape shape = convex(octahedron(0.5));
  const std::array<Vec3d, 2> down{Vec3d(1, 1, 0).normalized(), Vec3d::UnitX()};
  for (const Vec3d& lowest : down) {
    double height_m = 0.0;
    for (const Vec3d& corner : shape.solid->corners_m) height_m = std::max(height_m, lowest.dot(corner));
    const Quatd turn = support::turn_between(lowest, -Vec3d::UnitY());
    const World world = world_after(stone_on_ball(GetParam(), shape, turn, height_m), 240);
    EXPECT_GT(world.rigid_bodies()[0].position.y(), 0.75) << lowest.transpose();
  }
}

TEST_P(ConvexOnBall, StandsAsABoxDoes) {
  const World box = world_after(stone_on_ball(GetParam(), BoxShape{mesh_box_half_m}, Quatd::Identity(), 0.2), 240);
  const World mesh = world_after(stone_on_ball(GetParam(), mesh_box, Quatd::Identity(), 0.2), 240);
  EXPECT_NEAR(mesh.rigid_bodies()[0].position.y(), box.rigid_bodies()[0].position.y(), 2e-3);
}
INSTANTIATE_TEST_SUITE_P(Methods, ConvexOnBall,
                         testing::Values(Integrator::midpoint, Integrator::symplectic_euler, Integrator::implicit_euler,
                                         Integrator::xpbd));

Scene heap_of_stones() {
  Scene scene = stone_on_ball(Integrator::midpoint, convex(octahedron(0.5)), Quatd::Identity(), 0.4);
  scene.rigid_bodies[0].locked = {};
  RigidBody wedge = scene.rigid_bodies[0];
  wedge.name = "wedge";
  wedge.shape = convex(turned_and_shifted(*tetrahedron(0.5), Quatd(Eigen::AngleAxisd(0.4, Vec3d::UnitX())), {1, 2, 3}));
  wedge.position = {0.9, 1.0, 0.1};
  scene.rigid_bodies.push_back(wedge);
  return scene;
}

TEST(ConvexWorld, GoesOnFromASnapshotToTheSameHash) {
  World world = world_after(heap_of_stones(), 60);
  World other = world_after(heap_of_stones(), 3);
  ASSERT_TRUE(other.restore(world.snapshot()).ok());
  Workers workers(2);
  for (int tick = 0; tick < 60; ++tick) {
    world.step_tick(workers);
    other.step_tick(workers);
  }
  EXPECT_EQ(other.state_hash(), world.state_hash());
}

TEST(ConvexWorld, FallsAsleepAndWakesWhenHit) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60.0, .substeps = 4, .integrator = Integrator::midpoint};
  const ConvexShape shape = convex(octahedron(0.5));
  const Polyhedron::Side& side = shape.solid->sides[2];
  scene.rigid_bodies.push_back({.name = "stone",
                                .shape = shape,
                                .position = {0, side.level_m + 0.02, 0},
                                .orientation = with_side_down(side),
                                .surface = rough_skin});
  scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = rough_skin});
  World world = world_after(std::move(scene), 180);
  EXPECT_FALSE(world.rigid_bodies()[0].is_awake());
  // From above onto the face that looks up: the ray ends on it.
  const auto hit = world.apply_impulse("", RayPoint{{0, 5, 0}, -Vec3d::UnitY(), 0.0}, Vec3d(0.2, -0.1, 0));
  ASSERT_TRUE(hit.ok()) << hit.status().message();
  EXPECT_EQ(hit->body, "stone");
  EXPECT_TRUE(world.rigid_bodies()[0].is_awake());
  // About the axis across: the impulse acts at the upper face, twice the inradius over the lower one.
  const double inertia = 0.25 / 10.0;
  EXPECT_NEAR(world.rigid_bodies()[0].angular_velocity.z(), -side.level_m * 0.2 / inertia, 1e-3);
}

// A pendulum of a solid about a point of its own frame: the period of small swings is 2 pi sqrt(I / (m g d)).
TEST(ConvexJoint, SwingsAboutAPointOfItsOwnFrame) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 240.0, .substeps = 4, .integrator = Integrator::midpoint, .sleep = false};
  const double length_m = 0.5;
  const double edge_m = 0.6;
  const ConvexShape shape = convex(turned_and_shifted(*tetrahedron(edge_m), Quatd::Identity(), {5, 6, 7}));
  const double angle = 0.02;
  scene.rigid_bodies.push_back({.name = "bob",
                                .shape = shape,
                                .mass_kg = 2.0,
                                .position = {length_m * std::sin(angle), -length_m * std::cos(angle), 0},
                                .orientation = Quatd(Eigen::AngleAxisd(angle, Vec3d::UnitZ())),
                                .surface = {}});
  Joint joint;
  joint.name = "pivot";
  joint.first = {.of = Anchor::Of::rigid, .body = "bob", .point_m = Vec3d(0, length_m, 0)};
  joint.kind = HingeJoint{Vec3d::UnitZ()};
  scene.joints.push_back(joint);
  World world = world_after(std::move(scene), 0);
  Workers workers(1);
  std::vector<double> crossings_s;
  double before = 1.0;
  for (int tick = 0; tick < 240 * 6; ++tick) {
    world.step_tick(workers);
    const double x = world.rigid_bodies()[0].position.x();
    if (before < 0.0 && x >= 0.0) crossings_s.push_back((tick + 1 - x / (x - before)) / 240.0);
    before = x;
  }
  ASSERT_GE(crossings_s.size(), 3U);
  const double inertia = edge_m * edge_m / 20.0 + length_m * length_m;
  const double wanted_s = 2.0 * M_PI * std::sqrt(inertia / (9.81 * length_m));
  const double period_s = (crossings_s.back() - crossings_s.front()) / static_cast<double>(crossings_s.size() - 1);
  EXPECT_NEAR(period_s, wanted_s, 2e-3 * wanted_s);
}

}  // namespace
}  // namespace pneuma::physics
