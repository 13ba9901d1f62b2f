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

void expect_sound(const MeshOrder& order, std::uint32_t vertex_count) {
  std::vector<std::uint32_t> sorted = order.vertices;
  std::ranges::sort(sorted);
  std::vector<std::uint32_t> all(vertex_count);
  std::iota(all.begin(), all.end(), 0U);
  ASSERT_EQ(sorted, all);
  ASSERT_EQ(order.parents.size(), vertex_count);
  ASSERT_EQ(order.parallelograms.size(), vertex_count);
  ASSERT_EQ(order.ring_begins.size(), vertex_count + 1U);
  ASSERT_EQ(order.ring_begins.back(), order.rings.size());
  for (std::uint32_t slot = 0; slot < vertex_count; ++slot) {
    // Entry slot + 1 is the slot's own.
    for (const std::uint32_t parent : order.parents[slot]) EXPECT_LE(parent, slot);
    for (const std::uint32_t corner : order.parallelograms[slot]) EXPECT_LE(corner, slot);
    for (std::uint32_t i = order.ring_begins[slot]; i < order.ring_begins[slot + 1]; ++i) {
      EXPECT_LT(order.rings[i], vertex_count);
      EXPECT_NE(order.rings[i], slot);
    }
  }
}

TEST(MeshOrder, TetrahedronIsByHand) {
  const MeshOrder order = make_mesh_order(4, tetrahedron);
  expect_sound(order, 4);
  EXPECT_EQ(order.vertices, (std::vector<std::uint32_t>{0, 1, 2, 3}));
  using Four = std::array<std::uint32_t, 4>;
  EXPECT_EQ(order.parents[0], (Four{0, 0, 0, 0}));
  EXPECT_EQ(order.parents[1], (Four{1, 1, 1, 1}));
  EXPECT_EQ(order.parents[2], (Four{2, 1, 2, 1}));
  EXPECT_EQ(order.parents[3], (Four{3, 2, 1, 3}));
  using Six = std::array<std::uint32_t, 6>;
  EXPECT_EQ(order.parallelograms[2], (Six{2, 0, 1, 0, 0, 0}));  // no face before it: the mean of two parents
  EXPECT_EQ(order.parallelograms[3], (Six{1, 2, 3, 1, 3, 2}));  // across 0-1 is 2, across 2-0 is 1
}

TEST(MeshOrder, OnASheetMostVerticesHaveAParallelogram) {
  const MeshOrder order = *sheet_order(20, 20);
  expect_sound(order, 400);
  const auto with = std::ranges::count_if(order.parallelograms, [](const auto& p) { return p[4] != 0; });
  EXPECT_GE(with, 350);
}

TEST(MeshOrder, PartsAndLooseVerticesComeOneAfterTheOther) {
  const std::vector<std::uint32_t> indices{5, 6, 4, 1, 2, 0};
  const MeshOrder order = make_mesh_order(8, indices);
  expect_sound(order, 8);
  EXPECT_EQ(order.vertices, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7}));
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

TEST(MeshOrder, FanOfTheMostFacesIsSound) {
  constexpr std::uint32_t rim = 65'535;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 1; i < rim; ++i) indices.insert(indices.end(), {0, i, i + 1});
  expect_sound(make_mesh_order(rim + 1, indices), rim + 1);
}

}  // namespace
}  // namespace pneuma::codec
