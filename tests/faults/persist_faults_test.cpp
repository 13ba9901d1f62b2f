// Shows that no failure of the disk, at any operation of a checkpoint or commit, costs a world: every operation is made
// to fail in turn, and what was on the disk before can still be read, or else what was being written can be, whole. The
// disk here writes short, runs full, fails to sync, or dies at once and for good, as the machine does.
#include <cerrno>
#include <string>

#include <gtest/gtest.h>

#include "persist/checkpoint.h"
#include "persist/command_log.h"
#include "support/temporary_folder.h"

namespace pneuma::persist {
namespace {

/// Counts the operations that change the disk and fails the one numbered `fail_at`; with `dead`, all after it too.
class FailingFiles : public Files {
 public:
  int fail_at = -1;
  int error = EIO;
  bool dead = false;
  bool short_writes = false;  // every write takes half, and the failing one leaves a torn half behind

  [[nodiscard]] int operations() const { return operations_; }
  void reset() { operations_ = 0; }

  int open(const char* path, int flags, mode_t mode) override { return fails() ? -1 : Files::open(path, flags, mode); }
  ssize_t pwrite(int file, const void* bytes, std::size_t count, off_t offset) override {
    const std::size_t half = short_writes ? (count + 1) / 2 : count;
    if (!fails()) return Files::pwrite(file, bytes, half, offset);
    const int failure = errno;
    if (short_writes) (void)Files::pwrite(file, bytes, half, offset);
    errno = failure;
    return -1;
  }
  int ftruncate(int file, off_t length) override { return fails() ? -1 : Files::ftruncate(file, length); }
  int fsync(int file) override { return fails() ? -1 : Files::fsync(file); }
  int rename(const char* from, const char* to) override { return fails() ? -1 : Files::rename(from, to); }
  int link(const char* from, const char* to) override { return fails() ? -1 : Files::link(from, to); }
  int unlink(const char* path) override { return fails() ? -1 : Files::unlink(path); }
  int mkdir(const char* path, mode_t mode) override { return fails() ? -1 : Files::mkdir(path, mode); }

 private:
  bool fails() {
    const int operation = operations_++;
    const bool failing = fail_at >= 0 && (operation == fail_at || (dead && operation > fail_at));
    if (failing) errno = error;
    return failing;
  }
  int operations_ = 0;
};

struct Fault {
  const char* name;
  int error;
  bool dead;
  bool short_writes;
};

class PersistFaults : public testing::TestWithParam<Fault> {
 protected:
  void arm(int operation) {
    files_.reset();
    files_.fail_at = operation;
    files_.error = GetParam().error;
    files_.dead = GetParam().dead;
    files_.short_writes = GetParam().short_writes;
  }
  void disarm() { files_.fail_at = -1; }

  support::TemporaryFolder folder_;
  FailingFiles files_;
  base::Result<DataDir> data_dir_ = DataDir::open(folder_.path(), files_);
};

TEST_P(PersistFaults, CheckpointFailsWithoutLosingTheLastOne) {
  const std::string old_state(1'000, 'o');
  const std::string new_state(1'000, 'n');
  std::uint64_t sequence = 0;
  for (; sequence < 4; ++sequence) ASSERT_TRUE(write_checkpoint(*data_dir_, "w", {sequence, 1, old_state}).ok());

  bool failed = true;
  for (int operation = 0; failed; ++operation) {
    ASSERT_LT(operation, 100);
    arm(operation);
    const base::Status status = write_checkpoint(*data_dir_, "w", {sequence, 2, new_state});
    failed = files_.operations() > operation;  // the armed operation was reached
    disarm();
    EXPECT_EQ(status.ok(), !failed) << "operation " << operation;
    const auto read = read_latest_checkpoint(*data_dir_, "w");
    ASSERT_TRUE(read.ok()) << "operation " << operation << ": " << read.status().message();
    EXPECT_TRUE(read->checkpoint.bytes == (read->checkpoint.sequence == sequence ? new_state : old_state));
    EXPECT_TRUE(read->damaged.empty()) << "operation " << operation;
    if (read->checkpoint.sequence == sequence) {
      ASSERT_TRUE(write_checkpoint(*data_dir_, "w", {++sequence, 1, old_state}).ok());
      ++sequence;
    }
  }
}

TEST_P(PersistFaults, AFailedWriteLeavesTheLogAsItWas) {
  bool failed = true;
  for (int operation = 0; failed; ++operation) {
    ASSERT_LT(operation, 100);
    disarm();
    auto log = CommandLog::start(*data_dir_, "w", 0, Sync::every_record);
    ASSERT_TRUE(log.ok());
    ASSERT_TRUE(log->write(1, "first").ok());
    arm(operation);
    const base::Status status = log->write(2, std::string(100, 's'));
    failed = files_.operations() > operation;
    EXPECT_EQ(status.ok(), !failed);
    disarm();

    // As it would be found if the process ended here: what was acknowledged is there, and nothing is damaged.
    auto found = read_commands(*data_dir_, "w", 0);
    ASSERT_TRUE(found.ok());
    EXPECT_FALSE(found->damage);
    ASSERT_GE(found->records.size(), failed ? 1U : 2U);
    EXPECT_EQ(found->records[0].bytes, "first");

    ASSERT_TRUE(log->write(3, "third").ok());
    found = read_commands(*data_dir_, "w", 0);
    ASSERT_TRUE(found.ok());
    EXPECT_FALSE(found->damage);
    EXPECT_FALSE(found->torn);
    ASSERT_EQ(found->records.size(), failed ? 2U : 3U);
    EXPECT_EQ(found->records.back().bytes, "third");
  }
}

TEST_P(PersistFaults, WhatCouldNotBeTakenBackIsCutOffBeforeTheNext) {
  auto log = CommandLog::start(*data_dir_, "w", 0, Sync::none);
  ASSERT_TRUE(log.ok());
  ASSERT_TRUE(log->write(1, "first").ok());
  ASSERT_TRUE(log->write(2, std::string(100, 'r')).ok());
  arm(0);
  EXPECT_FALSE(log->take_back().ok());
  EXPECT_EQ(log->write(3, "third").ok(), !GetParam().dead);
  disarm();
  ASSERT_TRUE(log->write(4, "fourth").ok());
  const auto found = read_commands(*data_dir_, "w", 0);
  ASSERT_TRUE(found.ok());
  EXPECT_FALSE(found->damage);
  EXPECT_FALSE(found->torn);
  ASSERT_EQ(found->records.size(), GetParam().dead ? 2U : 3U);
  EXPECT_EQ(found->records.back().bytes, "fourth");
}

TEST_P(PersistFaults, LogThatCannotBeBegunIsReported) {
  for (int operation = 0;; ++operation) {
    ASSERT_LT(operation, 100);
    arm(operation);
    const auto log = CommandLog::start(*data_dir_, "w", 0, Sync::every_record);
    const bool failed = files_.operations() > operation;
    disarm();
    EXPECT_EQ(log.ok(), !failed);
    if (!failed) break;
    EXPECT_EQ(log.status().code(), base::StatusCode::unavailable);
  }
}

INSTANTIATE_TEST_SUITE_P(Disks, PersistFaults,
                         testing::Values(Fault{"Full", ENOSPC, false, true}, Fault{"FullAtOnce", ENOSPC, false, false},
                                         Fault{"Broken", EIO, true, false}, Fault{"TornAndBroken", EIO, true, true}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace pneuma::persist
