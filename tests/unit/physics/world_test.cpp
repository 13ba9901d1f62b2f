// Shows what a world promises to whoever hosts it: edits keep what they do not name, impulses and grabs give the
// momentum asked for, a snapshot restores every bit, and a body that runs away is stopped alone.
#include "physics/world.h"

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

SoftBody ball(const std::string& name, const Vec3d& position = Vec3d::Zero()) {
  SoftBody body;
  body.name = name;
  body.mesh = *make_icosphere(1, 0.5);
  body.position = position;
  body.mass_kg = 2.0;
  body.springs = {.stiffness_n_m = 200.0, .damping_n_s_m = 0.5};
  body.gas = Gas{.moles = 0.01};
  return body;
}

// Two balls, a rigid ball and a turning room, in gravity: something of everything.
Scene lively_scene() {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.stepping.substeps = 16;
  scene.soft_bodies = {ball("a", {0.0, 1.0, 0.0}), ball("b", {1.2, 1.5, 0.3})};
  RigidBody rigid;
  rigid.name = "stone";
  rigid.shape = SphereShape{0.3};
  rigid.position = {-1.0, 2.0, 0.0};
  scene.rigid_bodies.push_back(rigid);
  Collider room;
  room.name = "room";
  room.shape = RoomShape{Vec3d(3.0, 3.0, 3.0)};
  room.angular_velocity = Vec3d(0.0, 0.0, 0.5);
  room.surface = {.restitution = 0.4, .friction = 0.5};
  scene.colliders.push_back(room);
  return scene;
}

World make(Scene scene) {
  auto world = World::create(std::move(scene));
  EXPECT_TRUE(world.ok()) << world.status().message();
  return std::move(*world);
}

void run(World& world, int ticks) {
  Workers workers(1);
  for (int i = 0; i < ticks; ++i) world.step_tick(workers);
}

std::vector<double> positions(const World& world, std::size_t body) {
  std::vector<double> x(3 * world.soft_body(body).mesh->positions_m.size());
  world.copy_positions(body, x);
  return x;
}

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
    ASSERT_TRUE(world.add_grab(7, "a", std::uint32_t{3}, Vec3d(0.0, 2.0, 0.0), 50.0, 0.0).ok());
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

TEST(Impulse, RayWithoutABodyHitsTheFirstOneOnItsWay) {
  World world = make(lively_scene());
  EXPECT_EQ(world.apply_impulse("", RayPoint{{-9.0, 2.0, 0.0}, Vec3d(2.0, 0.0, 0.0), 0.0}, Vec3d::UnitX())->body,
            "stone");
  EXPECT_EQ(world.apply_impulse("", RayPoint{{-9.0, 1.0, 0.0}, Vec3d(1.0, 0.0, 0.0), 0.0}, Vec3d::UnitX())->body, "a");
  EXPECT_EQ(
      world.apply_impulse("", RayPoint{{-9.0, 9.0, 0.0}, Vec3d(1.0, 0.0, 0.0), 0.0}, Vec3d::UnitX()).status().code(),
      base::StatusCode::not_found);
}

TEST(Impulse, OffCentreTurnsARigidBody) {
  World world = make(lively_scene());
  const Vec3d arm(0.0, 0.3, 0.0);
  const Vec3d impulse(0.5, 0.0, 0.0);
  ASSERT_TRUE(world.apply_impulse("stone", NearPoint{world.rigid_bodies()[0].position + arm, 0.0}, impulse).ok());
  const double inertia = 0.4 * 1.0 * 0.3 * 0.3;
  EXPECT_TRUE(world.rigid_bodies()[0].velocity.isApprox(impulse, 1e-12));
  EXPECT_TRUE(world.rigid_bodies()[0].angular_velocity.isApprox(arm.cross(impulse) / inertia, 1e-12));
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

TEST(Runaway, BodyIsFrozenWhereItWasWellAndTheOthersGoOn) {
  Scene scene;
  scene.stepping.integrator = Integrator::explicit_euler;
  scene.stepping.substeps = 1;
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
  for (const Stage stage : {Stage::volume, Stage::pressure, Stage::wind, Stage::grabs, Stage::bounds,
                            Stage::broad_phase, Stage::soft_contact, Stage::solid_contact, Stage::rigid}) {
    EXPECT_EQ(row(stage).calls, 0U) << stage_names[static_cast<std::size_t>(stage)];
    EXPECT_EQ(row(stage).bytes, 0U) << stage_names[static_cast<std::size_t>(stage)];
  }
}

}  // namespace
}  // namespace pneuma::physics
