// Shows that a collider that is a mesh is met by soft bodies through all of its features, with nothing across it, by
// every kind of method, also when it moves; that friction and restitution are those of other colliders; that rigid
// bodies rest on it and do not pass it; and that its candidates are what looking at all pairs finds.
#include "physics/contact/mesh_colliders.h"

#include <cmath>
#include <set>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"
#include "support/crossings.h"
#include "unit/physics/contact/contact_rig.h"

namespace pneuma::physics {
namespace {

std::shared_ptr<const Mesh> spike_mesh() {
  return *make_mesh({{-0.3, 0.0, -0.3}, {0.3, 0.0, -0.3}, {0.3, 0.0, 0.3}, {-0.3, 0.0, 0.3}, {0.0, 0.6, 0.0}},
                    {{0, 1, 2}, {0, 2, 3}, {0, 4, 1}, {1, 4, 2}, {2, 4, 3}, {3, 4, 0}});
}

Collider mesh_collider(const std::string& name, std::shared_ptr<const Mesh> mesh, const Surface& surface = {}) {
  Collider collider;
  collider.name = name;
  collider.shape = MeshShape{name, std::move(mesh)};
  collider.surface = surface;
  return collider;
}

SoftBody filled_ball(const Vec3d& position, double stiffness_n_m = 1e4) {
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5);
  ball.position = position;
  ball.springs = {.stiffness_n_m = stiffness_n_m, .damping_n_s_m = 1.0};
  ball.gas = Gas{.moles = 0.1};
  return ball;
}

World mesh_world(Scene scene) {
  auto world = World::create(std::move(scene));
  EXPECT_TRUE(world.ok()) << world.status().message();
  return std::move(*world);
}

std::vector<Vec3d> places_of(const World& world, std::size_t body) {
  std::vector<double> numbers(3 * world.soft_body(body).mesh->positions_m.size());
  world.copy_positions(body, numbers);
  std::vector<Vec3d> places;
  for (std::size_t i = 0; i < numbers.size(); i += 3) places.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  return places;
}

std::size_t crossings_with_colliders(const World& world) {
  std::size_t count = 0;
  const std::vector<Vec3d> soft = places_of(world, 0);
  for (const ColliderState& state : world.colliders()) {
    if (state.tree == nullptr) continue;
    const Frame frame(state.position, state.orientation);
    std::vector<Vec3d> fixed;
    for (const Vec3d& p : state.tree->mesh->positions_m) fixed.push_back(frame.to_world(p));
    count += support::count_crossings({soft, world.soft_body(0).mesh->faces}, {fixed, state.tree->mesh->faces});
  }
  return count;
}

struct MeshMeeting {
  Integrator integrator;
  Precision precision;
};

class SoftOnMesh : public testing::TestWithParam<MeshMeeting> {
 protected:
  [[nodiscard]] static Scene scene() {
    Scene scene;
    scene.gravity = {0, -9.81, 0};
    scene.stepping = {.rate_hz = 60.0, .integrator = GetParam().integrator, .precision = GetParam().precision};
    return scene;
  }
};

// Onto a spike that is sharper than the ball's edges are long, on a ground of four large faces.
TEST_P(SoftOnMesh, NothingCrossesASpikeOnAGround) {
  for (const double x : {0.0, 0.13}) {
    Scene spiked = scene();
    spiked.soft_bodies.push_back(filled_ball({x, 1.3, 0.05}));
    spiked.soft_bodies[0].velocity = {0, -6.0, 0};
    spiked.colliders = {mesh_collider("ground", *make_grid(1, 2, 60.0, 60.0)), mesh_collider("spike", spike_mesh())};
    spiked.colliders[1].position.y() = 0.02;
    World world = mesh_world(std::move(spiked));
    Workers workers(1);
    double lowest_m = 10.0;
    for (int tick = 0; tick < 150; ++tick) {
      world.step_tick(workers);
      ASSERT_EQ(crossings_with_colliders(world), 0U) << tick;
      ASSERT_FALSE(world.is_frozen(0)) << tick;
      for (const Vec3d& p : places_of(world, 0)) lowest_m = std::min(lowest_m, p.y());
    }
    EXPECT_GT(lowest_m, 0.0);
    EXPECT_LT(lowest_m, 0.1);  // it came down beside the spike, and no further
  }
}

// A box that comes from the side, faster than it is thick in a substep of the implicit methods, and turns.
TEST_P(SoftOnMesh, NothingCrossesAMeshThatMoves) {
  Scene hit = scene();
  hit.gravity.setZero();
  hit.soft_bodies.push_back(filled_ball({0.0, 0.1, 0.05}));
  Collider paddle = mesh_collider("paddle", *make_box({0.05, 0.8, 0.8}, 2));
  paddle.position = {-1.0, 0.0, 0.0};
  paddle.velocity = {10.0, 0.0, 0.0};
  paddle.angular_velocity = {0.0, 0.3, 0.5};
  hit.colliders = {paddle};
  World world = mesh_world(std::move(hit));
  Workers workers(1);
  for (int tick = 0; tick < 45; ++tick) {
    world.step_tick(workers);
    ASSERT_EQ(crossings_with_colliders(world), 0U) << tick;
    ASSERT_FALSE(world.is_frozen(0)) << tick;
  }
  EXPECT_GT(world.measure(0).momentum.x(), 9.0);  // of 1 kg
}

TEST_P(SoftOnMesh, ABallRestsOnItWhereItRestsOnAPlane) {
  std::array<double, 2> height_m{};
  for (const bool is_mesh : {false, true}) {
    Scene scene = SoftOnMesh::scene();
    scene.soft_bodies.push_back(filled_ball({0.01, 0.55, 0.02}));
    scene.soft_bodies[0].springs.damping_n_s_m = 10.0;
    Collider floor{.name = "floor", .shape = PlaneShape{}, .surface = {}};
    if (is_mesh) floor = mesh_collider("floor", *make_grid(7, 5, 6.0, 6.0));
    scene.colliders = {floor};
    World world = mesh_world(std::move(scene));
    Workers workers(1);
    for (int tick = 0; tick < 240; ++tick) world.step_tick(workers);
    for (const Vec3d& p : places_of(world, 0)) height_m[is_mesh ? 1 : 0] += p.y() / 162.0;
  }
  EXPECT_NEAR(height_m[1], height_m[0], 5e-3);  // the room that surfaces keep is 2 mm
}

// Half in a slab at first, it is out of it soon, not thrown, and lies on it.
TEST_P(SoftOnMesh, ABodyPutAcrossAClosedOneIsPushedOut) {
  Scene scene = SoftOnMesh::scene();
  scene.soft_bodies.push_back(filled_ball({0.02, 0.2, 0.01}));
  scene.soft_bodies[0].springs.damping_n_s_m = 10.0;
  scene.colliders = {mesh_collider("slab", *make_box({2.0, 0.4, 2.0}, 3), surface(0.0, 0.5))};
  scene.colliders[0].position.y() = -0.4;
  World world = mesh_world(std::move(scene));
  ASSERT_GT(crossings_with_colliders(world), 0U);
  Workers workers(1);
  double highest_m = 0.0;
  for (int tick = 0; tick < 180; ++tick) {
    world.step_tick(workers);
    double mean_m = 0.0;
    for (const Vec3d& p : places_of(world, 0)) mean_m += p.y() / 162.0;
    highest_m = std::max(highest_m, mean_m);
  }
  EXPECT_EQ(crossings_with_colliders(world), 0U);
  EXPECT_LT(highest_m, 1.2);
  for (const Vec3d& p : places_of(world, 0)) ASSERT_GT(p.y(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Methods, SoftOnMesh,
                         testing::Values(MeshMeeting{Integrator::midpoint, Precision::double_precision},
                                         MeshMeeting{Integrator::midpoint, Precision::single_precision},
                                         MeshMeeting{Integrator::xpbd, Precision::double_precision},
                                         MeshMeeting{Integrator::implicit_euler, Precision::double_precision},
                                         MeshMeeting{Integrator::implicit_euler, Precision::single_precision},
                                         MeshMeeting{Integrator::tr_bdf2, Precision::double_precision}));

// On a slope of gravity's own, it sticks if and only if the tangent is less than the friction.
TEST(FrictionOfMeshes, HoldsABallOnASlopeThatIsNotTooSteep) {
  for (const Integrator integrator : {Integrator::midpoint, Integrator::implicit_euler}) {
    for (const double tangent : {0.45, 0.55}) {
      Scene scene;
      scene.gravity = 9.81 * Vec3d(tangent, -1.0, 0.0).normalized();
      scene.stepping.integrator = integrator;
      // A slab of cloth without stiffness to bend, so that it does not roll.
      SoftBody slab = filled_ball({0, 0.13, 0});
      slab.mesh = *make_box({0.4, 0.1, 0.4}, 2);
      slab.gas.reset();
      slab.springs = {.stiffness_n_m = 2e4, .damping_n_s_m = 20.0};
      slab.surface.friction = 0.5;
      scene.soft_bodies.push_back(slab);
      scene.colliders = {mesh_collider("slope", *make_grid(3, 3, 20.0, 20.0), surface(0.0, 0.5))};
      World world = mesh_world(std::move(scene));
      Workers workers(1);
      for (int tick = 0; tick < 60; ++tick) world.step_tick(workers);
      const double start_m = places_of(world, 0)[0].x();
      for (int tick = 0; tick < 60; ++tick) world.step_tick(workers);
      const double moved_m = places_of(world, 0)[0].x() - start_m;
      if (tangent < 0.5) {
        EXPECT_LT(std::abs(moved_m), 0.02) << tangent;
      } else {
        EXPECT_GT(moved_m, 0.2) << tangent;
      }
    }
  }
}

// What comes back of a fall, as from a plane.
TEST(RestitutionOfMeshes, IsThatOfOtherColliders) {
  for (const Integrator integrator : {Integrator::midpoint, Integrator::implicit_euler}) {
    std::array<double, 2> height_m{};
    for (const bool is_mesh : {false, true}) {
      Scene scene;
      scene.gravity = {0, -9.81, 0};
      scene.stepping.integrator = integrator;
      scene.soft_bodies.push_back(filled_ball({0.01, 2.0, 0.02}, 1e5));
      Collider floor{.name = "floor", .shape = PlaneShape{}, .surface = surface(0.8, 0.0)};
      if (is_mesh) floor = mesh_collider("floor", *make_grid(4, 4, 6.0, 6.0), surface(0.8, 0.0));
      scene.colliders = {floor};
      World world = mesh_world(std::move(scene));
      Workers workers(1);
      for (int tick = 0; tick < 90; ++tick) {
        world.step_tick(workers);
        double mean_m = 0.0;
        for (const Vec3d& p : places_of(world, 0)) mean_m += p.y() / 162.0;
        if (tick > 45) height_m[is_mesh ? 1 : 0] = std::max(height_m[is_mesh ? 1 : 0], mean_m - 0.5);
      }
    }
    EXPECT_NEAR(height_m[1], height_m[0], 0.1 * height_m[0] + 0.03);
    EXPECT_GT(height_m[0], 0.9);
  }
}

TEST(RigidOnMesh, ShapesRestOnAGround) {
  const std::array<Shape, 3> shapes{Shape{SphereShape{0.2}}, Shape{BoxShape{{0.3, 0.2, 0.25}}},
                                    Shape{CapsuleShape{.radius_m = 0.2, .half_height_m = 0.4}}};
  for (const Shape& shape : shapes) {
    for (const std::uint32_t cells : {1U, 6U}) {
      Rig<double> rig;
      rig.gravity_m_s2 = earth_gravity;
      rig.colliders.push_back(
          make_collider(MeshShape{"ground", *make_grid(cells, cells, 4.0, 4.0)}, Vec3d::Zero(), surface(0.0, 0.5)));
      rig.rigid.push_back(make_rigid(shape, 2.0, {0.11, 0.5, 0.07}, Vec3d::Zero(), surface(0.0, 0.5)));
      if (std::holds_alternative<CapsuleShape>(shape)) {
        rig.rigid[0].orientation = Eigen::AngleAxisd(0.5 * M_PI, Vec3d::UnitZ());
      }
      rig.run(1.5);
      EXPECT_NEAR(rig.rigid[0].position.y(), 0.2, 5e-4) << shape.index() << " " << cells;
      EXPECT_LT(rig.rigid[0].velocity.norm(), 2e-3) << shape.index() << " " << cells;
    }
  }
}

// A box stands on the points of four spikes, and a ball on the edge of a thin wall falls to one side of it.
TEST(RigidOnMesh, EdgesAndPointsOfTheMeshHoldTheFacesOfABox) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  for (const double x : {-0.5, 0.5}) {
    for (const double z : {-0.5, 0.5}) {
      rig.colliders.push_back(make_collider(MeshShape{"spike", spike_mesh()}, {x, 0.0, z}, surface(0.0, 0.5)));
    }
  }
  rig.rigid.push_back(make_rigid(BoxShape{{1.0, 0.1, 1.0}}, 5.0, {0.02, 0.75, 0.01}, Vec3d::Zero(), surface(0.0, 0.5)));
  rig.run(1.5);
  EXPECT_NEAR(rig.rigid[0].position.y(), 0.7, 1e-3);
  EXPECT_NEAR((rig.rigid[0].orientation * Vec3d::UnitY()).y(), 1.0, 1e-4);
}

TEST(RigidOnMesh, NothingPassesAThinWallHoweverFast) {
  const std::array<Shape, 3> shapes{Shape{SphereShape{0.2}}, Shape{BoxShape{{0.3, 0.2, 0.25}}},
                                    Shape{CapsuleShape{.radius_m = 0.1, .half_height_m = 0.4}}};
  for (const Shape& shape : shapes) {
    for (const double speed_m_s : {10.0, 200.0, 1000.0}) {
      Rig<double> rig;
      rig.colliders.push_back(make_collider(MeshShape{"wall", *make_grid(5, 5, 30.0, 30.0)}));
      rig.rigid.push_back(make_rigid(shape, 2.0, {0.1, 2.0, 0.2}, speed_m_s * Vec3d(0.6, -0.8, 0.1)));
      rig.rigid[0].orientation = Eigen::AngleAxisd(0.6, Vec3d(0.3, 0.2, 1.0).normalized());
      for (int i = 0; i < 24 && std::abs(rig.rigid[0].position.x()) < 14.0; ++i) {
        rig.step();
        ASSERT_GT(rig.rigid[0].position.y(), 0.0) << shape.index() << " at " << speed_m_s;
      }
    }
  }
}

// As looking at all faces finds it, and on the right side of a sharp point.
TEST(MeshTreeNearest, IsThatOfAllFaces) {
  for (const auto& mesh : {*make_icosphere(2, 0.5), spike_mesh()}) {
    const auto tree = make_mesh_tree(mesh);
    for (int i = 0; i < 300; ++i) {
      const Vec3d p(0.6 * std::sin(1.3 * i), 0.3 + 0.6 * std::cos(0.7 * i), 0.6 * std::sin(2.1 * i + 1.0));
      const MeshPoint found = tree->nearest(p);
      const MeshPoint wanted = nearest_surface_point(mesh->positions_m, mesh->faces, p);
      EXPECT_NEAR(found.distance_m, wanted.distance_m, 1e-12);
      const auto& [a, b, c] = mesh->faces[found.face];
      const Vec3d& at = mesh->positions_m[a];
      const Vec3d outward = (mesh->positions_m[b] - at).cross(mesh->positions_m[c] - at);
      EXPECT_EQ(outward.dot(p - found.position_m) < 0.0, support::is_inside(p, {mesh->positions_m, mesh->faces})) << i;
    }
  }
}

// Of every two features, those whose boxes about their ways overlap, each once.
TEST(MeshCandidates, AreThoseOfAllPairs) {
  const std::shared_ptr<const Mesh> ground = *make_grid(6, 6, 3.0, 3.0);
  const std::shared_ptr<const Mesh> ball = *make_icosphere(1, 0.5);
  ColliderState state = make_collider(MeshShape{"ground", ground}, {0.2, 0.1, -0.1});
  state.orientation = Eigen::AngleAxisd(0.4, Vec3d(1.0, 0.2, 0.3).normalized());
  state.collider.velocity = {0.5, 1.0, 0.0};
  std::vector<MeshCollider> meshes;
  find_mesh_colliders(std::span(&state, 1), 0.1, meshes);
  ASSERT_EQ(meshes.size(), 1U);
  std::vector<SurfaceBody> bodies(2);
  load_surface(meshes[0], make_surface_topology(ground), bodies[1]);
  SurfaceBody& soft = bodies[0];
  soft.topology = make_surface_topology(ball);
  soft.margin_m = 0.03;
  soft.cuts.assign(ball->positions_m.size(), 1.0);
  for (const Vec3d& p : ball->positions_m) {
    soft.from.push_back(p + Vec3d(0.1, 0.6, 0.1));
    soft.to.push_back(soft.from.back() + Vec3d(0.1, -0.3, 0.05));
    for (const Vec3d& at : {soft.from.back(), soft.to.back()}) {
      soft.way.include(at - Vec3d::Constant(soft.margin_m));
      soft.way.include(at + Vec3d::Constant(soft.margin_m));
    }
  }
  SurfacePair pair{0, 1};
  MeshCandidateFinder().find(meshes[0], pair, bodies);
  using Named = std::tuple<FeaturePair, bool, std::uint32_t, std::uint32_t>;
  std::set<Named> found;
  for (const Candidate& c : pair.candidates) {
    EXPECT_TRUE(found.emplace(c.pair, c.swapped, c.first, c.second).second);
  }
  const auto box_of_way = [&](std::size_t body, std::initializer_list<std::uint32_t> vertices) {
    Box box;
    for (const std::uint32_t vertex : vertices) {
      for (const Vec3d& at : {bodies[body].from[vertex], bodies[body].to[vertex]}) {
        box.include(at - Vec3d::Constant(bodies[body].margin_m));
        box.include(at + Vec3d::Constant(bodies[body].margin_m));
      }
    }
    return box;
  };
  std::set<Named> wanted;
  const auto look_at_faces = [&](std::size_t a, const Mesh& mesh_a, std::size_t b, const Mesh& mesh_b, bool swapped) {
    for (std::uint32_t v = 0; v < mesh_a.positions_m.size(); ++v) {
      for (std::uint32_t f = 0; f < mesh_b.faces.size(); ++f) {
        const auto& [i, j, k] = mesh_b.faces[f];
        if (box_of_way(a, {v}).overlaps(box_of_way(b, {i, j, k})))
          wanted.emplace(FeaturePair::vertex_face, swapped, v, f);
      }
    }
  };
  look_at_faces(0, *ball, 1, *ground, false);
  look_at_faces(1, *ground, 0, *ball, true);
  for (std::uint32_t e = 0; e < ball->edges.size(); ++e) {
    for (std::uint32_t f = 0; f < ground->edges.size(); ++f) {
      const auto& [a, b] = ball->edges[e];
      const auto& [c, d] = ground->edges[f];
      if (box_of_way(0, {a, b}).overlaps(box_of_way(1, {c, d}))) wanted.emplace(FeaturePair::edge_edge, false, e, f);
    }
  }
  EXPECT_GT(wanted.size(), 50U);
  EXPECT_EQ(found, wanted);
}

}  // namespace
}  // namespace pneuma::physics
