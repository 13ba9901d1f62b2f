// Shows that contact leaves nothing of a world in the room that the next one works in.
#include <gtest/gtest.h>

#include "physics/machine/room_pool.h"
#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

// A heap of balls, a sheet that folds on itself, something of everything, and a ball without a solid.
std::vector<Scene> unlike_scenes(Integrator integrator) {
  std::vector<Scene> all(3, lively_scene());
  for (int i = 0; i < 3; ++i) {
    all[0].soft_bodies.push_back(ball("c" + std::to_string(i), {-1.0 + 0.7 * i, 1.2 + 0.9 * (i % 2), -1.0}));
  }
  SoftBody& sheet = all[1].soft_bodies[0];
  sheet.mesh = *make_grid(8, 8, 1.0, 1.0);
  sheet.gas.reset();
  sheet.collision.self = true;
  all[1].rigid_bodies.clear();
  Scene& pair = all.emplace_back(lively_scene());
  pair.rigid_bodies.clear();
  pair.colliders.clear();
  pair.soft_bodies[1].velocity = Vec3d(-4.0, 0.0, 0.0);
  pair.soft_bodies[1].position = Vec3d(1.15, 1.2, 0.3);
  for (Scene& scene : all) {
    scene.stepping.integrator = integrator;
    scene.stepping.substeps = integrator == Integrator::implicit_euler ? 2 : 8;
    for (SoftBody& body : scene.soft_bodies) body.velocity.y() = -8.0;
  }
  return all;
}

class PooledRooms : public testing::TestWithParam<Integrator> {};

TEST_P(PooledRooms, WorldsThatTakeTurnsHaveTheBitsOfEachAlone) {
  constexpr int ticks = 40;
  std::vector<World> in_turns;
  std::vector<World> alone;
  for (const Scene& scene : unlike_scenes(GetParam())) {
    in_turns.push_back(make(scene));
    alone.push_back(make(scene));
  }
  for (World& world : alone) run(world, ticks);
  for (int tick = 0; tick < ticks; ++tick) {
    for (World& world : in_turns) run(world, 1);
  }
  for (std::size_t i = 0; i < alone.size(); ++i) {
    EXPECT_EQ(in_turns[i].state_hash(), alone[i].state_hash()) << "world " << i;
    EXPECT_GT(alone[i].row_counts().rows, 0U) << "world " << i;
    EXPECT_EQ(in_turns[i].row_counts().rows, alone[i].row_counts().rows) << "world " << i;
  }
}

struct Note {
  std::size_t size = 0;
  bool is_cleared = false;
  [[nodiscard]] std::size_t bytes() const { return size; }
  void clear() { is_cleared = true; }
};
template <int>
struct NoteOf : Note {};

TEST(RoomPool, LendsWhatWasGivenBack) {
  Borrowed<NoteOf<0>> first;
  first->size = 7;
  first.give_back();
  EXPECT_EQ(first.held(), nullptr);
  Borrowed<NoteOf<0>> second;
  EXPECT_EQ(second->size, 7U);
  EXPECT_TRUE(second->is_cleared);
}

TEST(RoomPool, ALargeRoomStaysWithItsWorld) {
  Borrowed<NoteOf<1>> large;
  large->size = pooled_room_bytes_max + 1;
  large.give_back();
  ASSERT_NE(large.held(), nullptr);
  EXPECT_FALSE(large.held()->is_cleared);
  large->size = 1;  // no longer the pool's
  large.give_back();
  Borrowed<NoteOf<1>> next;
  EXPECT_EQ(next->size, 0U);
}

// Else worlds that are within a tick all at once would hold, each, what the largest among them needed.
TEST(RoomPool, LendsNoMoreThanItMay) {
  std::vector<Borrowed<NoteOf<2>>> lent(pooled_rooms_max);
  for (auto& each : lent) each->size = 9;
  Borrowed<NoteOf<2>> own;
  own->size = 5;
  own.give_back();
  EXPECT_EQ(own.held(), nullptr);
  EXPECT_EQ(own->size, 0U) << "it was freed";
  lent.pop_back();  // destroyed within a tick
  Borrowed<NoteOf<2>> instead;
  instead->size = 3;
  instead.give_back();
  EXPECT_EQ(instead->size, 3U) << "its place was free";
  const Borrowed<NoteOf<2>> copy(lent.front());
  EXPECT_EQ(copy.held(), nullptr);
  const Borrowed<NoteOf<2>> moved(std::move(lent.front()));
  EXPECT_EQ(moved.held()->size, 9U);
}

INSTANTIATE_TEST_SUITE_P(Methods, PooledRooms,
                         testing::Values(Integrator::symplectic_euler, Integrator::xpbd, Integrator::implicit_euler));

}  // namespace
}  // namespace pneuma::physics
