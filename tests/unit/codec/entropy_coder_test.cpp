// Shows that residuals of every size read back at every level, that they cost about what information theory says, and
// that no words whatever take the reader past its bounds.
#include "codec/entropy_coder.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace pneuma::codec {
namespace {

std::string coded(const std::vector<ResidualModel>& models, const std::vector<std::int32_t>& residuals) {
  SymbolWriter writer;
  for (std::size_t i = 0; i < models.size(); ++i) writer.put(models[i], residuals[i]);
  std::string bytes;
  writer.finish(bytes);
  return bytes;
}

void expect_reads_back(const std::vector<ResidualModel>& models, const std::vector<std::int32_t>& residuals) {
  const auto words = words_of(coded(models, residuals));
  SymbolReader reader(words);
  for (std::size_t i = 0; i < models.size(); ++i) {
    ASSERT_EQ(reader.take(models[i]), residuals[i]) << "residual " << i;
    ASSERT_FALSE(reader.failed());
  }
  EXPECT_TRUE(reader.at_end());
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
  EXPECT_LT(level_of(std::numeric_limits<std::uint32_t>::max() - 4), point_models.size());
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
  std::vector<ResidualModel> models;
  std::vector<std::int32_t> residuals;
  for (const PointModel& model : point_models) {
    for (const std::int32_t value : values) {
      models.push_back(model.x);
      residuals.push_back(value);
    }
  }
  expect_reads_back(models, residuals);
}

TEST(EntropyCoder, NothingTakesNoBytes) {
  EXPECT_TRUE(coded({}, {}).empty());
  const auto words = words_of("");
  const SymbolReader reader(words);
  EXPECT_FALSE(reader.failed());
  EXPECT_TRUE(reader.at_end());
}

TEST(EntropyCoder, CostIsNearTheEntropyOfTheTable) {
  constexpr int count = 20'000;
  for (const std::uint32_t level : {8U, 16U, 24U, 31U}) {
    const ResidualTable& table = residual_tables()[level];
    std::mt19937 random(level);
    double entropy_bits = 0.0;
    for (const auto& range : table.ranges) {
      const double share = range.frequency / double{probability_total};
      if (share > 0.0) entropy_bits -= share * std::log2(share);
    }
    std::vector<std::int32_t> residuals;
    while (residuals.size() < count) {
      const std::uint32_t slot = table.slots[random() % probability_total];
      const std::int32_t residual = static_cast<std::int32_t>(slot) >> slot_residual_shift;
      residuals.push_back(residual == escape ? 0 : residual);  // an escape's own bits are not the table's
    }
    const std::vector<ResidualModel> models(count, ResidualModel{static_cast<std::uint8_t>(level), 0});
    const double bits = 8.0 * static_cast<double>(coded(models, residuals).size()) / count;
    EXPECT_NEAR(bits, entropy_bits, 0.05 * entropy_bits) << "level " << level;
  }
}

TEST(EntropyCoder, AnyWordsEndInTime) {
  std::mt19937 random(7);
  for (int round = 0; round < 2'000; ++round) {
    std::string bytes(2 * (random() % 40), '\0');
    for (char& byte : bytes) byte = static_cast<char>(static_cast<unsigned char>(random()));
    const auto words = words_of(bytes);
    if (!bytes.empty() && bytes.size() < 2 * state_bytes) continue;
    SymbolReader reader(words);
    for (int vertex = 0; vertex < 1'000 && !reader.failed(); ++vertex) {
      const PointModel model = point_models[random() % point_models.size()];
      (void)reader.take(model.x);
      (void)reader.take(model.yz);
      (void)reader.take(model.yz);
    }
  }
}

}  // namespace
}  // namespace pneuma::codec
