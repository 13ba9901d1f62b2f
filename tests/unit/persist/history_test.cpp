// Shows that a running world's past is read from the checkpoint that a tick asks for, up to where its log stands and no
// further, and that what is not kept is said with the tick from which on it is.
#include "persist/history.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace pneuma::persist {
namespace {

// Checkpoints at ticks 10, 20, 20 and 30; a command half-way after each.
class HistoryTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::vector<std::uint64_t> ticks{10, 20, 20, 30};
    for (std::uint64_t sequence = 0; sequence < ticks.size(); ++sequence) {
      const std::uint64_t tick = ticks[sequence];
      if (sequence > 0) {  // the last three are kept
        ASSERT_TRUE(write_checkpoint(*data_dir_, "w", {sequence, tick, "state of " + std::to_string(sequence)}).ok());
      }
      auto log = CommandLog::start(*data_dir_, "w", sequence, Sync::none);
      ASSERT_TRUE(log.ok());
      ASSERT_TRUE(log->write(tick + 5, "after " + std::to_string(sequence)).ok());
      if (sequence + 1 < ticks.size()) {
        ASSERT_TRUE(log->seal(0).ok());
      }
      end_ = log->end();
    }
  }
  base::Result<History> read(std::optional<std::uint64_t> tick, std::uint64_t bytes_max = 1'000'000,
                             std::uint64_t sequence_min = 0) {
    return read_history(*data_dir_, "w", {tick, sequence_min, end_, bytes_max});
  }
  static std::vector<std::string> commands(const History& history) {
    std::vector<std::string> all;
    for (const LogRecord& record : history.records) all.push_back(record.bytes);
    return all;
  }

  support::TemporaryFolder history_folder_;
  base::Result<DataDir> data_dir_ = DataDir::open(history_folder_.path());
  LogEnd end_;
};

TEST_F(HistoryTest, BeginsWithTheOldestCheckpointWhereNoTickIsAskedFor) {
  const auto history = read(std::nullopt);
  ASSERT_TRUE(history.ok()) << history.status().message();
  EXPECT_EQ(history->begin.bytes, "state of 1");
  EXPECT_EQ(commands(*history), (std::vector<std::string>{"after 1", "after 2", "after 3"}));
}

TEST_F(HistoryTest, BeginsWithTheNewestCheckpointBeforeATickOrTheOldestAtIt) {
  EXPECT_EQ(read(100)->begin.bytes, "state of 3");
  EXPECT_EQ(read(30)->begin.bytes, "state of 2") << "a checkpoint at the tick may have what was asked for then";
  EXPECT_EQ(read(25)->begin.bytes, "state of 2");
  EXPECT_EQ(read(20)->begin.bytes, "state of 1");
}

TEST_F(HistoryTest, SaysFromWhichTickOnTheWorldIsKept) {
  const auto history = read(19);
  EXPECT_EQ(history.status().code(), base::StatusCode::not_found);
  EXPECT_NE(history.status().message().find("tick 20"), std::string::npos) << history.status().message();
  EXPECT_EQ(read(19, 1'000'000, 3).status().code(), base::StatusCode::not_found);
  EXPECT_EQ(read(std::nullopt, 1'000'000, 3)->begin.bytes, "state of 3") << "older ones do not lead to the world";
}

TEST_F(HistoryTest, EndsWhereTheLogStood) {
  auto log = CommandLog::resume(*data_dir_, "w", end_, Sync::none);
  ASSERT_TRUE(log.ok());
  ASSERT_TRUE(log->write(40, "later").ok());
  ASSERT_TRUE(log->seal(0).ok());
  EXPECT_EQ(commands(*read(25)), (std::vector<std::string>{"after 2", "after 3"}));
  end_ = log->end();
  EXPECT_EQ(commands(*read(25)).back(), "later");
}

TEST_F(HistoryTest, TakesALaterCheckpointWhereAnOlderOneIsTooLargeAndRefusesNone) {
  const std::uint64_t one_checkpoint_and_log = 150;
  EXPECT_EQ(read(std::nullopt, one_checkpoint_and_log)->begin.bytes, "state of 3");
  EXPECT_EQ(read(std::nullopt, 50).status().code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(read(25, one_checkpoint_and_log).status().code(), base::StatusCode::limit_exceeded);
}

TEST_F(HistoryTest, PassesOverADamagedCheckpoint) {
  ASSERT_TRUE(write_checkpoint(*data_dir_, "w", {2, 25, "state of 2"}).ok());
  ASSERT_TRUE(read(26).ok());
  const std::string path = history_folder_ / "worlds/w/checkpoint-00000000000000000002";
  std::FILE* file = std::fopen(path.c_str(), "r+b");
  ASSERT_NE(file, nullptr);
  std::fseek(file, -1, SEEK_END);
  std::fputc('X', file);
  std::fclose(file);
  EXPECT_EQ(read(26)->begin.bytes, "state of 1");
}

}  // namespace
}  // namespace pneuma::persist
