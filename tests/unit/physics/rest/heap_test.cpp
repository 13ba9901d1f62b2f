// Shows that a large heap falls asleep though some of it still creeps, that of a small one all must rest, and that a
// snapshot of bodies that creep goes on with the same bits.
#include <cmath>
#include <deque>
#include <vector>

#include <gtest/gtest.h>

#include "physics/rest/sleep.h"
#include "support/soft_heap.h"
#include "unit/physics/rest/sleep_rig.h"

namespace pneuma::physics {
namespace {

// Of a ball of the heap: its bounding box's diagonal, and a little less.
constexpr double heap_length_m = 0.85;

Scene heap_of(std::size_t balls) {
  return support::soft_heap(balls, 0.6, Integrator::symplectic_euler);
}

/// Of a heap: one a body.
using Places = std::vector<std::vector<double>>;

Places places_of(const World& heap) {
  Places places;
  for (std::size_t i = 0; i < heap.soft_body_count(); ++i) places.push_back(positions_of_body(heap, i));
  return places;
}

/// Runs a heap until all of it sleeps: how far, along an axis, its fastest vertex went in the half second before.
double moved_before_sleep_m(World& heap, std::uint64_t ticks_max) {
  std::deque<Places> last;
  while (count_asleep(heap) == 0 && heap.tick() < ticks_max) {
    last.push_back(places_of(heap));
    if (last.size() > 30) last.pop_front();
    run_on(heap, 1);
  }
  EXPECT_EQ(count_asleep(heap), heap.soft_body_count()) << "after " << heap.tick() << " ticks";
  const Places then = last.front();
  const Places now = places_of(heap);
  double most_m = 0.0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    for (std::size_t k = 0; k < now[i].size(); ++k) most_m = std::max(most_m, std::abs(now[i][k] - then[i][k]));
  }
  return most_m;
}

// There is always one that rocks or creeps: where all had to keep their places, this was awake after 40 s.
TEST(Heap, SleepsThoughSomeOfItCreep) {
  World world = make_awake(heap_of(16));
  const double moved_m = moved_before_sleep_m(world, 720);
  EXPECT_GT(moved_m, rest_place_share * heap_length_m);
  EXPECT_LT(moved_m, near_place_share * heap_length_m);
}

TEST(SmallHeap, SleepsWhenAllOfItRests) {
  World world = make_awake(heap_of(small_group_bodies_max));
  EXPECT_LT(moved_before_sleep_m(world, 3600), 2.0 * rest_place_share * heap_length_m);
}

TEST(Heap, OfASnapshotGoesOnWithTheSameBits) {
  World world = make_awake(heap_of(16));
  run_on(world, 360);
  std::size_t asleep_in_the_end = 0;
  while (asleep_in_the_end < 16 && world.tick() < 720) {
    World restored = make_awake(heap_of(16));
    ASSERT_TRUE(restored.restore(world.snapshot()).ok());
    ASSERT_EQ(restored.state_hash(), world.state_hash());
    run_on(world, 30);
    run_on(restored, 30, 2);
    ASSERT_EQ(restored.state_hash(), world.state_hash()) << world.tick();
    asleep_in_the_end = count_asleep(restored);
  }
  EXPECT_EQ(asleep_in_the_end, 16U);
}

}  // namespace
}  // namespace pneuma::physics
