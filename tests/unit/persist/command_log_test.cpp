// Shows that what was written is read back in order through every log since a checkpoint, that a log cut at any length
// gives the whole records before the cut, and that any changed bit, and any log that is missing or lacks its end, is
// told as damage.
#include "persist/command_log.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "base/byte_order.h"
#include "base/crc32c.h"
#include "base/limits.h"
#include "persist/world_files.h"
#include "support/temporary_folder.h"

namespace pneuma::persist {
namespace {

constexpr std::size_t log_head_bytes = 24;
constexpr std::size_t record_head_bytes = 20;

class CommandLogTest : public testing::Test {
 protected:
  CommandLog start(std::uint64_t sequence, Sync sync = Sync::none) {
    auto log = CommandLog::start(*data_dir_, "w", sequence, sync);
    EXPECT_TRUE(log.ok()) << log.status().message();
    return std::move(*log);
  }
  CommandLog write_log(std::uint64_t sequence, const std::vector<LogRecord>& records) {
    CommandLog log = start(sequence);
    for (const LogRecord& record : records) EXPECT_TRUE(log.write(record.tick, record.bytes).ok());
    return log;
  }
  void write_sealed_log(std::uint64_t sequence, const std::vector<LogRecord>& records) {
    ASSERT_TRUE(write_log(sequence, records).seal(9).ok());
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

bool is_whole(const Replay& replay) {
  return !replay.torn && !replay.damage;
}

TEST_F(CommandLogTest, ReadsBackRecordsInOrder) {
  CommandLog log = start(3, Sync::every_record);
  ASSERT_TRUE(log.write(7, "one").ok());
  ASSERT_TRUE(log.write(7, std::string("\0two", 4)).ok());
  ASSERT_TRUE(log.write(9, "three").ok());
  const Replay replay = read(3);
  ASSERT_EQ(replay.records.size(), 3U);
  EXPECT_EQ(replay.records[0].tick, 7U);
  EXPECT_EQ(replay.records[0].bytes, "one");
  EXPECT_EQ(replay.records[1].bytes, std::string("\0two", 4));
  EXPECT_EQ(replay.records[2].tick, 9U);
  EXPECT_EQ(replay.records[2].bytes, "three");
  EXPECT_TRUE(is_whole(replay));
}

TEST_F(CommandLogTest, ARecordThatIsTakenBackNeverWas) {
  CommandLog log = write_log(0, {{1, "first"}, {2, "refused after all, and long"}});
  ASSERT_TRUE(log.take_back().ok());
  EXPECT_EQ(read(0).records.size(), 1U);
  EXPECT_TRUE(is_whole(read(0)));
  ASSERT_TRUE(log.write(3, "third").ok());
  const Replay replay = read(0);
  ASSERT_EQ(replay.records.size(), 2U);
  EXPECT_EQ(replay.records[1].bytes, "third");
  EXPECT_TRUE(is_whole(replay));
}

TEST_F(CommandLogTest, GoesOnWhereItEnded) {
  write_log(0, {{1, "first"}});
  overwrite(path(0), contents(path(0)) + "torn");
  const Replay before = read(0);
  EXPECT_TRUE(before.torn);
  ASSERT_TRUE(before.end);
  auto log = CommandLog::resume(*data_dir_, "w", *before.end, Sync::none);
  ASSERT_TRUE(log.ok()) << log.status().message();
  ASSERT_TRUE(log->write(2, "second").ok());
  ASSERT_TRUE(log->seal(2).ok());
  write_log(1, {{3, "third"}});
  const Replay replay = read(0);
  EXPECT_TRUE(is_whole(replay)) << replay.damage.value_or(base::Status()).message();
  EXPECT_EQ(replay.records.size(), 3U);
}

TEST_F(CommandLogTest, GoesOnThroughLaterLogs) {
  write_sealed_log(1, {{1, "before the checkpoint"}});
  write_sealed_log(2, {{5, "a"}});
  write_sealed_log(3, {});
  write_log(4, {{9, "b"}});
  const Replay replay = read(2);
  ASSERT_EQ(replay.records.size(), 2U);
  EXPECT_EQ(replay.records[0].bytes, "a");
  EXPECT_EQ(replay.records[1].bytes, "b");
  EXPECT_TRUE(is_whole(replay));
}

// A log is begun before the one before it is sealed: the process may end in between.
TEST_F(CommandLogTest, AnEmptyLogMayFollowOneWithoutItsEnd) {
  write_log(2, {{5, "a"}});
  write_log(3, {});
  EXPECT_TRUE(is_whole(read(2)));
  EXPECT_EQ(read(2).records.size(), 1U);
  write_log(3, {{6, "b"}});
  const Replay replay = read(2);
  ASSERT_TRUE(replay.damage);
  EXPECT_EQ(replay.damage->where(), path(2));
  EXPECT_EQ(replay.records.size(), 1U);
}

TEST_F(CommandLogTest, AMissingLogIsDamage) {
  const Replay none = read(0);
  ASSERT_TRUE(none.damage) << "a log follows each checkpoint";
  EXPECT_EQ(none.damage->where(), path(0));

  write_sealed_log(2, {{5, "a"}});
  write_log(4, {{9, "b"}});
  const Replay middle = read(2);
  EXPECT_EQ(middle.records.size(), 1U);
  ASSERT_TRUE(middle.damage);
  EXPECT_EQ(middle.damage->where(), path(3));

  std::filesystem::remove(path(4));
  const Replay last = read(2);
  ASSERT_TRUE(last.damage) << "the seal says that another one goes on";
  EXPECT_EQ(last.damage->where(), path(3));
}

TEST_F(CommandLogTest, CutAtAnyLengthGivesTheWholeRecordsBefore) {
  write_log(0, {{1, "first"}, {2, "second"}, {3, "third"}});
  const std::string whole = contents(path(0));
  const std::vector<std::size_t> ends{log_head_bytes, log_head_bytes + record_head_bytes + 5,
                                      log_head_bytes + 2 * record_head_bytes + 11, whole.size()};
  for (std::size_t length = 0; length <= whole.size(); ++length) {
    overwrite(path(0), whole.substr(0, length));
    const Replay replay = read(0);
    std::size_t expected = 0;
    while (expected + 1 < ends.size() && ends[expected + 1] <= length) ++expected;
    EXPECT_EQ(replay.records.size(), expected) << length;
    const bool at_end = std::find(ends.begin(), ends.end(), length) != ends.end();
    EXPECT_EQ(!replay.torn, at_end) << length;
    EXPECT_FALSE(replay.damage) << length;
  }
}

// What a machine that goes down may leave: the file has its length, and not yet its bytes.
TEST_F(CommandLogTest, ABlankEndIsACut) {
  write_log(0, {{1, "first"}});
  overwrite(path(0), contents(path(0)) + std::string(4'000, '\0'));
  const Replay replay = read(0);
  EXPECT_EQ(replay.records.size(), 1U);
  EXPECT_TRUE(replay.torn);
  EXPECT_FALSE(replay.damage);
}

TEST_F(CommandLogTest, AnyChangedBitIsDamage) {
  write_log(0, {{1, "first"}, {2, "second"}});
  const std::string whole = contents(path(0));
  const std::size_t second_at = log_head_bytes + record_head_bytes + 5;
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    overwrite(path(0), damaged);
    const Replay replay = read(0);
    EXPECT_EQ(replay.records.size(), bit / 8 < second_at ? 0U : 1U) << bit;
    EXPECT_TRUE(replay.damage) << bit;
    EXPECT_FALSE(replay.end) << bit;
  }
}

TEST_F(CommandLogTest, ARecordTakenOutOfTheMiddleIsDamage) {
  write_log(0, {{1, "first"}, {2, "other"}, {3, "third"}});
  const std::string whole = contents(path(0));
  constexpr std::size_t record_bytes = record_head_bytes + 5;
  std::string without_second = whole;
  without_second.erase(log_head_bytes + record_bytes, record_bytes);
  overwrite(path(0), without_second);
  EXPECT_EQ(read(0).records.size(), 1U);
  EXPECT_TRUE(read(0).damage);
  std::string twice = whole;
  twice.insert(log_head_bytes + record_bytes, whole.substr(log_head_bytes, record_bytes));
  overwrite(path(0), twice);
  EXPECT_EQ(read(0).records.size(), 1U);
  EXPECT_TRUE(read(0).damage);
}

TEST_F(CommandLogTest, NothingMayFollowTheSeal) {
  write_sealed_log(0, {{1, "first"}});
  write_log(1, {});
  EXPECT_TRUE(is_whole(read(0)));
  overwrite(path(0), contents(path(0)) + std::string(40, 'x'));
  EXPECT_TRUE(read(0).damage);
}

TEST_F(CommandLogTest, DamageInOneLogHidesTheNext) {
  write_sealed_log(0, {{1, "first"}});
  write_log(1, {{2, "second"}});
  overwrite(path(0), contents(path(0)).substr(0, 30));
  const Replay replay = read(0);
  EXPECT_TRUE(replay.records.empty());
  EXPECT_TRUE(replay.damage) << "it is cut, and another one goes on";
  EXPECT_EQ(read(1).records.size(), 1U);
}

TEST_F(CommandLogTest, GrowsToItsLimitAndIsReadBackWhole) {
  // The header, two records, and the seal's place.
  const std::uint64_t bytes_max = log_head_bytes + 2 * (record_head_bytes + 5) + record_head_bytes;
  auto log = CommandLog::start(*data_dir_, "w", 0, Sync::none, bytes_max);
  ASSERT_TRUE(log.ok());
  EXPECT_TRUE(log->write(1, "first").ok());
  EXPECT_EQ(log->write(2, "larger").code(), base::StatusCode::limit_exceeded);
  EXPECT_TRUE(log->write(2, "other").ok());
  EXPECT_EQ(log->write(3, "x").code(), base::StatusCode::limit_exceeded);
  EXPECT_TRUE(log->seal(3).ok());
  EXPECT_EQ(std::filesystem::file_size(path(0)), bytes_max);
  EXPECT_EQ(read(0).records.size(), 2U);
}

/// As version 1 wrote it.
std::string unchained_log(std::uint64_t sequence, const std::vector<LogRecord>& records) {
  std::string summed;
  base::append_number(summed, sequence);
  std::string log = "PNEUMALG";
  base::append_number(log, std::uint32_t{1});
  base::append_number(log, base::crc32c(summed));
  log += summed;
  for (const LogRecord& record : records) {
    std::string tick;
    base::append_number(tick, record.tick);
    base::append_number(log, static_cast<std::uint32_t>(record.bytes.size()));
    base::append_number(log, base::crc32c(record.bytes, base::crc32c(tick)));
    log += tick + record.bytes;
  }
  return log;
}

TEST_F(CommandLogTest, LogsOfVersion1AreReadAndGoOnInThoseOfVersion2) {
  start(0);
  overwrite(path(0), unchained_log(0, {{1, "first"}, {2, "second"}}));
  EXPECT_EQ(read(0).records.size(), 2U);
  EXPECT_TRUE(is_whole(read(0)));
  EXPECT_FALSE(read(0).end) << "nothing is written to it any more";
  write_log(1, {{3, "third"}});
  EXPECT_EQ(read(0).records.size(), 3U);
  EXPECT_TRUE(is_whole(read(0)));

  std::string damaged = unchained_log(0, {{1, "first"}, {2, "second"}});
  damaged[50] = static_cast<char>(damaged[50] ^ 1);
  overwrite(path(0), damaged);
  EXPECT_TRUE(read(0).damage);
  overwrite(path(0), unchained_log(0, {{1, "first"}, {2, "second"}}).substr(0, 50));
  EXPECT_TRUE(read(0).damage) << "it is cut, and another one goes on";
}

}  // namespace
}  // namespace pneuma::persist
