// Shows that groups of rows are the components of the graph that rows make of the bodies which give way, found here by
// spreading from body to body; and that neither they nor the order of their rows depend on the order of what came in.
#include "physics/contact/groups.h"

#include <algorithm>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

/// The bodies that rows tie to `body`, over those that yield.
std::set<std::uint32_t> tied_to(std::uint32_t body, std::span<const ContactRow> rows,
                                std::span<const std::uint8_t> yields) {
  std::set<std::uint32_t> tied{body};
  for (std::size_t before = 0; before != tied.size();) {
    before = tied.size();
    for (const ContactRow& row : rows) {
      const std::uint32_t a = row.first.body;
      const std::uint32_t b = row.second.body;
      if (yields[a] == 0 || yields[b] == 0) continue;
      if (tied.contains(a)) tied.insert(b);
      if (tied.contains(b)) tied.insert(a);
    }
  }
  return tied;
}

TEST(JoinedBodies, AreNamedByTheLowestInWhateverOrderTheyAreJoined) {
  constexpr std::uint32_t bodies = 9;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs{{7, 3}, {3, 5}, {5, 7}, {8, 1}, {2, 2}};
  std::mt19937 random(1);
  JoinedBodies joined;
  for (int round = 0; round < 20; ++round) {
    std::ranges::shuffle(pairs, random);
    joined.begin(bodies);
    for (const auto& [a, b] : pairs) joined.join(a, b);
    std::vector<std::uint32_t> lowest;
    for (std::uint32_t i = 0; i < bodies; ++i) lowest.push_back(joined.lowest_with(i));
    EXPECT_EQ(lowest, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 3, 6, 3, 1}));
  }
}

TEST(Groups, AreTheBodiesThatRowsTieTogetherInTheOrderOfKeysFromAnyOrder) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    constexpr std::uint32_t bodies = 30;
    std::vector<std::uint8_t> yields(bodies);
    for (std::uint8_t& yield : yields) yield = random() % 5 == 0 ? 0 : 1;
    yields[0] = 1;
    std::vector<ContactRow> rows;
    for (std::uint32_t i = 0; i < 25; ++i) {
      ContactRow& row = rows.emplace_back();
      row.first.body = static_cast<std::uint32_t>(random() % bodies);
      row.second.body = static_cast<std::uint32_t>(random() % bodies);
      row.key = {random() % 3, i};
      if (yields[row.first.body] == 0 && yields[row.second.body] == 0) row.second.body = 0;
    }
    const std::vector<ContactRow> drawn = rows;
    const auto yielding = [&](const ContactRow& row) {
      return yields[row.first.body] != 0 ? row.first.body : row.second.body;
    };
    std::vector<RowGroup> groups;
    group_rows(rows, yields, groups);
    ASSERT_EQ(rows.size(), drawn.size());
    std::size_t end = 0;
    std::set<std::set<std::uint32_t>> seen;
    for (const RowGroup& group : groups) {
      EXPECT_EQ(group.begin, end);
      ASSERT_GT(group.end, group.begin);
      end = group.end;
      const std::set<std::uint32_t> tied = tied_to(yielding(rows[group.begin]), drawn, yields);
      EXPECT_TRUE(seen.insert(tied).second) << "two groups of the same bodies";
      for (std::size_t i = group.begin; i < group.end; ++i) {
        EXPECT_TRUE(tied.contains(yielding(rows[i])));
        if (i > group.begin) {
          EXPECT_LT(rows[i - 1].key, rows[i].key);
        }
      }
    }
    EXPECT_EQ(end, rows.size());

    std::vector<ContactRow> shuffled = drawn;
    std::ranges::shuffle(shuffled, random);
    group_rows(shuffled, yields, groups);
    for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i].key, shuffled[i].key) << i;
  }
}

}  // namespace
}  // namespace pneuma::physics
