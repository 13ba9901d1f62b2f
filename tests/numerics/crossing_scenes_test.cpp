// Shows that soft bodies that meet by their surfaces never run through each other or themselves, by an oracle that
// shares no arithmetic with contact (support/crossings.h): in a built-in scene, in seeded random scenes of any
// stiffness and method, in a heap, and of a skin that crumples. And that free bodies keep their momenta as they meet.
#include <random>

#include "numerics/worlds.h"
#include "scene_io/load.h"
#include "scene_io/mesh_library.h"
#include "scene_io/translate.h"
#include "support/crossings.h"
#include "support/environment.h"

namespace pneuma::physics {
namespace {

std::vector<Vec3d> places_of(const World& world, std::size_t body) {
  std::vector<Vec3d> places(world.soft_body(body).mesh->positions_m.size());
  std::vector<double> flat(3 * places.size());
  world.copy_positions(body, flat);
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = {flat[3 * i], flat[3 * i + 1], flat[3 * i + 2]};
  return places;
}

// Of bodies with each other, and of those with themselves that are not to.
std::size_t crossings_of(const World& world) {
  std::vector<std::vector<Vec3d>> places;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) places.push_back(places_of(world, i));
  const auto mesh_of = [&](std::size_t body) {
    return support::TriangleMesh{places[body], world.soft_body(body).mesh->faces};
  };
  std::size_t count = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (world.soft_body(i).collision.self) count += support::count_self_crossings(mesh_of(i));
    for (std::size_t j = i + 1; j < places.size(); ++j) count += support::count_crossings(mesh_of(i), mesh_of(j));
  }
  return count;
}

void expect_no_crossing(World& world, std::uint64_t ticks, std::uint64_t every, const std::string& what) {
  for (std::uint64_t tick = 0; tick < ticks; tick += every) {
    run_ticks(world, every);
    ASSERT_EQ(crossings_of(world), 0U) << what << " at tick " << tick + every;
    for (std::size_t i = 0; i < world.soft_body_count(); ++i)
      ASSERT_FALSE(world.is_frozen(i)) << what << ", body " << i;
  }
}

// PNEUMA_MINUTES makes it longer.
TEST(Crossings, AreNoneInFiveBallsOverAMinute) {
  const auto scene = scene_io::builtin_scene("five-balls");
  ASSERT_TRUE(scene.ok());
  const auto meshes = scene_io::MeshLibrary::build(*scene);
  ASSERT_TRUE(meshes.ok());
  World world = make_world(*scene_io::to_physics(*scene, *meshes));
  expect_no_crossing(world, 3'600 * support::number_from_environment("PNEUMA_MINUTES", 1), 20, "five-balls");
}

Collider a_room(double half_m) {
  Collider room;
  room.name = "room";
  room.shape = RoomShape{Vec3d::Constant(half_m)};
  return room;
}

// Two to six balls of any stiffness, or in every tenth scene up to twenty, thrown at each other in a room, by a random
// method.
Scene random_scene(std::uint32_t seed) {
  std::mt19937 random(seed);
  const auto between = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 8U) / static_cast<double>(1U << 24U);
  };
  constexpr std::array methods{Integrator::symplectic_euler, Integrator::midpoint, Integrator::implicit_euler,
                               Integrator::tr_bdf2, Integrator::automatic};
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping.integrator = methods[random() % methods.size()];
  scene.stepping.precision = random() % 2 == 0 ? Precision::single_precision : Precision::double_precision;
  const bool solved = !is_explicit(scene.stepping.integrator);
  if (solved && scene.stepping.integrator != Integrator::automatic)
    scene.stepping.substeps = 1 + static_cast<std::uint32_t>(random() % 3);
  const double stiffness_n_m = std::pow(10.0, between(2.0, solved ? 6.0 : 3.5));
  const bool many = seed % 10 == 9;
  const std::size_t count = 2 + random() % (many ? 19 : 5);
  const std::size_t a_row = many ? 3 : 2;
  const double middle = 0.5 * static_cast<double>(a_row - 1);
  const auto on_grid = [&](std::size_t k) { return static_cast<double>(k % a_row) - middle; };
  for (std::size_t i = 0; i < count; ++i) {
    const BreathingBall ball{.subdivisions = 1 + static_cast<std::uint32_t>(random() % 2),
                             .radius_m = 0.4,
                             .mass_kg = between(0.2, 2.0),
                             .stiffness_n_m = stiffness_n_m,
                             .damping_n_s_m = between(0.1, 1.0),
                             .nrt_j = between(20.0, 100.0)};
    SoftBody body = ball.body(1.0);
    body.name = "ball-" + std::to_string(i);
    body.position = Vec3d(on_grid(i), on_grid(i / a_row), on_grid(i / (a_row * a_row))) +
                    Vec3d(between(-0.04, 0.04), between(-0.04, 0.04), between(-0.04, 0.04));
    body.velocity = {between(-4.0, 4.0), between(-4.0, 4.0), between(-4.0, 4.0)};
    body.angular_velocity = {between(-3.0, 3.0), between(-3.0, 3.0), between(-3.0, 3.0)};
    body.surface = {.restitution = between(0.0, 1.0), .friction = between(0.0, 1.0)};
    scene.soft_bodies.push_back(body);
  }
  scene.colliders.push_back(a_room(middle + 0.6));
  return scene;
}

class RandomScenes : public testing::TestWithParam<std::uint32_t> {};

TEST_P(RandomScenes, HaveNoCrossings) {
  for (std::uint32_t i = 0; i < 10; ++i) {
    const std::uint32_t seed = 10 * GetParam() + i;
    World world = make_world(random_scene(seed));
    expect_no_crossing(world, 60, 3, "seed " + std::to_string(seed));
  }
}

// Implicit steps of these let surfaces through once. A wall stopped a vertex after the filter had looked, or a body
// that only passed by went on as if it had not been cut.
TEST(Crossings, AreNoneInRandomScenesThatHadSome) {
  for (const std::uint32_t seed : {243U, 469U, 472U, 509U, 752U, 830U, 1'096U, 1'419U, 1'489U, 1'609U, 1'989U}) {
    World world = make_world(random_scene(seed));
    expect_no_crossing(world, 60, 3, "seed " + std::to_string(seed));
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomScenes, testing::Range(0U, tens_of_scenes()));

TEST(Crossings, AreNoneInASkinThatCrumplesOnItself) {
  const BreathingBall ball{
      .subdivisions = 2, .mass_kg = 1.0, .stiffness_n_m = 300.0, .damping_n_s_m = 0.5, .nrt_j = 40.0};
  Scene scene = ball.scene(1.0, Integrator::symplectic_euler, 60.0, 0);
  scene.gravity = {0.0, -9.81, 0.0};
  scene.soft_bodies[0].position.y() = 0.6;
  scene.soft_bodies[0].collision.self = true;
  scene.soft_bodies[0].gas->leak_mol_s_pa = 1e-3;  // gone within a second
  scene.soft_bodies[0].surface.friction = 0.3;
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  scene.colliders.push_back(floor);
  World world = make_world(std::move(scene));
  expect_no_crossing(world, 300, 5, "crumple");
}

// So many rows are more than an implicit step solves with its own: it answers them by the vertices' masses.
Scene sheets_that_fall(Integrator integrator, std::uint32_t substeps) {
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping = {.substeps = substeps, .integrator = integrator};
  const auto mesh = *make_grid(30, 30, 2.0, 2.0);
  for (int i = 0; i < 2; ++i) {
    SoftBody sheet;
    sheet.name = "sheet-" + std::to_string(i);
    sheet.mesh = mesh;
    sheet.mass_kg = 1.0;
    sheet.springs = {.stiffness_n_m = 1e3, .damping_n_s_m = 1.0};
    sheet.position.y() = 0.02 * (i + 1);
    sheet.surface.friction = 0.5;
    scene.soft_bodies.push_back(sheet);
  }
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  scene.colliders.push_back(floor);
  return scene;
}

TEST(Crossings, AreNoneInSheetsThatFallOnEachOther) {
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2}) {
    World world = make_world(sheets_that_fall(integrator, 2));
    const double start_j = whole_energy_j(world);
    for (int i = 0; i < 2; ++i) {
      expect_no_crossing(world, 20, 10, std::string(name_of(integrator)));
      EXPECT_LE(whole_energy_j(world), 1.01 * start_j) << name_of(integrator);
    }
    for (std::size_t i = 0; i < 2; ++i) {
      const double above_m = world.measure(i).centre_of_mass.y();
      EXPECT_GE(above_m, 0.0) << name_of(integrator);
      EXPECT_LT(above_m, 0.015) << name_of(integrator);
    }
  }
}

// They gained half of what they fell with, where no step was taken back.
TEST(SheetsThatFall, GainNoEnergyByOneStepATick) {
  World world = make_world(sheets_that_fall(Integrator::tr_bdf2, 1));
  const double start_j = whole_energy_j(world);
  for (int tick = 0; tick < 60; ++tick) {
    run_ticks(world, 1);
    ASSERT_LE(whole_energy_j(world), 1.01 * start_j) << tick;
  }
}

TEST(Momenta, OfFreeBodiesThatMeetAreKept) {
  for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::implicit_euler}) {
    const BreathingBall ball{
        .subdivisions = 2, .mass_kg = 1.0, .stiffness_n_m = 1e3, .damping_n_s_m = 0.5, .nrt_j = 70.0};
    Scene scene = ball.scene(1.0, integrator, 60.0, integrator == Integrator::symplectic_euler ? 0 : 1);
    scene.soft_bodies.push_back(scene.soft_bodies[0]);
    scene.soft_bodies[0].velocity.x() = 3.0;
    scene.soft_bodies[1].name = "other";
    scene.soft_bodies[1].position = {1.5, 0.3, 0.1};
    for (SoftBody& body : scene.soft_bodies) body.surface.friction = 0.5;
    World world = make_world(std::move(scene));
    const auto momenta = [&world] {
      const BodyMeasures a = world.measure(0);
      const BodyMeasures b = world.measure(1);
      return std::pair<Vec3d, Vec3d>(a.momentum + b.momentum, a.angular_momentum + b.angular_momentum);
    };
    const auto [linear, angular] = momenta();
    run_ticks(world, 60);
    const auto [linear_after, angular_after] = momenta();
    EXPECT_LT(world.measure(0).momentum.x(), 2.5) << "they met";
    EXPECT_LT((linear_after - linear).norm(), 1e-11) << name_of(integrator);
    const double moving_kg_m2_s = 3.0;
    EXPECT_LT((angular_after - angular).norm(), 1e-3 * moving_kg_m2_s) << name_of(integrator);
  }
}

}  // namespace
}  // namespace pneuma::physics
