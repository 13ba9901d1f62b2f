// Shows what a world notes of its contacts while somebody asks: which vertices were held off what, by every stepping
// method, where the surfaces are in truth; that whoever sleeps keeps them; and that noting moves nothing by a bit.
#include "physics/contact/contact_note.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "physics/contact/distinct_contacts.h"
#include "physics/mesh/mesh_builders.h"
#include "support/stepping_methods.h"
#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

using Other = BodyKind;

Collider plane(const std::string& name, const Vec3d& normal, double offset_m) {
  Collider collider;
  collider.name = name;
  collider.shape = PlaneShape{normal};
  collider.position = offset_m * normal;
  return collider;
}

/// A ball that lies on the second of two floors, the first being out of reach.
Scene ball_on_floor() {
  Scene scene;
  scene.gravity = Vec3d(0.0, -9.81, 0.0);
  scene.stepping.substeps = 16;
  scene.soft_bodies = {ball("ball", {0.0, 0.5, 0.0})};
  scene.soft_bodies[0].springs.damping_n_s_m = 5.0;
  scene.colliders = {plane("far below", Vec3d::UnitY(), -50.0), plane("floor", Vec3d::UnitY(), 0.0)};
  return scene;
}

// In a corner of two walls, each answered thrice, a little off each time.
TEST(DistinctContacts, EachWallIsThereOnceHoweverTheNormalsLie) {
  ContactNotes notes;
  for (const double off : {0.0, 1e-6, 2e-6}) {
    notes.push_back({5, {Other::collider, 0}, Vec3d(off, 1.0, 0.0)});
    notes.push_back({5, {Other::collider, 0}, Vec3d(off + 5e-7, 0.0, 1.0)});
    notes.push_back({5, {Other::collider, 1}, Vec3d(off, 1.0, 0.0)});
    notes.push_back({4, {Other::collider, 0}, Vec3d(off, 1.0, 0.0)});
  }
  const ContactNotes walls = distinct(notes);
  const auto count = [&](std::uint32_t vertex, std::uint32_t collider) {
    return std::ranges::count_if(
        walls, [&](const VertexContact& wall) { return wall.vertex == vertex && wall.other.index == collider; });
  };
  EXPECT_EQ(count(4, 0), 1);
  EXPECT_EQ(count(5, 0), 2);
  EXPECT_EQ(count(5, 1), 1);
  EXPECT_TRUE(std::ranges::is_sorted(walls, {}, &VertexContact::vertex));
}

class ContactNotesByMethod : public testing::TestWithParam<SteppingMethod> {};

TEST_P(ContactNotesByMethod, TheVerticesOnAFloorAreThoseThatItHolds) {
  Scene scene = ball_on_floor();
  scene.stepping.integrator = GetParam().integrator;
  scene.stepping.precision = GetParam().precision;
  scene.stepping.on_unstable = OnUnstable::allow;
  World world = make(scene);
  world.note_contacts(true);
  run(world, 20);
  const ContactNotes notes = world.contacts(0);
  ASSERT_FALSE(notes.empty());
  const std::vector<double> x_m = positions(world, 0);
  for (const VertexContact& note : notes) {
    EXPECT_EQ(note.other.kind, Other::collider);
    EXPECT_EQ(note.other.index, 1U);
    EXPECT_LT((note.normal - Vec3d::UnitY()).norm(), 1e-12);
    EXPECT_NEAR(x_m[3 * note.vertex + 1], 0.0, 1e-6);
  }
  EXPECT_TRUE(std::ranges::is_sorted(notes, std::less<>(), &VertexContact::vertex));
  EXPECT_EQ(std::ranges::adjacent_find(notes, {}, &VertexContact::vertex), notes.end()) << "each once";
}
INSTANTIATE_TEST_SUITE_P(Every, ContactNotesByMethod, testing::ValuesIn(every_stepping_method()),
                         name_of_stepping_method);

TEST(ContactNotes, AreNoneWhereNobodyAsksAndChangeNoBit) {
  World quiet = make(lively_scene());
  World noting = make(lively_scene());
  noting.note_contacts(true);
  for (int tick = 0; tick < 120; ++tick) {
    run(quiet, 1);
    run(noting, 1);
    EXPECT_TRUE(quiet.contacts(0).empty() && quiet.contacts(1).empty());
  }
  EXPECT_EQ(quiet.state_hash(), noting.state_hash());
  noting.note_contacts(false);
  EXPECT_TRUE(noting.contacts(0).empty() && noting.contacts(1).empty());
}

TEST(ContactNotes, AVertexInACornerHasOneForEachWall) {
  Scene scene = ball_on_floor();
  Collider room;
  room.name = "room";
  room.shape = RoomShape{Vec3d::Constant(1.0)};
  scene.colliders = {room};
  scene.gravity = Vec3d(-5.0, -5.0, 0.0);
  scene.soft_bodies[0].mesh = *make_box(Vec3d::Constant(0.4), 1);
  scene.soft_bodies[0].position = {-0.6, -0.6, 0.0};
  World world = make(scene);
  world.note_contacts(true);
  run(world, 1);
  std::size_t in_the_corner = 0;
  const ContactNotes notes = world.contacts(0);
  for (std::size_t i = 1; i < notes.size(); ++i) {
    if (notes[i].vertex != notes[i - 1].vertex) continue;
    ++in_the_corner;
    EXPECT_LT(std::abs(notes[i].normal.dot(notes[i - 1].normal)), 1e-3);
  }
  EXPECT_GT(in_the_corner, 0U);
}

TEST(ContactNotes, ASoftBodyOnARigidOneNamesIt) {
  Scene scene = ball_on_floor();
  RigidBody slab;
  slab.name = "slab";
  slab.shape = BoxShape{Vec3d(2.0, 0.1, 2.0)};
  slab.position = {0.0, 0.1, 0.0};
  slab.mass_kg = 100.0;
  scene.rigid_bodies = {slab};
  scene.soft_bodies[0].position.y() = 0.7;
  World world = make(scene);
  world.note_contacts(true);
  run(world, 10);
  const ContactNotes notes = world.contacts(0);
  ASSERT_FALSE(notes.empty());
  for (const VertexContact& note : notes) {
    EXPECT_EQ(note.other.kind, Other::rigid);
    EXPECT_EQ(note.other.index, 0U);
    EXPECT_GT(note.normal.y(), 0.99);
  }
}

TEST(ContactNotes, SoftBodiesThatMeetNameEachOther) {
  Scene scene;
  scene.soft_bodies = {ball("left", {-0.6, 0.0, 0.0}), ball("right", {0.6, 0.0, 0.0})};
  scene.soft_bodies[0].velocity.x() = 2.0;
  scene.soft_bodies[1].velocity.x() = -2.0;
  World world = make(scene);
  world.note_contacts(true);
  std::size_t seen = 0;
  for (int tick = 0; tick < 20; ++tick) {
    run(world, 1);
    for (std::size_t body = 0; body < 2; ++body) {
      for (const VertexContact& note : world.contacts(body)) {
        ++seen;
        EXPECT_EQ(note.other.kind, Other::soft);
        EXPECT_EQ(note.other.index, 1 - body);
        EXPECT_GT(note.normal.x() * (body == 0 ? -1.0 : 1.0), 0.0) << "out of the other";
        EXPECT_NEAR(note.normal.norm(), 1.0, 1e-9);
      }
    }
  }
  EXPECT_GT(seen, 0U);
}

TEST(ContactNotes, ASleeperKeepsThoseItFellAsleepWith) {
  World world = make(ball_on_floor());
  world.note_contacts(true);
  Workers workers(1);
  for (int tick = 0; tick < 3'000 && !world.is_asleep(0); ++tick) world.step_tick(workers);
  ASSERT_TRUE(world.is_asleep(0));
  const std::size_t held = world.contacts(0).size();
  EXPECT_GT(held, 0U);
  run(world, 10);
  EXPECT_EQ(world.contacts(0).size(), held);
}

}  // namespace
}  // namespace pneuma::physics
