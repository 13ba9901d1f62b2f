// Shows that committed commands are read back in order through every log since a checkpoint, and that a log cut at any
// length, or with any bit changed, gives the whole records before the damage, and a report.
#include "persist/command_log.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "persist/world_files.h"
#include "support/temporary_folder.h"

namespace pneuma::persist {
namespace {

class CommandLogTest : public testing::Test {
 protected:
  CommandLog start(std::uint64_t sequence, Sync sync = Sync::none) {
    auto log = CommandLog::start(*data_dir_, "w", sequence, sync);
    EXPECT_TRUE(log.ok()) << log.status().message();
    return std::move(*log);
  }
  void write_log(std::uint64_t sequence, const std::vector<LogRecord>& records) {
    CommandLog log = start(sequence);
    for (const LogRecord& record : records) ASSERT_TRUE(log.append(record.tick, record.bytes).ok());
    ASSERT_TRUE(log.commit().ok());
  }
  Replay read(std::uint64_t sequence) {
    auto replay = read_commands(*data_dir_, "w", sequence);
    EXPECT_TRUE(replay.ok()) << replay.status().message();
    return std::move(*replay);
  }
  std::string path(std::uint64_t sequence) { return numbered_file(folder_ / "worlds/w", log_prefix, sequence); }

  support::TemporaryFolder folder_;
  base::Result<DataDir> data_dir_ = DataDir::open(folder_.path());
};

std::string contents(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void overwrite(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST_F(CommandLogTest, ReadsBackCommittedRecordsInOrder) {
  CommandLog log = start(3, Sync::every_commit);
  ASSERT_TRUE(log.append(7, "one").ok());
  ASSERT_TRUE(log.append(7, std::string("\0two", 4)).ok());
  ASSERT_TRUE(log.commit().ok());
  ASSERT_TRUE(log.append(9, "").ok());
  ASSERT_TRUE(log.commit().ok());
  ASSERT_TRUE(log.append(10, "never committed").ok());
  const Replay replay = read(3);
  ASSERT_EQ(replay.records.size(), 3U);
  EXPECT_EQ(replay.records[0].tick, 7U);
  EXPECT_EQ(replay.records[0].bytes, "one");
  EXPECT_EQ(replay.records[1].bytes, std::string("\0two", 4));
  EXPECT_EQ(replay.records[2].tick, 9U);
  EXPECT_EQ(replay.records[2].bytes, "");
  EXPECT_TRUE(replay.cut.empty());
}

TEST_F(CommandLogTest, NoLogIsNoCommands) {
  EXPECT_TRUE(read(0).records.empty());
}

TEST_F(CommandLogTest, GoesOnThroughLaterLogs) {
  write_log(1, {{1, "before the checkpoint"}});
  write_log(2, {{5, "a"}});
  write_log(3, {});
  write_log(4, {{9, "b"}});
  const Replay replay = read(2);
  ASSERT_EQ(replay.records.size(), 2U);
  EXPECT_EQ(replay.records[0].bytes, "a");
  EXPECT_EQ(replay.records[1].bytes, "b");
}

TEST_F(CommandLogTest, StopsWhereALogIsMissing) {
  write_log(2, {{5, "a"}});
  write_log(4, {{9, "b"}});
  const Replay replay = read(2);
  EXPECT_EQ(replay.records.size(), 1U);
  ASSERT_EQ(replay.cut.size(), 1U);
  EXPECT_EQ(replay.cut[0].where(), path(4));
}

TEST_F(CommandLogTest, CutAtAnyLengthGivesTheWholeRecordsBefore) {
  write_log(0, {{1, "first"}, {2, "second"}, {3, "third"}});
  const std::string whole = contents(path(0));
  const std::size_t record_bytes = 16;
  const std::vector<std::size_t> ends{24, 24 + record_bytes + 5, 24 + 2 * record_bytes + 11, whole.size()};
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    overwrite(path(0), whole.substr(0, length));
    const Replay replay = read(0);
    std::size_t expected = 0;
    while (expected + 1 < ends.size() && ends[expected + 1] <= length) ++expected;
    EXPECT_EQ(replay.records.size(), expected) << length;
    const bool at_end = std::find(ends.begin(), ends.end(), length) != ends.end();
    EXPECT_EQ(replay.cut.empty(), at_end) << length;
  }
}

TEST_F(CommandLogTest, AnyChangedBitEndsTheReplayThere) {
  write_log(0, {{1, "first"}, {2, "second"}});
  const std::string whole = contents(path(0));
  const std::size_t second_at = 24 + 16 + 5;
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    overwrite(path(0), damaged);
    const Replay replay = read(0);
    EXPECT_EQ(replay.records.size(), bit / 8 < second_at ? 0U : 1U) << bit;
    EXPECT_EQ(replay.cut.size(), 1U) << bit;
  }
}

TEST_F(CommandLogTest, DamageInOneLogHidesTheNext) {
  write_log(0, {{1, "first"}});
  write_log(1, {{2, "second"}});
  overwrite(path(0), contents(path(0)).substr(0, 30));
  EXPECT_TRUE(read(0).records.empty());
  EXPECT_EQ(read(1).records.size(), 1U);
}

TEST_F(CommandLogTest, WaitingBytesAreBounded) {
  CommandLog log = start(0);
  const std::string large(base::log_pending_bytes_max / 2, 'x');
  EXPECT_TRUE(log.append(1, large).ok());
  EXPECT_EQ(log.append(1, large).code(), base::StatusCode::limit_exceeded);
  EXPECT_TRUE(log.commit().ok());
  EXPECT_TRUE(log.append(2, large).ok());
}

TEST_F(CommandLogTest, GrowsToItsLimitAndIsReadBackWhole) {
  const std::uint64_t bytes_max = 24 + 2 * (16 + 5);  // the header and two records
  auto log = CommandLog::start(*data_dir_, "w", 0, Sync::none, bytes_max);
  ASSERT_TRUE(log.ok());
  EXPECT_TRUE(log->append(1, "first").ok());
  EXPECT_TRUE(log->commit().ok());
  EXPECT_EQ(log->append(2, "larger").code(), base::StatusCode::limit_exceeded);
  EXPECT_TRUE(log->append(2, "other").ok());
  EXPECT_EQ(log->append(3, "").code(), base::StatusCode::limit_exceeded);  // what waits counts too
  EXPECT_TRUE(log->commit().ok());
  EXPECT_EQ(std::filesystem::file_size(path(0)), bytes_max);
  EXPECT_EQ(read(0).records.size(), 2U);
}

}  // namespace
}  // namespace pneuma::persist
