// Shows that a world is its scene plus its commands by tick: the same commands at the same ticks give the same hash,
// from the start and from a saved state; and that a bad command changes nothing and is named.
#include "app/live_world.h"

#include <limits>
#include <map>

#include <gtest/gtest.h>

#include "app/saved_world.h"
#include "ball_scene.h"

namespace pneuma::app {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

LiveWorld ball_world() {
  auto world = LiveWorld::create(ball_scene());
  EXPECT_TRUE(world.ok()) << world.status().message();
  return std::move(*world);
}

v1::ClientMessage reset() {
  v1::ClientMessage message;
  message.mutable_reset()->set_world("w");
  return message;
}

const std::map<std::uint64_t, v1::ClientMessage>& script() {
  static const std::map<std::uint64_t, v1::ClientMessage> commands{
      {5, impulse_up("ball", 2.0)}, {12, grab_vertex(3)}, {20, add_second_ball()}, {25, impulse_up("second", 1.0)}};
  return commands;
}

void play(LiveWorld& world, std::uint64_t until_tick) {
  physics::Workers workers(1);
  while (world.tick() < until_tick) {
    if (const auto command = script().find(world.tick()); command != script().end()) {
      const auto effect = world.change(command->second);
      ASSERT_TRUE(effect.ok()) << effect.status().message();
    }
    world.physics().step_tick(workers);
  }
}

TEST(LiveWorld, TheSameCommandsAtTheSameTicksGiveTheSameHash) {
  LiveWorld a = ball_world();
  LiveWorld b = ball_world();
  play(a, 60);
  play(b, 60);
  EXPECT_EQ(a.physics().state_hash(), b.physics().state_hash());
  LiveWorld untouched = ball_world();
  physics::Workers workers(1);
  while (untouched.tick() < 60) untouched.physics().step_tick(workers);
  EXPECT_NE(a.physics().state_hash(), untouched.physics().state_hash());
}

TEST(LiveWorld, ARewindTakesItBackToAStateAndItsTicksGoOn) {
  LiveWorld reference = ball_world();
  play(reference, 15);
  const std::uint64_t hash_without_grab = [] {
    LiveWorld free = ball_world();
    play(free, 12);
    return free.physics().state_hash();
  }();

  LiveWorld world = ball_world();
  play(world, 12);
  v1::ClientMessage rewind;
  rewind.mutable_rewind_world()->set_world("w");
  rewind.mutable_rewind_world()->set_tick(12);
  rewind.mutable_rewind_world()->set_state(to_bytes(SavedWorld{world.save(), false}));
  play(world, 40);
  const auto effect = world.change(rewind);
  ASSERT_TRUE(effect.ok()) << effect.status().message();
  EXPECT_TRUE(effect->edited);
  EXPECT_EQ(world.tick(), 40U);
  EXPECT_EQ(world.physics().state_hash(), hash_without_grab);
  EXPECT_EQ(world.scene().soft_bodies_size(), 1) << "the edit of tick 20 is gone";
  // The same commands again lead to the same state.
  ASSERT_TRUE(world.change(grab_vertex(3)).ok());
  physics::Workers workers(1);
  while (world.tick() < 43) world.physics().step_tick(workers);
  std::vector<double> here_m(3 * 42);
  std::vector<double> there_m(3 * 42);
  world.physics().copy_positions(0, here_m);
  reference.physics().copy_positions(0, there_m);
  EXPECT_EQ(here_m, there_m);

  rewind.mutable_rewind_world()->set_state("no state");
  EXPECT_EQ(world.change(rewind).status().where(), "rewind_world.state");
  EXPECT_EQ(world.tick(), 43U);
}

v1::ClientMessage set_gravity(double y) {
  v1::ClientMessage message;
  message.mutable_edit()->set_world("w");
  message.mutable_edit()->mutable_edit()->add_changes()->mutable_set_gravity()->set_y(y);
  return message;
}

TEST(LiveWorld, AnEditLeavesTheGasAndTheSolidsThatItDoesNotNameGoingOn) {
  v1::Scene scene = ball_scene();
  scene.mutable_soft_bodies(0)->mutable_gas()->set_moles(0.01);
  scene.mutable_soft_bodies(0)->mutable_gas()->set_flow_mol_s(0.05);
  scene.mutable_soft_bodies(0)->mutable_gas()->set_law(v1::Gas::ADIABATIC);
  v1::Collider& wheel = *scene.add_colliders();
  wheel.set_name("wheel");
  wheel.mutable_shape()->mutable_sphere()->set_radius_m(0.1);
  wheel.mutable_position()->set_y(-50.0);
  wheel.mutable_angular_velocity()->set_z(1.0);
  auto world = LiveWorld::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  physics::Workers workers(1);
  for (int tick = 0; tick < 30; ++tick) world->physics().step_tick(workers);
  const physics::BodyMeasures before = world->physics().measure(0);
  EXPECT_GT(before.moles, 0.03);
  const physics::Quatd turned = world->physics().colliders().back().orientation;

  ASSERT_TRUE(world->change(set_gravity(-1.0)).ok());
  EXPECT_EQ(world->physics().measure(0).moles, before.moles);
  EXPECT_NEAR(world->physics().measure(0).temperature_k, before.temperature_k, 1e-9 * before.temperature_k);
  EXPECT_EQ(world->physics().colliders().back().orientation.coeffs(), turned.coeffs());
}

TEST(LiveWorld, AnEditOrResetOfALargeWorldKeepsTheMeshesThatItDoesNotChange) {
  v1::Scene scene = ball_scene();
  scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(5);
  scene.mutable_stepping()->set_substeps(0);
  auto world = LiveWorld::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  const std::shared_ptr<const physics::Mesh> built = world->physics().soft_body(0).mesh;
  ASSERT_TRUE(world->change(set_gravity(-1.0)).ok());
  EXPECT_EQ(world->physics().soft_body(0).mesh, built);
  ASSERT_TRUE(world->change(add_second_ball()).ok());
  EXPECT_EQ(world->physics().soft_body(1).mesh, built);
  ASSERT_TRUE(world->change(reset()).ok());
  EXPECT_EQ(world->physics().soft_body(0).mesh, built);
}

TEST(LiveWorld, AnEditThatGivesAMeshesNameToAnotherOneBuildsIt) {
  LiveWorld world = ball_world();
  v1::ClientMessage message;
  v1::SceneEdit& edit = *message.mutable_edit()->mutable_edit();
  edit.add_changes()->set_remove_soft_body("ball");
  edit.add_changes()->set_remove_mesh("sphere");
  edit.add_changes()->mutable_set_stepping()->set_substeps(8);
  v1::Mesh& larger = *edit.add_changes()->mutable_add_mesh();
  larger.set_name("sphere");
  larger.mutable_icosphere()->set_subdivisions(2);
  *edit.add_changes()->mutable_add_soft_body() = ball_scene().soft_bodies(0);
  const auto effect = world.change(message);
  ASSERT_TRUE(effect.ok()) << effect.status().message();
  EXPECT_EQ(world.physics().soft_body(0).mesh->positions_m.size(), 162U);
  ASSERT_TRUE(world.change(reset()).ok());
  EXPECT_EQ(world.physics().soft_body(0).mesh->positions_m.size(), 42U);
}

TEST(LiveWorld, SavedAtAnyTickItGoesOnWithTheSameBits) {
  LiveWorld whole = ball_world();
  play(whole, 60);
  for (const std::uint64_t cut : {0U, 6U, 13U, 20U, 21U, 40U}) {
    LiveWorld first = ball_world();
    play(first, cut);
    const auto saved = from_bytes(to_bytes({first.save(), false}));
    ASSERT_TRUE(saved.ok()) << saved.status().message();
    auto second = LiveWorld::restore(saved->live);
    ASSERT_TRUE(second.ok()) << second.status().message();
    EXPECT_EQ(second->tick(), cut);
    EXPECT_EQ(second->physics().state_hash(), first.physics().state_hash()) << "at tick " << cut;
    play(*second, 60);
    EXPECT_EQ(second->physics().state_hash(), whole.physics().state_hash()) << "cut at tick " << cut;
  }
}

v1::SceneChange hung_by(const std::string& name, std::uint32_t vertex, double break_force_n) {
  v1::SceneChange change;
  v1::Joint& joint = *change.mutable_add_joint();
  joint.set_name(name);
  joint.mutable_first()->set_soft_body("ball");
  joint.mutable_first()->set_vertex(vertex);
  if (break_force_n > 0.0) joint.set_break_force_n(break_force_n);
  return change;
}

v1::ClientMessage edit_of(const v1::SceneChange& change) {
  v1::ClientMessage message;
  *message.mutable_edit()->mutable_edit()->add_changes() = change;
  return message;
}

// A joint is added, one breaks by itself and one is removed; a break is no command, and is not in the log.
TEST(LiveWorld, JointsComeBreakAndGoWithTheSameBitsFromAnySave) {
  v1::SceneChange removal;
  removal.set_remove_joint("nail");
  const std::map<std::uint64_t, v1::ClientMessage> commands{{5, edit_of(hung_by("thread", 7, 20.0))},
                                                            {8, edit_of(hung_by("nail", 3, 0.0))},
                                                            {30, impulse_up("ball", -3.0)},
                                                            {50, edit_of(removal)}};
  std::map<std::uint64_t, std::size_t> joints;
  const auto play_joints = [&](LiveWorld& world, std::uint64_t until_tick) {
    physics::Workers workers(1);
    while (world.tick() < until_tick) {
      if (const auto command = commands.find(world.tick()); command != commands.end()) {
        const auto effect = world.change(command->second);
        ASSERT_TRUE(effect.ok()) << effect.status().message();
      }
      world.physics().step_tick(workers);
      joints[world.tick()] = world.physics().joints().size();
    }
  };
  LiveWorld whole = ball_world();
  play_joints(whole, 70);
  EXPECT_EQ(joints[6], 1U);
  EXPECT_EQ(joints[9], 2U);
  EXPECT_EQ(joints[45], 1U) << "the thread is to be broken by then";
  EXPECT_EQ(joints[60], 0U);
  EXPECT_EQ(whole.scene().joints_size(), 0);
  for (const std::uint64_t cut : {6U, 20U, 45U, 55U}) {
    LiveWorld first = ball_world();
    play_joints(first, cut);
    const auto saved = from_bytes(to_bytes({first.save(), false}));
    ASSERT_TRUE(saved.ok()) << saved.status().message();
    auto second = LiveWorld::restore(saved->live);
    ASSERT_TRUE(second.ok()) << second.status().message();
    EXPECT_EQ(second->physics().state_hash(), first.physics().state_hash()) << "at tick " << cut;
    play_joints(*second, 70);
    EXPECT_EQ(second->physics().state_hash(), whole.physics().state_hash()) << "cut at tick " << cut;
  }
}

TEST(LiveWorld, ABodyThatAJointHoldsIsNotRemovedBeforeIt) {
  LiveWorld world = ball_world();
  ASSERT_TRUE(world.change(edit_of(hung_by("nail", 3, 0.0))).ok());
  v1::ClientMessage message;
  message.mutable_edit()->mutable_edit()->add_changes()->set_remove_soft_body("ball");
  const auto refused = world.change(message);
  EXPECT_EQ(refused.status().code(), base::StatusCode::failed_precondition);
  EXPECT_EQ(refused.status().what(), "joint \"nail\" holds it");
  message.mutable_edit()->mutable_edit()->add_changes()->set_remove_joint("nail");
  message.mutable_edit()->mutable_edit()->mutable_changes()->SwapElements(0, 1);
  EXPECT_TRUE(world.change(message).ok());
  EXPECT_EQ(world.change(edit_of(hung_by("nail", 3, 0.0))).status().where(),
            "edit.edit.changes[0].add_joint.first.soft_body");
}

/// A mesh of that name with a face missing, that asks to be mended.
v1::Mesh open_tetrahedron(const std::string& name) {
  v1::Mesh mesh;
  mesh.set_name(name);
  mesh.mutable_mend();
  v1::Mesh::Triangles& list = *mesh.mutable_triangles();
  list.add_positions();
  list.add_positions()->set_x(1.0);
  list.add_positions()->set_y(1.0);
  list.add_positions()->set_z(1.0);
  for (const std::uint32_t index : {0U, 2U, 1U, 0U, 1U, 3U, 0U, 3U, 2U}) list.add_indices(index);
  return mesh;
}

TEST(LiveWorld, TellsWhatWasMendedAndComesBackWithIt) {
  v1::Scene scene = ball_scene();
  *scene.add_meshes() = open_tetrahedron("first");
  scene.mutable_soft_bodies(0)->set_mesh("first");
  auto world = LiveWorld::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  ASSERT_EQ(world->mended().size(), 1U);
  EXPECT_EQ(world->mended()[0].mesh(), "first");
  EXPECT_EQ(world->mended()[0].holes_closed(), 1U);
  EXPECT_EQ(world->mended()[0].detail(), "1 hole closed with 1 face");

  v1::ClientMessage edit = add_second_ball();
  *edit.mutable_edit()->mutable_edit()->add_changes()->mutable_add_mesh() = open_tetrahedron("other");
  const auto effect = world->change(edit);
  ASSERT_TRUE(effect.ok()) << effect.status().message();
  ASSERT_EQ(effect->mended.size(), 1U);
  EXPECT_EQ(effect->mended[0].mesh(), "other");
  EXPECT_TRUE(world->change(set_gravity(-5.0))->mended.empty());

  physics::Workers workers(1);
  for (int i = 0; i < 10; ++i) world->physics().step_tick(workers);
  auto restored = LiveWorld::restore(world->save());
  ASSERT_TRUE(restored.ok()) << restored.status().message();
  EXPECT_EQ(restored->physics().state_hash(), world->physics().state_hash());
}

TEST(LiveWorld, ResetBringsBackTheSceneAndTicksGoOn) {
  LiveWorld world = ball_world();
  const auto fresh_hash = world.physics().state_hash();
  play(world, 30);
  const auto effect = world.change(reset());
  ASSERT_TRUE(effect.ok());
  EXPECT_TRUE(effect->edited);
  EXPECT_EQ(world.tick(), 30U);
  EXPECT_EQ(world.physics().time_s(), 0.0);
  EXPECT_EQ(world.physics().state_hash(), fresh_hash);
  EXPECT_EQ(world.physics().soft_body_count(), 1U);
  EXPECT_TRUE(world.grabs().empty());
}

TEST(LiveWorld, ABadCommandIsNamedAndChangesNothing) {
  LiveWorld world = ball_world();
  play(world, 3);
  const auto hash = world.physics().state_hash();

  v1::ClientMessage not_finite = impulse_up("ball", nan);
  EXPECT_EQ(world.change(not_finite).status().where(), "impulse.impulse.y");
  v1::ClientMessage absurd = impulse_up("ball", 1e300);
  EXPECT_EQ(world.change(absurd).status().where(), "impulse.impulse.y");
  const auto unknown = world.change(impulse_up("nobody", 1.0));
  EXPECT_EQ(unknown.status().code(), base::StatusCode::not_found);
  EXPECT_NE(unknown.status().message().find("nobody"), std::string::npos);
  v1::ClientMessage vertex = impulse_up("ball", 1.0);
  vertex.mutable_impulse()->set_vertex(42);
  EXPECT_FALSE(world.change(vertex).ok());
  v1::ClientMessage ray = impulse_up("", 1.0);
  ray.mutable_impulse()->mutable_ray();
  EXPECT_EQ(world.change(ray).status().where(), "impulse.ray.direction");
  v1::ClientMessage edit;
  edit.mutable_edit()->mutable_edit()->add_changes()->set_remove_soft_body("nobody");
  EXPECT_EQ(world.change(edit).status().code(), base::StatusCode::not_found);
  v1::ClientMessage json;
  json.mutable_edit()->set_edit_json("{ nonsense");
  EXPECT_FALSE(world.change(json).ok());
  v1::ClientMessage nothing;
  nothing.mutable_edit();
  EXPECT_EQ(world.change(nothing).status().where(), "edit.source");
  v1::ClientMessage no_change;
  no_change.mutable_edit()->mutable_edit();
  EXPECT_EQ(world.change(no_change).status().message(), "edit.edit.changes: holds no change");
  no_change.mutable_edit()->set_edit_json("{}");
  EXPECT_EQ(world.change(no_change).status().message(), "edit.edit_json.changes: holds no change");
  v1::ClientMessage heavy;
  heavy.mutable_edit()->mutable_edit()->add_changes()->mutable_change_soft_body()->set_name("ball");
  heavy.mutable_edit()->mutable_edit()->mutable_changes(0)->mutable_change_soft_body()->set_mass_kg(-1.0);
  EXPECT_FALSE(world.change(heavy).ok());

  EXPECT_EQ(world.physics().state_hash(), hash);
}

TEST(LiveWorld, AGrabIsHeldMovedAndReleased) {
  LiveWorld world = ball_world();
  const auto held = world.change(grab_vertex(7));
  ASSERT_TRUE(held.ok());
  ASSERT_TRUE(held->grabbed);
  EXPECT_EQ(held->grabbed->body(), "ball");
  EXPECT_EQ(held->grabbed->vertex(), 7U);
  v1::ClientMessage move;
  move.mutable_move_grab()->set_grab_id(held->grabbed->grab_id());
  move.mutable_move_grab()->mutable_target()->set_x(1.0);
  EXPECT_TRUE(world.change(move).ok());
  v1::ClientMessage release;
  release.mutable_release_grab()->set_grab_id(held->grabbed->grab_id());
  EXPECT_TRUE(world.change(release).ok());
  EXPECT_FALSE(world.change(release).ok());
  EXPECT_FALSE(world.change(move).ok());
}

TEST(LiveWorld, AGrabGoesWithItsBody) {
  LiveWorld world = ball_world();
  ASSERT_TRUE(world.change(add_second_ball()).ok());
  const auto first = world.change(grab_vertex(7));
  v1::ClientMessage second = grab_vertex(7);
  second.mutable_grab()->set_body("second");
  ASSERT_TRUE(world.change(second).ok());
  ASSERT_EQ(world.grabs().size(), 2U);
  v1::ClientMessage removal;
  removal.mutable_edit()->mutable_edit()->add_changes()->set_remove_soft_body("second");
  ASSERT_TRUE(world.change(removal).ok());
  EXPECT_EQ(world.grabs(), (LiveWorld::Grabs{{first->grabbed->grab_id(), "ball"}}));
}

v1::ClientMessage edit_of(const std::vector<v1::SceneChange>& changes) {
  v1::ClientMessage message;
  message.mutable_edit()->set_world("w");
  for (const v1::SceneChange& made : changes) *message.mutable_edit()->mutable_edit()->add_changes() = made;
  return message;
}

v1::SceneChange removal_of(const std::string& body) {
  v1::SceneChange made;
  made.set_remove_soft_body(body);
  return made;
}

v1::SceneChange addition_of(const v1::SoftBody& body) {
  v1::SceneChange made;
  *made.mutable_add_soft_body() = body;
  return made;
}

TEST(LiveWorld, ABodyRemovedAndAddedInOneEditBeginsAnew) {
  LiveWorld world = ball_world();
  const auto fresh_hash = world.physics().state_hash();
  ASSERT_TRUE(world.change(impulse_up("ball", 1e7)).ok());  // past the limit of speed
  ASSERT_TRUE(world.change(grab_vertex(7)).ok());
  physics::Workers workers(1);
  world.physics().step_tick(workers);
  ASSERT_TRUE(world.physics().is_frozen(0));

  ASSERT_TRUE(world.change(edit_of({removal_of("ball"), addition_of(ball_scene().soft_bodies(0))})).ok());
  EXPECT_FALSE(world.physics().is_frozen(0));
  EXPECT_TRUE(world.grabs().empty());
  EXPECT_TRUE(world.physics().measure(0).momentum.isZero());
  LiveWorld untouched = ball_world();
  ASSERT_EQ(untouched.physics().state_hash(), fresh_hash);
  physics::Workers others(1);
  for (int tick = 0; tick < 30; ++tick) {
    world.physics().step_tick(workers);
    untouched.physics().step_tick(others);
  }
  EXPECT_TRUE(world.physics().measure(0).centre_of_mass.isApprox(untouched.physics().measure(0).centre_of_mass, 0.0));
}

TEST(LiveWorld, ARigidBodyThatIsSetSomewhereIsFrozenNoLonger) {
  v1::Scene scene = ball_scene();
  v1::RigidBody& stone = *scene.add_rigid_bodies();
  stone.set_name("stone");
  stone.mutable_shape()->mutable_sphere()->set_radius_m(0.1);
  stone.mutable_position()->set_y(30.0);
  for (const bool by_velocity : {false, true}) {
    auto world = LiveWorld::create(scene);
    ASSERT_TRUE(world.ok()) << world.status().message();
    ASSERT_TRUE(world->change(impulse_up("stone", 1e7)).ok());
    physics::Workers workers(1);
    world->physics().step_tick(workers);
    ASSERT_TRUE(world->physics().rigid_bodies()[0].frozen);

    v1::SceneChange heavier;
    heavier.mutable_change_rigid_body()->set_name("stone");
    heavier.mutable_change_rigid_body()->set_mass_kg(2.0);
    ASSERT_TRUE(world->change(edit_of({heavier})).ok());
    EXPECT_TRUE(world->physics().rigid_bodies()[0].frozen) << "its mass says nothing of its motion";

    v1::SceneChange moved;
    moved.mutable_change_rigid_body()->set_name("stone");
    if (by_velocity) {
      moved.mutable_change_rigid_body()->mutable_velocity()->set_x(3.0);
    } else {
      moved.mutable_change_rigid_body()->mutable_position()->set_y(20.0);
    }
    ASSERT_TRUE(world->change(edit_of({moved})).ok());
    const physics::RigidState& state = world->physics().rigid_bodies()[0];
    EXPECT_FALSE(state.frozen);
    const double before_m = state.position.y();
    world->physics().step_tick(workers);
    EXPECT_LT(world->physics().rigid_bodies()[0].position.y(), before_m);
  }
}

}  // namespace
}  // namespace pneuma::app
