// Shows that every vertex has a slot, that what a slot refers to comes before it or is next to it, and that lists of
// triangles that are no mesh, as a client may be sent, do no harm.
#include "codec/mesh_order.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "unit/codec/meshes.h"

namespace pneuma::codec {
namespace {

/// Without the slot itself, which fills up a short ring.
std::vector<std::uint32_t> ring_of(const MeshOrder& order, std::uint32_t slot) {
  std::vector<std::uint32_t> ring(order.rings[slot].begin(), order.rings[slot].end());
  for (std::uint32_t i = order.ring_rest_begins[slot]; i < order.ring_rest_begins[slot + 1]; ++i) {
    ring.push_back(order.ring_rests[i]);
  }
  std::erase(ring, slot);
  return ring;
}

void expect_sound(const MeshOrder& order, std::uint32_t vertex_count) {
  std::vector<std::uint32_t> sorted = order.vertices;
  std::ranges::sort(sorted);
  std::vector<std::uint32_t> all(vertex_count);
  std::iota(all.begin(), all.end(), 0U);
  ASSERT_EQ(sorted, all);
  ASSERT_EQ(order.parents.size(), vertex_count);
  ASSERT_EQ(order.rings.size(), vertex_count);
  ASSERT_EQ(order.ring_rest_begins.size(), vertex_count + 1U);
  ASSERT_EQ(order.ring_rest_begins.back(), order.ring_rests.size());
  for (std::uint32_t slot = 0; slot < vertex_count; ++slot) {
    // Entry slot + 1 is the slot's own.
    const auto& [parents, count] = order.parents[slot];
    ASSERT_LE(count, parents_max);
    for (std::size_t i = 0; i < parents_max; ++i) {
      EXPECT_LE(parents[i], slot);
      EXPECT_EQ(parents[i] != 0, i < count);
    }
    std::set<std::uint32_t> ring;
    for (const std::uint32_t neighbour : ring_of(order, slot)) {
      EXPECT_LT(neighbour, vertex_count);
      EXPECT_TRUE(ring.insert(neighbour).second);
    }
  }
}

TEST(MeshOrder, TetrahedronIsByHand) {
  const MeshOrder order = make_mesh_order(4, tetrahedron);
  expect_sound(order, 4);
  EXPECT_EQ(order.vertices, (std::vector<std::uint32_t>{0, 1, 2, 3}));
  using Six = std::array<std::uint32_t, parents_max>;
  EXPECT_EQ(order.parents[0].slots, Six{});
  EXPECT_EQ(order.parents[1].slots, (Six{1}));
  EXPECT_EQ(order.parents[2].slots, (Six{1, 2}));
  EXPECT_EQ(order.parents[3].slots, (Six{1, 2, 3}));
}

TEST(MeshOrder, OnASheetAQuarterComesAfterAllNeighboursAndHardlyAnyAfterItsOwnParent) {
  const MeshOrder order = *sheet_order(20, 20);
  expect_sound(order, 400);
  std::size_t after_all = 0;
  std::size_t after_parent = 0;
  for (std::uint32_t slot = 0; slot < 400; ++slot) {
    const auto& parents = order.parents[slot];
    after_all += parents.count == ring_of(order, slot).size() ? 1 : 0;
    after_parent += std::ranges::find(parents.slots, slot) != parents.slots.end() && slot > 0 ? 1 : 0;
  }
  EXPECT_GE(after_all, 400U / 4U);
  EXPECT_LE(after_parent, 400U / 20U);
}

TEST(MeshOrder, PartsAndLooseVerticesComeSideBySide) {
  const std::vector<std::uint32_t> indices{5, 6, 4, 1, 2, 0};
  const MeshOrder order = make_mesh_order(8, indices);
  expect_sound(order, 8);
  // Loose ones and the first of each part, then what has been next to them.
  EXPECT_EQ(order.vertices, (std::vector<std::uint32_t>{0, 3, 4, 7, 1, 5, 2, 6}));
}

TEST(MeshOrder, AnyTrianglesWillDo) {
  std::mt19937 random(3);
  for (int round = 0; round < 500; ++round) {
    const auto vertex_count = static_cast<std::uint32_t>(1 + random() % 12);
    std::vector<std::uint32_t> indices(3 * (random() % 40));
    for (std::uint32_t& index : indices) index = static_cast<std::uint32_t>(random() % vertex_count);
    expect_sound(make_mesh_order(vertex_count, indices), vertex_count);
  }
}

TEST(MeshOrder, NoSlotHasAParentInItsRun) {
  const MeshOrder order = *sheet_order(12, 12);
  std::uint32_t begin = 0;
  for (const std::uint32_t end : order.run_ends) {
    ASSERT_LT(begin, end);
    for (std::uint32_t slot = begin; slot < end; ++slot) {
      for (const std::uint32_t entry : order.parents[slot].slots) EXPECT_LE(entry, begin);
    }
    begin = end;
  }
  EXPECT_EQ(begin, order.size());
  EXPECT_LT(order.run_ends.size(), order.size() / 2);
}

TEST(MeshOrder, FanOfTheMostFacesIsSound) {
  constexpr std::uint32_t rim = 65'535;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 1; i < rim; ++i) indices.insert(indices.end(), {0, i, i + 1});
  expect_sound(make_mesh_order(rim + 1, indices), rim + 1);
}

}  // namespace
}  // namespace pneuma::codec
