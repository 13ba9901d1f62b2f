// Shows that residuals of every size read back at every level, that they cost about what information theory says, and
// that no words whatever take the reader past its bounds.
#include "codec/entropy_coder.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace pneuma::codec {
namespace {

std::string coded(const std::vector<Triple>& triples) {
  std::string bytes;
  SymbolWriter().write(triples, bytes);
  return bytes;
}

std::vector<std::uint16_t> words_of(const std::string& bytes) {
  std::vector<std::uint16_t> words;
  codec::words_of(bytes, words);
  return words;
}

TEST(ResidualTables, FrequenciesAddUp) {
  for (const ResidualTable& table : residual_tables()) {
    std::uint32_t sum = 0;
    for (const auto& range : table.ranges) {
      EXPECT_EQ(range.begin, sum);
      sum += range.frequency;
    }
    EXPECT_EQ(sum, probability_total);
    EXPECT_GT(table.ranges[range_of(0)].frequency, 0);
    EXPECT_GT(table.ranges[range_of(escape)].frequency, 0);
  }
}

TEST(ResidualTables, LevelsAndSizesAreInverse) {
  for (std::uint32_t level = 0; level <= level_max; ++level) {
    EXPECT_EQ(level_of(size_of(level)), level);
    EXPECT_EQ(level_of(size_of(level + 1) - 1), level);
  }
}

TEST(ResidualTables, ReciprocalsDivideEveryStateThatTheyAreUsedFor) {
  std::mt19937 random(1);
  for (const ResidualTable& table : residual_tables()) {
    for (const auto& range : table.ranges) {
      const std::uint64_t end = std::uint64_t{range.frequency} << (32 - probability_bits);
      const auto expect_quotient = [&](std::uint64_t state) {
        EXPECT_EQ((state * range.reciprocal) >> range.reciprocal_shift, state / range.frequency) << range.frequency;
      };
      for (int i = 0; i < 100 && range.frequency > 0; ++i) {
        const std::uint64_t quotient = random() % (1U << (32 - probability_bits));
        expect_quotient(quotient * range.frequency);
        expect_quotient(quotient * range.frequency + range.frequency - 1);
        expect_quotient(end - 1);
      }
    }
  }
}

TEST(EntropyCoder, EveryLevelTakesEveryResidual) {
  const std::vector<std::int32_t> values{0,
                                         -1,
                                         1,
                                         31,
                                         -31,
                                         32,
                                         -32,
                                         1'000,
                                         -70'000,
                                         1 << 24,
                                         std::numeric_limits<std::int32_t>::max(),
                                         std::numeric_limits<std::int32_t>::min()};
  std::vector<Triple> triples;
  for (std::uint32_t level = 0; level <= level_max; ++level) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      triples.push_back({values[i], values[(i + 1) % values.size()], values[(i + 5) % values.size()], level});
    }
  }
  const auto words = words_of(coded(triples));
  SymbolReader reader(words);
  std::vector<std::uint8_t> levels;
  for (const Triple& triple : triples) levels.push_back(static_cast<std::uint8_t>(triple.level));
  std::vector<Lanes> read(triples.size());
  const std::span all(levels);
  reader.take(all.first(1), std::span(read).first(1));
  reader.take(all.subspan(1), std::span(read).subspan(1));
  for (std::size_t i = 0; i < triples.size(); ++i) {
    const Triple& triple = triples[i];
    ASSERT_EQ(static_cast<std::int32_t>(read[i].v[0]), triple.x) << "level " << triple.level;
    ASSERT_EQ(static_cast<std::int32_t>(read[i].v[1]), triple.y) << "level " << triple.level;
    ASSERT_EQ(static_cast<std::int32_t>(read[i].v[2]), triple.z) << "level " << triple.level;
  }
  EXPECT_FALSE(reader.failed());
  EXPECT_TRUE(reader.at_end());
}

TEST(EntropyCoder, NothingTakesNoBytes) {
  EXPECT_TRUE(coded({}).empty());
  const auto words = words_of("");
  const SymbolReader reader(words);
  EXPECT_FALSE(reader.failed());
  EXPECT_TRUE(reader.at_end());
}

TEST(EntropyCoder, CostIsNearTheEntropyOfTheTables) {
  constexpr int count = 20'000;
  for (const std::uint32_t level : {12U, 20U, 28U, 31U}) {
    std::mt19937 random(level);
    double entropy_bits = 0.0;
    const auto draw = [&](std::uint32_t table_index) {
      const ResidualTable& table = residual_tables()[table_index];
      const std::uint32_t slot = table.slots[random() % probability_total];
      const std::int32_t residual = static_cast<std::int32_t>(slot) >> slot_residual_shift;
      return residual == escape ? 0 : residual;  // an escape's own bits are not the table's
    };
    const PointModel model = point_models[level];
    for (const std::uint32_t table_index : {model.x_table, model.yz_table, model.yz_table}) {
      for (const auto& range : residual_tables()[table_index].ranges) {
        const double share = range.frequency / double{probability_total};
        if (share > 0.0) entropy_bits -= share * std::log2(share);
      }
    }
    std::vector<Triple> triples;
    while (triples.size() < count) {
      triples.push_back({draw(model.x_table), draw(model.yz_table), draw(model.yz_table), level});
    }
    const double bits = 8.0 * static_cast<double>(coded(triples).size()) / count;
    EXPECT_NEAR(bits, entropy_bits, 0.05 * entropy_bits) << "level " << level;
  }
}

TEST(EntropyCoder, AnyWordsEndInTime) {
  std::mt19937 random(7);
  for (int round = 0; round < 2'000; ++round) {
    std::string bytes(2 * (random() % 40), '\0');
    for (char& byte : bytes) byte = static_cast<char>(static_cast<unsigned char>(random()));
    const auto words = words_of(bytes);
    if (!bytes.empty() && bytes.size() < state_count * state_bytes) continue;
    SymbolReader reader(words);
    std::vector<std::uint8_t> levels(1'000);
    for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(random() % (level_max + 1));
    std::vector<Lanes> triples(levels.size());
    reader.take(levels, triples);
  }
}

}  // namespace
}  // namespace pneuma::codec
