// Shows that rows are put into turns: none is lost, and within a turn no two move a vertex in common.
#include "physics/contact/row_turns.h"

#include <algorithm>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

using Corner = std::pair<std::uint32_t, std::uint32_t>;

std::vector<SurfaceBody> bodies_of(std::size_t count, std::uint32_t vertices, bool with_pins) {
  std::vector<SurfaceBody> bodies(count);
  for (SurfaceBody& body : bodies) {
    body.inverse_masses_1_kg.assign(vertices, 1.0);
    if (with_pins) body.inverse_masses_1_kg[0] = 0.0;
  }
  return bodies;
}

std::vector<ContactRow> rows_between(std::span<const SurfaceBody> bodies, std::size_t count, std::mt19937& random) {
  std::vector<ContactRow> rows(count);
  for (std::size_t r = 0; r < count; ++r) {
    rows[r].key.features = r;
    for (Support* side : {&rows[r].first, &rows[r].second}) {
      side->body = static_cast<std::uint32_t>(random() % bodies.size());
      const auto vertices = static_cast<std::uint32_t>(bodies[side->body].inverse_masses_1_kg.size());
      const std::size_t corners = 1 + random() % 3;
      for (std::size_t i = 0; i < corners; ++i) side->add(static_cast<std::uint32_t>(random() % vertices), 0.3);
    }
  }
  return rows;
}

std::set<Corner> moved_by(const ContactRow& row, std::span<const SurfaceBody> bodies) {
  std::set<Corner> corners;
  for (const Support* side : {&row.first, &row.second}) {
    for (std::uint32_t i = 0; i < side->count; ++i) {
      if (bodies[side->body].inverse_masses_1_kg[side->vertices[i]] > 0.0) {
        corners.emplace(side->body, side->vertices[i]);
      }
    }
  }
  return corners;
}

// How many turns the rows take, in the order that they have, if each one begins where two would share a vertex.
std::size_t turns_of(std::span<const ContactRow> rows, std::span<const SurfaceBody> bodies) {
  std::size_t turns = rows.empty() ? 0 : 1;
  std::set<Corner> taken;
  for (const ContactRow& row : rows) {
    std::set<Corner> corners = moved_by(row, bodies);
    if (std::ranges::any_of(corners, [&](const Corner& corner) { return taken.contains(corner); })) {
      ++turns;
      taken.clear();
    }
    taken.merge(corners);
  }
  return turns;
}

TEST(RowTurns, KeepAllRowsAndNeedNoMoreTurnsThanTheBusiestNeighbourhood) {
  std::mt19937 random(8);
  RowTurns turns;
  for (int i = 0; i < 200; ++i) {
    const auto vertices = static_cast<std::uint32_t>(20 + random() % 60);
    const std::size_t rows_wanted = random() % 120;
    const std::vector<SurfaceBody> bodies = bodies_of(1 + random() % 4, vertices, i % 2 == 0);
    std::vector<ContactRow> rows = rows_between(bodies, rows_wanted, random);
    std::size_t most_neighbours = 0;
    for (const ContactRow& row : rows) {
      const std::set<Corner> corners = moved_by(row, bodies);
      const auto neighbours = std::ranges::count_if(rows, [&](const ContactRow& other) {
        const std::set<Corner> its = moved_by(other, bodies);
        return std::ranges::any_of(its, [&](const Corner& corner) { return corners.contains(corner); });
      });
      most_neighbours = std::max(most_neighbours, static_cast<std::size_t>(neighbours));
    }
    const std::size_t count = rows.size();
    turns.sort(rows, bodies);
    EXPECT_LE(turns_of(rows, bodies), std::max<std::size_t>(1, most_neighbours));
    std::set<std::uint64_t> seen;
    for (const ContactRow& row : rows) seen.insert(row.key.features);
    EXPECT_EQ(rows.size(), count);
    EXPECT_EQ(seen.size(), count);
  }
}

TEST(RowTurns, GiveTheSameOrderWhateverWasSortedBefore) {
  std::mt19937 random(9);
  const std::vector<SurfaceBody> bodies = bodies_of(3, 40, false);
  RowTurns used;
  std::vector<ContactRow> others = rows_between(bodies, 90, random);
  used.sort(others, bodies);
  std::vector<ContactRow> rows = rows_between(bodies, 70, random);
  std::vector<ContactRow> again = rows;
  used.sort(rows, bodies);
  RowTurns().sort(again, bodies);
  for (std::size_t r = 0; r < rows.size(); ++r) EXPECT_EQ(rows[r].key, again[r].key);
}

// Whatever two rows have in common beyond the last turn, each is solved.
TEST(RowTurns, HoldMoreRowsOfOneVertexThanThereAreTurns) {
  const std::vector<SurfaceBody> bodies = bodies_of(2, 3, false);
  std::vector<ContactRow> rows(200);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    rows[r].key.features = r;
    rows[r].first.add(0, 1.0);
    rows[r].second.body = 1;
    rows[r].second.add(0, 1.0);
  }
  RowTurns().sort(rows, bodies);
  std::set<std::uint64_t> seen;
  for (const ContactRow& row : rows) seen.insert(row.key.features);
  EXPECT_EQ(seen.size(), 200U);
}

}  // namespace
}  // namespace pneuma::physics
