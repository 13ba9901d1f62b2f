// Shows that what is written is read back, that the last three checkpoints stay, and that a damaged one, cut at any
// length or with any byte changed, is passed over for the one before it and named.
#include "persist/checkpoint.h"

#include <filesystem>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>

#include "persist/command_log.h"
#include "persist/world_files.h"
#include "support/temporary_folder.h"

namespace pneuma::persist {
namespace {

namespace fs = std::filesystem;

class CheckpointTest : public testing::Test {
 protected:
  void write(std::uint64_t sequence, std::uint64_t tick, const std::string& bytes) {
    const auto status = write_checkpoint(*data_dir_, "w", {sequence, tick, bytes});
    ASSERT_TRUE(status.ok()) << status.message();
  }
  std::string path(std::uint64_t sequence) { return numbered_file(folder_ / "worlds/w", checkpoint_prefix, sequence); }

  static std::string contents(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static void overwrite(const std::string& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }

  support::TemporaryFolder folder_;
  base::Result<DataDir> data_dir_ = DataDir::open(folder_.path());
};

TEST_F(CheckpointTest, ReadsBackWhatWasWritten) {
  const std::string bytes("\0state\xFF\n", 8);
  write(4, 1'234'567'890'123, bytes);
  const auto read = read_latest_checkpoint(*data_dir_, "w");
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->checkpoint.sequence, 4U);
  EXPECT_EQ(read->checkpoint.tick, 1'234'567'890'123U);
  EXPECT_EQ(read->checkpoint.bytes, bytes);
  EXPECT_EQ(read->next_sequence, 5U);
  EXPECT_TRUE(read->damaged.empty());
}

TEST_F(CheckpointTest, FileBeginsAsTheFormatSays) {
  write(0x0102, 0x0304, "abc");
  const std::string file = contents(path(0x0102));
  EXPECT_EQ(file.substr(0, 12), std::string("PNEUMACK\x01\0\0\0", 12));
  EXPECT_EQ(file.substr(16), std::string("\x02\x01\0\0\0\0\0\0\x04\x03\0\0\0\0\0\0\x03\0\0\0\0\0\0\0abc", 27));
}

TEST_F(CheckpointTest, NoWorldIsNotFound) {
  EXPECT_EQ(read_latest_checkpoint(*data_dir_, "w").status().code(), base::StatusCode::not_found);
}

TEST_F(CheckpointTest, LastThreeAreKeptWithTheirLogs) {
  for (std::uint64_t i = 0; i < 6; ++i) {
    ASSERT_TRUE(CommandLog::start(*data_dir_, "w", i, Sync::none).ok());
    write(i, 10 * i, "state");
  }
  EXPECT_EQ(*numbered_files(folder_ / "worlds/w", checkpoint_prefix), (std::vector<std::uint64_t>{3, 4, 5}));
  EXPECT_EQ(*numbered_files(folder_ / "worlds/w", log_prefix), (std::vector<std::uint64_t>{3, 4, 5}));
  EXPECT_FALSE(fs::exists(folder_ / "worlds/w/unfinished"));
}

TEST_F(CheckpointTest, CutAtAnyLengthFallsBackAndIsNamed) {
  write(1, 10, "the older state");
  write(2, 20, "the newer state");
  const std::string whole = contents(path(2));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    overwrite(path(2), whole.substr(0, length));
    const auto read = read_latest_checkpoint(*data_dir_, "w");
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(read->checkpoint.bytes, "the older state");
    EXPECT_EQ(read->next_sequence, 3U);
    ASSERT_EQ(read->damaged.size(), 1U);
    EXPECT_EQ(read->damaged[0].where(), path(2));
  }
}

TEST_F(CheckpointTest, AnyChangedBitIsNoticed) {
  write(1, 10, "the older state");
  write(2, 20, "the newer state");
  const std::string whole = contents(path(2));
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    overwrite(path(2), damaged);
    const auto read = read_latest_checkpoint(*data_dir_, "w");
    ASSERT_TRUE(read.ok()) << read.status().message();
    EXPECT_EQ(read->checkpoint.tick, 10U) << "bit " << bit;
  }
}

TEST_F(CheckpointTest, MoreThanTheLengthSaysIsDamage) {
  write(1, 10, "state");
  overwrite(path(1), contents(path(1)) + "x");
  const auto read = read_latest_checkpoint(*data_dir_, "w");
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.status().code(), base::StatusCode::malformed);
  EXPECT_NE(read.status().message().find(path(1)), std::string::npos);
}

TEST_F(CheckpointTest, OtherVersionIsNamed) {
  write(1, 10, "state");
  std::string file = contents(path(1));
  file[8] = 9;
  overwrite(path(1), file);
  EXPECT_NE(read_latest_checkpoint(*data_dir_, "w").status().message().find("version 9"), std::string::npos);
}

TEST_F(CheckpointTest, RenamedFileIsNotTakenForAnother) {
  write(1, 10, "state");
  fs::rename(path(1), path(7));
  EXPECT_FALSE(read_latest_checkpoint(*data_dir_, "w").ok());
}

}  // namespace
}  // namespace pneuma::persist
