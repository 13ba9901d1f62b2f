// Shows that a world's state is a function of its scene and its steps alone: the same hash on every run, with any
// number of workers, and across a snapshot; that bodies elsewhere change nothing of it; and that a body that runs away
// is stopped without touching the others.
#include <algorithm>

#include "numerics/worlds.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

/// Balls that fall on each other in a turning room, and a rigid ball among them.
Scene crowded(Precision precision) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {
      .rate_hz = 60, .substeps = 8, .precision = precision, .on_unstable = OnUnstable::allow};  // some run away
  const auto mesh = *make_icosphere(2, 0.5);
  for (int i = 0; i < 4; ++i) {
    SoftBody ball;
    ball.name = "ball-" + std::to_string(i);
    ball.mesh = mesh;
    ball.position = {0.4 * i - 0.6, 1.1 * i - 1.4, 0.1 * i};
    ball.springs = {200.0, 0.5, 1.0};
    ball.gas = Gas{.moles = 0.02};
    ball.surface.friction = 0.3;
    scene.soft_bodies.push_back(ball);
  }
  RigidBody stone;
  stone.name = "stone";
  stone.shape = SphereShape{0.3};
  stone.position = {1.2, 1.5, 0.0};
  scene.rigid_bodies.push_back(stone);
  Collider room;
  room.name = "room";
  room.shape = RoomShape{{2.5, 2.5, 2.5}};
  room.angular_velocity = {0, 0, 0.7};
  room.surface = {0.4, 0.4, 0.0};
  scene.colliders.push_back(room);
  return scene;
}

/// Heavy boxes on soft balls on a floor, 10 m from each other. Each box falls faster than the one before, so that no
/// two balls need the same from a solver.
Scene boxes_on_balls(int count, Precision precision) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60, .substeps = 32, .precision = precision};
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  floor.surface = {0.4, 0.4, 0.0};
  scene.colliders.push_back(floor);
  const auto mesh = *make_icosphere(2, 0.5);
  for (int i = 0; i < count; ++i) {
    SoftBody ball;
    ball.name = "ball-" + std::to_string(i);
    ball.mesh = mesh;
    ball.position = {10.0 * i, 0.6, 0.0};
    ball.springs = {2'000.0, 0.5, 1.0};
    ball.gas = Gas{.moles = 0.1};
    ball.surface.friction = 0.3;
    scene.soft_bodies.push_back(ball);
    RigidBody box;
    box.name = "box-" + std::to_string(i);
    box.shape = BoxShape{Vec3d::Constant(0.6)};
    box.mass_kg = 20.0;
    box.position = {10.0 * i + 0.1, 1.9, 0.0};
    box.velocity = {0.0, -2.0 * i, 0.0};
    box.surface.friction = 0.3;
    scene.rigid_bodies.push_back(box);
  }
  return scene;
}

class Reproducible : public testing::TestWithParam<Precision> {};

TEST_P(Reproducible, TheSameHashOnEveryRunAndAnyNumberOfWorkers) {
  const auto hash_of = [](std::size_t threads) {
    World world = make_world(crowded(GetParam()));
    run_ticks(world, 120, threads);
    return world.state_hash();
  };
  const std::uint64_t hash = hash_of(1);
  EXPECT_EQ(hash_of(1), hash);
  EXPECT_EQ(hash_of(2), hash);
  EXPECT_EQ(hash_of(5), hash);
}

// The first ball and its box alone on one thread, and beside others on three. No two soft bodies are near each other,
// so all spans are whole ticks.
TEST_P(Reproducible, StacksElsewhereChangeNoBitOfABodysContactsWithSolids) {
  World alone = make_world(boxes_on_balls(1, GetParam()));
  const auto height_m = [&] {
    const auto [low, high] = std::ranges::minmax(positions_of(alone, 0), {}, [](const Vec3d& x) { return x.y(); });
    return high.y() - low.y();
  };
  const double whole_m = height_m();
  double least_m = whole_m;
  World together = make_world(boxes_on_balls(6, GetParam()));
  for (int tick = 0; tick < 120; ++tick) {
    run_ticks(alone, 1);
    run_ticks(together, 1, 3);
    least_m = std::min(least_m, height_m());
    ASSERT_TRUE(positions_of(alone, 0) == positions_of(together, 0)) << tick;
    ASSERT_TRUE(alone.rigid_bodies()[0].position == together.rigid_bodies()[0].position) << tick;
  }
  EXPECT_LT(least_m, 0.7 * whole_m) << "the box is to press the ball";
}

TEST_P(Reproducible, SampledVolumesAreTheSameOnEveryRunAndAnyNumberOfWorkers) {
  const auto hash_of = [](const Volume& volume, std::size_t threads) {
    Scene scene = crowded(GetParam());
    for (SoftBody& body : scene.soft_bodies) body.volume = volume;
    World world = make_world(std::move(scene));
    run_ticks(world, 20, threads);
    return world.state_hash();
  };
  for (const Volume volume : {Volume{VolumeMethod::subdivided, 8}, Volume{VolumeMethod::monte_carlo, 500}}) {
    const std::uint64_t hash = hash_of(volume, 1);
    EXPECT_EQ(hash_of(volume, 1), hash);
    EXPECT_EQ(hash_of(volume, 2), hash);
    EXPECT_EQ(hash_of(volume, 5), hash);
  }
}

TEST_P(Reproducible, TheHashMovesWithTheState) {
  World world = make_world(crowded(GetParam()));
  run_ticks(world, 5);
  const std::uint64_t before = world.state_hash();
  run_ticks(world, 1);
  EXPECT_NE(world.state_hash(), before);
}

TEST_P(Reproducible, ASnapshotGoesOnToTheSameHash) {
  World world = make_world(crowded(GetParam()));
  run_ticks(world, 50);
  const Scene scene = world.scene();
  const std::string snapshot = world.snapshot();
  const std::uint64_t hash_then = world.state_hash();
  run_ticks(world, 70);

  World other = make_world(scene);
  ASSERT_TRUE(other.restore(snapshot).ok());
  EXPECT_EQ(other.tick(), 50U);
  EXPECT_EQ(other.state_hash(), hash_then);
  run_ticks(other, 70);
  EXPECT_EQ(other.state_hash(), world.state_hash());
}

TEST_P(Reproducible, ABadSnapshotIsRefusedAndChangesNothing) {
  World world = make_world(crowded(GetParam()));
  run_ticks(world, 3);
  const std::uint64_t hash = world.state_hash();
  std::string snapshot = world.snapshot();
  EXPECT_FALSE(world.restore("").ok());
  EXPECT_FALSE(world.restore(snapshot.substr(0, snapshot.size() - 1)).ok());
  EXPECT_FALSE(world.restore(snapshot + "x").ok());
  EXPECT_EQ(world.state_hash(), hash);
}

/// Far too stiff for its step.
SoftBody runaway() {
  SoftBody body;
  body.name = "runaway";
  body.mesh = *make_icosphere(1, 0.5);
  body.mass_kg = 1e-6;
  body.springs.stiffness_n_m = 1e9;
  body.gas = Gas{.moles = 1.0};
  return body;
}

TEST(Runaway, IsFrozenAndReportedOnce) {
  Scene scene;
  scene.stepping = {.rate_hz = 60, .substeps = 1, .on_unstable = OnUnstable::allow};
  scene.soft_bodies.push_back(runaway());
  World world = make_world(std::move(scene));
  run_ticks(world, 20);
  EXPECT_TRUE(world.is_frozen(0));
  const std::vector<FrozenBody> frozen = world.take_frozen();
  ASSERT_EQ(frozen.size(), 1U);
  EXPECT_EQ(frozen[0].name, "runaway");
  EXPECT_FALSE(frozen[0].reason.empty());
  EXPECT_TRUE(world.take_frozen().empty());
  for (const Vec3d& x : positions_of(world)) EXPECT_TRUE(x.allFinite());
  EXPECT_EQ(world.measure(0).max_speed_m_s, 0.0);
}

TEST(Runaway, LeavesASceneThatCanStillBeEdited) {
  for (const GasLaw law : {GasLaw::isothermal, GasLaw::adiabatic}) {
    Scene scene;
    scene.stepping = {.rate_hz = 60, .substeps = 1, .on_unstable = OnUnstable::allow};
    scene.soft_bodies.push_back(runaway());
    scene.soft_bodies[0].gas->law = law;
    scene.soft_bodies[0].gas->leak_mol_s_pa = 1e-6;
    World world = make_world(std::move(scene));
    run_ticks(world, 20);
    ASSERT_TRUE(world.is_frozen(0));
    Scene edited = world.scene();
    edited.gravity = {0, -1, 0};
    EXPECT_EQ(world.apply(edited).message(), "");
    edited.soft_bodies.clear();
    EXPECT_EQ(world.apply(edited).message(), "");
    run_ticks(world, 1);
  }
}

TEST(Runaway, LeavesADistantBodyAsItWouldBeAlone) {
  Scene scene = crowded(Precision::double_precision);
  scene.colliders.clear();  // its walls would reach for a body outside
  World without = make_world(scene);
  scene.soft_bodies.push_back(runaway());
  scene.soft_bodies.back().position = {1e5, 0, 0};  // it may be 200 m wide when it is stopped
  World with = make_world(scene);
  run_ticks(with, 60);
  run_ticks(without, 60);
  EXPECT_TRUE(with.is_frozen(4));
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(positions_of(with, i) == positions_of(without, i));
}

TEST_P(Reproducible, ARunawayDoesNotInfectWhatItTouches) {
  for (const double mass_kg : {1e-6, 1e-3, 1.0}) {  // explodes at once, within a few steps
    Scene scene = crowded(GetParam());
    SoftBody body = runaway();
    body.mass_kg = mass_kg;
    body.position = scene.soft_bodies[1].position + Vec3d(0.5, 0.0, 0.0);
    scene.soft_bodies.push_back(body);
    World world = make_world(std::move(scene));
    run_ticks(world, 300);
    EXPECT_TRUE(world.is_frozen(4));
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_FALSE(world.is_frozen(i));
      EXPECT_LT(world.measure(i).centre_of_mass.norm(), 4.5);
      EXPECT_GT(world.measure(i).volume_m3, 0.2);
    }
    EXPECT_TRUE(world.rigid_bodies()[0].position.allFinite());
  }
}

INSTANTIATE_TEST_SUITE_P(Precisions, Reproducible,
                         testing::Values(Precision::single_precision, Precision::double_precision),
                         [](const auto& param) {
                           return param.param == Precision::single_precision ? "Single" : "Double";
                         });

}  // namespace
}  // namespace pneuma::physics
