// Shows what a world promises to whoever hosts it: edits keep what they do not name, a snapshot restores every bit, and
// a body that runs away is stopped alone.
#include "physics/world.h"

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

TEST(World, CountsTicksAndTime) {
  World world = make(lively_scene());
  run(world, 30);
  EXPECT_EQ(world.tick(), 30U);
  EXPECT_DOUBLE_EQ(world.time_s(), 0.5);
  Scene faster = world.scene();
  faster.stepping.rate_hz = 120.0;
  ASSERT_TRUE(world.apply(faster).ok());
  run(world, 30);
  EXPECT_DOUBLE_EQ(world.time_s(), 0.75);
}

TEST(World, SnapshotInTheMiddleGoesOnWithTheSameBits) {
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    Scene scene = lively_scene();
    scene.stepping.precision = precision;
    World world = make(scene);
    run(world, 40);
    ASSERT_TRUE(world.add_grab(7, "a", std::uint32_t{3}, {Vec3d(0.0, 2.0, 0.0), 50.0, 0.0}).ok());
    run(world, 5);
    const std::string snapshot = world.snapshot();
    World other = make(world.scene());
    ASSERT_TRUE(other.restore(snapshot).ok());
    EXPECT_EQ(other.state_hash(), world.state_hash());
    run(world, 60);
    run(other, 60);
    EXPECT_EQ(other.state_hash(), world.state_hash());
    EXPECT_EQ(other.time_s(), world.time_s());
  }
}

// Sixteen balls go abreast; two of them leave the fleet.
TEST(World, SnapshotOfBurstBodiesAmongTheirLikeGoesOnWithTheSameBits) {
  Scene scene;
  const auto mesh = *make_icosphere(2, 0.5);
  for (int i = 0; i < 16; ++i) {
    SoftBody& body = scene.soft_bodies.emplace_back();
    body.name = std::string("ball-").append(std::to_string(i));
    body.mesh = mesh;
    body.position = {2.0 * i, 0.0, 0.0};
    body.springs = {.stiffness_n_m = 100.0, .damping_n_s_m = 0.1};
    body.gas = Gas{.moles = 0.01};
    if (i == 0 || i == 3) body.gas->burst_pressure_pa = 1.0;
    body.collision.soft = SoftCollision::none;
  }
  const Scene start = scene;
  World world = make(scene);
  run(world, 5);
  ASSERT_EQ(world.take_gas_events().size(), 2U);
  World other = make(start);  // its plan knows of no burst
  ASSERT_TRUE(other.restore(world.snapshot()).ok());
  run(world, 10);
  run(other, 10);
  EXPECT_EQ(other.state_hash(), world.state_hash());
}

// A load on a soft ball, by an implicit method: its contact begins from the impulses of the step before.
Scene loaded_scene() {
  Scene scene;
  scene.stepping = {.substeps = 1, .integrator = Integrator::implicit_euler, .sleep = false};
  scene.gravity = {0.0, -9.81, 0.0};
  SoftBody& ball = scene.soft_bodies.emplace_back();
  ball.name = "ball";
  ball.mesh = *make_icosphere(1, 0.5);
  ball.position.y() = 0.5;
  ball.springs = {.stiffness_n_m = 1e4, .damping_n_s_m = 10.0};
  ball.gas = Gas{.moles = 1.0};
  ball.surface.friction = 0.5;
  RigidBody& load = scene.rigid_bodies.emplace_back();
  load.name = "load";
  load.shape = BoxShape{{0.6, 0.2, 0.6}};
  load.mass_kg = 100.0;
  load.position.y() = 1.2;
  load.locked = {{true, false, true}, {true, true, true}};
  scene.colliders.push_back({.name = "floor", .shape = PlaneShape{}, .surface = ball.surface});
  return scene;
}

TEST(World, SnapshotOfALoadGoesOnWithTheSameBits) {
  World world = make(loaded_scene());
  run(world, 30);
  const std::string snapshot = world.snapshot();
  World other = make(world.scene());
  const std::size_t without = other.snapshot().size();
  EXPECT_GT(snapshot.size(), without) << "what contact holds is part of it";
  ASSERT_TRUE(other.restore(snapshot).ok());
  World copy = world.copy();
  for (World* each : {&world, &other, &copy}) run(*each, 30);
  EXPECT_EQ(other.state_hash(), world.state_hash());
  EXPECT_EQ(copy.state_hash(), world.state_hash());
  EXPECT_FALSE(other.restore(std::string_view(snapshot).substr(0, snapshot.size() - 8)).ok());
}

// Its last part is a count, and of each row its key (16 bytes) and its impulse.
TEST(World, SnapshotOfALoadWhoseImpulsesAreDamagedIsRefused) {
  constexpr std::size_t row_bytes = 16 + 3 * sizeof(double);
  World world = make(loaded_scene());
  run(world, 30);
  const std::string snapshot = world.snapshot();
  const std::size_t bare = make(world.scene()).snapshot().size();
  const std::size_t count_at = bare + 8;  // after that of joints
  ASSERT_EQ((snapshot.size() - count_at - 8) % row_bytes, 0U);
  ASSERT_GE(snapshot.size(), count_at + 8 + 2 * row_bytes);
  const auto expect_refused = [&](std::size_t at, const std::string& bytes) {
    std::string damaged = snapshot;
    damaged.replace(at, bytes.size(), bytes);
    EXPECT_FALSE(world.restore(damaged).ok()) << at;
  };
  expect_refused(count_at + 7, "\x10");                                         // 2^60 rows
  expect_refused(snapshot.size() - 8, std::string("\0\0\0\0\0\0\xf8\x7f", 8));  // not a number
  expect_refused(count_at + 8, std::string(8, '\xff'));                         // a key past the next
  EXPECT_TRUE(world.restore(snapshot).ok());
}

TEST(WorldApply, ABodyThatBeginsAnewHasNoImpulsesOfBefore) {
  World world = make(loaded_scene());
  run(world, 30);
  ASSERT_TRUE(world.apply(loaded_scene(), {"ball", "load"}).ok());
  World fresh = make(loaded_scene());
  EXPECT_EQ(world.snapshot().size(), fresh.snapshot().size());
}

TEST(World, SnapshotOfALoadFromBeforeItHeldImpulsesIsRead) {
  World world = make(loaded_scene());
  run(world, 30);
  World fresh = make(world.scene());
  const std::string bare = fresh.snapshot();
  ASSERT_TRUE(world.restore(bare).ok());
  EXPECT_EQ(world.state_hash(), fresh.state_hash());
}

TEST(WorldApply, TheSameSceneChangesNoBitOfALoad) {
  World world = make(loaded_scene());
  run(world, 30);
  const std::uint64_t hash = world.state_hash();
  ASSERT_TRUE(world.apply(world.scene()).ok());
  EXPECT_EQ(world.state_hash(), hash);
}

TEST(World, TheHashIsFnv1aOverTheSnapshot) {
  World world = make(lively_scene());
  run(world, 7);
  std::uint64_t hash = 0xcbf29ce484222325U;
  for (const char byte : world.snapshot()) hash = (hash ^ static_cast<unsigned char>(byte)) * 0x100000001b3U;
  EXPECT_EQ(world.state_hash(), hash);
}

TEST(World, DamagedSnapshotIsRefusedAndChangesNothing) {
  World world = make(lively_scene());
  run(world, 3);
  const std::string snapshot = world.snapshot();
  const std::uint64_t hash = world.state_hash();
  for (std::size_t length = 0; length < snapshot.size(); length += 97) {
    EXPECT_FALSE(world.restore(std::string_view(snapshot).substr(0, length)).ok());
  }
  EXPECT_FALSE(world.restore(snapshot + "x").ok());
  EXPECT_EQ(world.state_hash(), hash);
}

// A grab is its id (8 bytes), its vertex (4) and five numbers; grabs lie by vertex.
TEST(World, SnapshotWhoseGrabsLieOutOfOrderIsRefused) {
  constexpr std::size_t grab_bytes = 8 + 4 + 5 * 8;
  const std::uint64_t first_id = 0x1122334455667788;
  World world = make(lively_scene());
  ASSERT_TRUE(world.add_grab(first_id + 1, "a", std::uint32_t{5}, {Vec3d::Zero(), 50.0, 1.0}).ok());
  ASSERT_TRUE(world.add_grab(first_id, "a", std::uint32_t{3}, {Vec3d::Zero(), 50.0, 1.0}).ok());
  std::string snapshot = world.snapshot();
  ASSERT_TRUE(world.restore(snapshot).ok());
  const std::size_t first = snapshot.find(std::string("\x88\x77\x66\x55\x44\x33\x22\x11"));
  ASSERT_NE(first, std::string::npos);
  const auto grab = snapshot.begin() + static_cast<std::ptrdiff_t>(first);
  std::rotate(grab, grab + grab_bytes, grab + 2 * grab_bytes);
  EXPECT_FALSE(world.restore(snapshot).ok());
}

TEST(WorldApply, TheSameSceneChangesNoBit) {
  World world = make(lively_scene());
  run(world, 20);
  const std::uint64_t hash = world.state_hash();
  ASSERT_TRUE(world.apply(world.scene()).ok());
  EXPECT_EQ(world.state_hash(), hash);
}

TEST(WorldApply, AddingAndRemovingBodiesLeavesTheOthersAlone) {
  World world = make(lively_scene());
  run(world, 20);
  const std::vector<double> before = positions(world, 1);
  Scene edited = world.scene();
  edited.soft_bodies.erase(edited.soft_bodies.begin());
  edited.soft_bodies.push_back(ball("c", {0.0, -2.0, 0.0}));
  ASSERT_TRUE(world.apply(edited).ok());
  EXPECT_EQ(world.soft_body_count(), 2U);
  EXPECT_EQ(world.soft_body(0).name, "b");
  EXPECT_EQ(positions(world, 0), before);
}

TEST(WorldApply, NewGasAmountCountsAndUntouchedOneFlowsOn) {
  Scene scene = lively_scene();
  scene.soft_bodies[0].gas->flow_mol_s = 0.01;
  World world = make(scene);
  run(world, 60);
  const double pumped = world.measure(0).moles;
  EXPECT_NEAR(pumped, 0.02, 1e-9);
  Scene edited = world.scene();
  edited.gravity = Vec3d::Zero();
  ASSERT_TRUE(world.apply(edited).ok());
  EXPECT_EQ(world.measure(0).moles, pumped);
  edited.soft_bodies[0].gas->moles = 0.005;
  ASSERT_TRUE(world.apply(edited).ok());
  EXPECT_EQ(world.measure(0).moles, 0.005);
}

TEST(WorldApply, SolidsGoOnWhereTheyAreOrWhereTheyAreSet) {
  World world = make(lively_scene());
  run(world, 20);
  const Vec3d fallen = world.rigid_bodies()[0].position;
  Scene edited = world.scene();
  EXPECT_EQ(edited.rigid_bodies[0].position, fallen);
  edited.rigid_bodies[0].mass_kg = 2.0;
  ASSERT_TRUE(world.apply(edited).ok());
  EXPECT_EQ(world.rigid_bodies()[0].position, fallen);
  // Back to where the scene first put it, and stopped.
  edited.rigid_bodies[0].position = lively_scene().rigid_bodies[0].position;
  edited.rigid_bodies[0].velocity.setZero();
  ASSERT_TRUE(world.apply(edited).ok());
  EXPECT_EQ(world.rigid_bodies()[0].position, lively_scene().rigid_bodies[0].position);
  EXPECT_TRUE(world.rigid_bodies()[0].velocity.isZero());
}

TEST(WorldApply, WhatIsRenewedBeginsAnewAndTheRestGoesOn) {
  World world = make(lively_scene());
  run(world, 20);
  ASSERT_TRUE(world.add_grab(1, "a", std::uint32_t{3}, {Vec3d(0.0, 2.0, 0.0), 50.0, 0.0}).ok());
  const std::vector<double> other = positions(world, 1);
  ASSERT_TRUE(world.apply(world.scene(), {"a"}).ok());
  EXPECT_EQ(positions(world, 0), positions(make(lively_scene()), 0));
  EXPECT_TRUE(world.measure(0).momentum.isZero());
  EXPECT_FALSE(world.release_grab(1).ok());
  EXPECT_EQ(positions(world, 1), other);
}

TEST(WorldApply, AFrozenBodyStaysSoUntilItIsRenewed) {
  World world = make(lively_scene());
  // Past the limit of speed.
  ASSERT_TRUE(world.apply_impulse("a", WholeBody{}, Vec3d(1e6, 0.0, 0.0)).ok());
  ASSERT_TRUE(world.apply_impulse("stone", WholeBody{}, Vec3d(1e6, 0.0, 0.0)).ok());
  run(world, 1);
  ASSERT_EQ(world.take_frozen().size(), 2U);
  ASSERT_TRUE(world.apply(world.scene()).ok());
  EXPECT_TRUE(world.is_frozen(0));
  EXPECT_TRUE(world.rigid_bodies()[0].frozen);

  ASSERT_TRUE(world.apply(world.scene(), {"a", "stone"}).ok());
  EXPECT_FALSE(world.is_frozen(0));
  EXPECT_FALSE(world.rigid_bodies()[0].frozen);
  const double stone_m = world.rigid_bodies()[0].position.y();
  const double ball_m = world.measure(0).centre_of_mass.y();
  run(world, 2);
  EXPECT_LT(world.rigid_bodies()[0].position.y(), stone_m);
  EXPECT_LT(world.measure(0).centre_of_mass.y(), ball_m);
  EXPECT_TRUE(world.take_frozen().empty());
}

TEST(WorldApply, BadSceneIsRefusedAndChangesNothing) {
  World world = make(lively_scene());
  run(world, 5);
  const std::uint64_t hash = world.state_hash();
  Scene edited = world.scene();
  edited.soft_bodies[1].mass_kg = -1.0;
  EXPECT_EQ(world.apply(edited).where(), "soft_bodies[1].mass_kg");
  edited = world.scene();
  edited.stepping.precision = Precision::single_precision;
  EXPECT_EQ(world.apply(edited).where(), "stepping.precision");
  EXPECT_EQ(world.state_hash(), hash);
}

TEST(Runaway, BodyIsFrozenWhereItWasWellAndTheOthersGoOn) {
  Scene scene;
  scene.stepping.integrator = Integrator::explicit_euler;
  scene.stepping.substeps = 1;
  scene.stepping.on_unstable = OnUnstable::allow;
  scene.soft_bodies = {ball("stiff"), ball("soft", {5.0, 0.0, 0.0})};
  scene.soft_bodies[0].springs.stiffness_n_m = 1e9;
  scene.soft_bodies[0].collision.soft = SoftCollision::none;
  scene.soft_bodies[1].velocity = Vec3d(1.0, 0.0, 0.0);
  scene.soft_bodies[1].springs.stiffness_n_m = 1.0;
  scene.soft_bodies[1].collision.soft = SoftCollision::none;
  World world = make(scene);
  run(world, 60);
  const auto frozen = world.take_frozen();
  ASSERT_EQ(frozen.size(), 1U);
  EXPECT_EQ(frozen[0].name, "stiff");
  EXPECT_TRUE(world.is_frozen(0));
  EXPECT_FALSE(world.is_frozen(1));
  for (const double x : positions(world, 0)) EXPECT_TRUE(std::isfinite(x));
  EXPECT_NEAR(world.measure(1).centre_of_mass.x(), 6.0, 1e-9);
  EXPECT_TRUE(world.take_frozen().empty());
}

std::string frozen_reason(Scene scene, const Vec3d& impulse_n_s = Vec3d::Zero()) {
  scene.stepping.substeps = 1;
  World world = make(std::move(scene));
  const std::string name = world.rigid_bodies().empty() ? world.soft_body(0).name : world.rigid_bodies()[0].body.name;
  EXPECT_TRUE(world.apply_impulse(name, WholeBody{}, impulse_n_s).ok());
  run(world, 60);
  const auto frozen = world.take_frozen();
  return frozen.size() == 1 ? frozen[0].reason : "none";
}

TEST(Runaway, ReasonIsTheOneThatHeld) {
  const std::string torn = "it was torn apart: a particle moved past its own body in one step";
  const std::string fast = "it went past the limit of speed";
  const std::string far = "it went past the limit of place";
  const auto calm = [](const Vec3d& position) {
    SoftBody body = ball("a", position);
    body.springs = {.stiffness_n_m = 1.0};
    body.gas.reset();
    return body;
  };
  Scene scene;
  scene.stepping.on_unstable = OnUnstable::allow;
  scene.soft_bodies = {calm(Vec3d::Zero())};
  EXPECT_EQ(frozen_reason(scene), "none");
  EXPECT_EQ(frozen_reason(scene, Vec3d(1e6, 0, 0)), fast);
  scene.soft_bodies = {ball("a")};
  scene.soft_bodies[0].springs.stiffness_n_m = 1e9;
  EXPECT_EQ(frozen_reason(scene), torn);

  scene.soft_bodies = {calm({1e7 - 100.0, 0, 0})};
  EXPECT_EQ(frozen_reason(scene, Vec3d(1000.0, 0, 0)), far);
  // So dense a gas in so light a skin that a stage of the step is past what the precision holds.
  scene.soft_bodies = {ball("a")};
  scene.soft_bodies[0].mass_kg = 1e-6;
  scene.soft_bodies[0].gas->moles = 1e10;
  scene.stepping.precision = Precision::single_precision;
  scene.stepping.integrator = Integrator::rk4;
  EXPECT_EQ(frozen_reason(scene), "its motion was no longer finite");

  scene.soft_bodies.clear();
  scene.rigid_bodies = lively_scene().rigid_bodies;
  EXPECT_EQ(frozen_reason(scene, Vec3d(1e6, 0, 0)), fast);
  scene.rigid_bodies[0].position.x() = 1e7 - 100.0;
  EXPECT_EQ(frozen_reason(scene, Vec3d(1000.0, 0, 0)), far);
}

// Each of three bodies has more vertices than half a part, so that one thread takes two of them, then one.
// Balls with a stone on each, on one mesh that all of them touch: groups that several threads answer at once.
TEST(World, GroupsOfContactsHaveTheSameBitsOnAnyNumberOfThreads) {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.stepping.integrator = Integrator::midpoint;
  scene.stepping.substeps = 8;
  Collider& floor = scene.colliders.emplace_back();
  floor.name = "floor";
  floor.shape = MeshShape{.name = "ground", .mesh = *make_grid(4, 4, 12.0, 12.0)};
  for (int i = 0; i < 4; ++i) {
    SoftBody& ball = scene.soft_bodies.emplace_back();
    ball.name = "ball-" + std::to_string(i);
    ball.mesh = *make_icosphere(3, 0.5);
    ball.position = {2.0 * i - 3.0, 0.55, 0.0};
    ball.springs = {.stiffness_n_m = 50.0, .damping_n_s_m = 0.05};
    RigidBody& stone = scene.rigid_bodies.emplace_back();
    stone.name = "stone-" + std::to_string(i);
    stone.shape = SphereShape{0.4};
    stone.position = ball.position + Vec3d(0.0, 0.95, 0.0);
    stone.velocity = {0.0, -1.0 - i, 0.0};
  }
  const auto run = [&](std::size_t threads) {
    World world = make(scene);
    world.note_contacts(true);
    Workers workers(threads);
    for (int tick = 0; tick < 30; ++tick) world.step_tick(workers);
    return world;
  };
  const World by_one = run(1);
  EXPECT_GT(by_one.row_counts().rows, 30U * 8U * 300U) << "fewer are not worth a second thread";
  EXPECT_GE(by_one.touches().size(), 8U);
  for (const std::size_t threads : {2U, 5U}) {
    const World by_some = run(threads);
    EXPECT_EQ(by_some.state_hash(), by_one.state_hash()) << threads;
    EXPECT_EQ(by_some.touches().size(), by_one.touches().size()) << threads;
    EXPECT_EQ(by_some.row_counts().rows, by_one.row_counts().rows) << threads;
  }
}

TEST(World, ASubstepOfManySolvedVerticesGoesInPartsWithTheSameBits) {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.stepping.integrator = Integrator::xpbd;
  scene.stepping.substeps = 1;
  const auto mesh = *make_grid(70, 70, 1.0, 1.0);
  for (const char* name : {"a", "b", "c"}) {
    SoftBody& body = scene.soft_bodies.emplace_back();
    body.name = name;
    body.mesh = mesh;
    body.pin_boundary = true;
    body.springs.stiffness_n_m = 100.0;
    body.collision.soft = SoftCollision::none;
  }
  World by_one = make(scene);
  World by_two = make(scene);
  Workers one(1);
  Workers two(2);
  for (int tick = 1; tick <= 3; ++tick) {
    EXPECT_FALSE(by_one.substep(one));
    EXPECT_TRUE(by_one.substep(one));
    EXPECT_TRUE(by_two.substep(two));
    EXPECT_EQ(by_one.state_hash(), by_two.state_hash()) << tick;
  }
}

// What stays of an edit's bodies keeps its factors, which must not show.
TEST(World, ABodySolvedForHasTheSameBitsWhateverElseIsEdited) {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.stepping.integrator = Integrator::implicit_euler;
  scene.stepping.substeps = 1;
  scene.soft_bodies = {ball("a"), ball("b", {2.0, 0.0, 0.0})};
  World edited = make(scene);
  World left_alone = make(scene);
  run(edited, 5);
  run(left_alone, 5);
  Scene other = edited.scene();
  other.soft_bodies[0].springs.stiffness_n_m = 5000.0;
  ASSERT_TRUE(edited.apply(other).ok());
  run(edited, 5);
  run(left_alone, 5);
  EXPECT_EQ(positions(edited, 1), positions(left_alone, 1));
  EXPECT_NE(positions(edited, 0), positions(left_alone, 0));
  other.soft_bodies.erase(other.soft_bodies.begin());
  ASSERT_TRUE(edited.apply(other).ok());
  run(edited, 5);
  run(left_alone, 5);
  EXPECT_EQ(positions(edited, 0), positions(left_alone, 1));
}

TEST(Profile, HasZeroRowsForWhatTheSceneDoesNotUse) {
  Scene scene;
  SoftBody cloth;
  cloth.name = "cloth";
  cloth.mesh = *make_grid(6, 6, 1.0, 1.0);
  cloth.pin_boundary = true;
  cloth.springs.stiffness_n_m = 10.0;
  scene.soft_bodies = {cloth};
  World world = make(scene);
  world.set_profiling(true);
  run(world, 10);
  const Profile profile = world.profile();
  const auto row = [&](Stage stage) { return profile[static_cast<std::size_t>(stage)]; };
  EXPECT_GT(row(Stage::springs).calls, 0U);
  for (const Stage stage : {Stage::volume, Stage::pressure, Stage::wind, Stage::grabs, Stage::joints, Stage::bounds,
                            Stage::broad_phase, Stage::soft_contact, Stage::solid_contact, Stage::rigid}) {
    EXPECT_EQ(row(stage).calls, 0U) << stage_names[static_cast<std::size_t>(stage)];
    EXPECT_EQ(row(stage).bytes, 0U) << stage_names[static_cast<std::size_t>(stage)];
  }
}

TEST(World, APumpedBodyBurstsOnceAndGoesOnAsAnOpenSkin) {
  Scene scene;
  scene.soft_bodies = {ball("a")};
  scene.soft_bodies[0].gas = Gas{.moles = 0.01, .flow_mol_s = 0.1, .burst_pressure_pa = 100.0};
  World world = make(scene);
  run(world, 2);
  EXPECT_TRUE(world.take_gas_events().empty());
  EXPECT_GT(world.measure(0).moles, 0.01);
  run(world, 120);
  const auto events = world.take_gas_events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].name, "a");
  EXPECT_EQ(events[0].event.kind, GasEvent::Kind::burst);
  EXPECT_GT(events[0].event.pressure_pa, 100.0);
  EXPECT_EQ(world.measure(0).moles, 0.0);
  EXPECT_EQ(world.measure(0).pressure_pa, 0.0);
  EXPECT_FALSE(world.scene().soft_bodies[0].gas.has_value());

  // The scene that it was made from still has the gas; the snapshot knows better.
  World restored = make(scene);
  ASSERT_TRUE(restored.restore(world.snapshot()).ok());
  run(world, 10);
  run(restored, 10);
  EXPECT_EQ(restored.state_hash(), world.state_hash());
  EXPECT_EQ(restored.measure(0).moles, 0.0);
}

}  // namespace
}  // namespace pneuma::physics
