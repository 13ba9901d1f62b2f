// Shows that a disk that is full, in whatever way, loses nothing that a world's journal has taken: what cannot be
// written is refused, leaves no hole in the sequence of logs, and can be written again when the disk takes it.
#include <cerrno>
#include <chrono>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "app/world_journal.h"
#include "base/limits.h"
#include "persist/command_log.h"
#include "support/temporary_folder.h"

namespace pneuma::app {
namespace {

/// Full in one way or another: it takes no new files, no more bytes, or no renaming of finished checkpoints.
class FullDisk : public persist::Files {
 public:
  bool takes_files = true;
  bool takes_bytes = true;
  bool takes_checkpoints = true;

  int open(const char* path, int flags, mode_t mode) override {
    return takes_files ? Files::open(path, flags, mode) : full();
  }
  ssize_t pwrite(int file, const void* bytes, std::size_t count, off_t offset) override {
    return takes_bytes ? Files::pwrite(file, bytes, count, offset) : full();
  }
  int rename(const char* from, const char* to) override { return takes_checkpoints ? Files::rename(from, to) : full(); }

 private:
  static int full() {
    errno = ENOSPC;
    return -1;
  }
};

v1::Scene ball() {
  v1::Scene scene;
  v1::Mesh& mesh = *scene.add_meshes();
  mesh.set_name("sphere");
  mesh.mutable_icosphere();
  scene.add_soft_bodies()->set_name("ball");
  scene.mutable_soft_bodies(0)->set_mesh("sphere");
  return scene;
}

v1::ClientMessage push(double n_s) {
  v1::ClientMessage message;
  message.mutable_impulse()->set_world("w");
  message.mutable_impulse()->mutable_impulse()->set_x(n_s);
  return message;
}

class JournalFaults : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(data_dir_.ok()) << data_dir_.status().message();
    ASSERT_TRUE(live_.ok()) << live_.status().message();
    ASSERT_TRUE(checkpoint().ok());
  }
  base::Status checkpoint() { return journal_.checkpoint_now(live_->save(), true); }
  /// The commands that a restart would find.
  std::vector<std::string> found(std::uint64_t sequence = 0) {
    const auto replay = persist::read_commands(*data_dir_, "w", sequence);
    EXPECT_TRUE(replay.ok() && !replay->damage) << replay.status().message();
    std::vector<std::string> commands;
    for (const persist::LogRecord& record : replay->records) commands.push_back(record.bytes);
    return commands;
  }
  static std::vector<std::string> pushes(const std::vector<double>& all) {
    std::vector<std::string> commands;
    for (const double n_s : all) commands.push_back(push(n_s).SerializeAsString());
    return commands;
  }

  const support::TemporaryFolder folder_;
  FullDisk files_;
  base::Result<persist::DataDir> data_dir_ = persist::DataDir::open(folder_.path(), files_);
  base::Result<LiveWorld> live_ = LiveWorld::create(ball());
  BackgroundQueue disk_;
  Metrics metrics_;
  WorldJournal journal_{"w", 0, {&*data_dir_, &disk_, &metrics_, std::chrono::seconds(10)}};
};

TEST_F(JournalFaults, ALogThatCouldNotBeBegunLeavesNoHole) {
  ASSERT_TRUE(journal_.write(0, push(1.0)).ok());
  files_.takes_files = false;
  EXPECT_FALSE(checkpoint().ok());
  EXPECT_TRUE(journal_.checkpoint_due(std::chrono::steady_clock::now() + std::chrono::seconds(2), 0))
      << "where there is trouble, soon";
  EXPECT_FALSE(journal_.trouble().ok());
  EXPECT_TRUE(journal_.write(0, push(2.0)).ok()) << "the old log goes on";
  files_.takes_files = true;
  EXPECT_TRUE(checkpoint().ok());
  EXPECT_TRUE(journal_.trouble().ok());
  EXPECT_TRUE(journal_.write(0, push(3.0)).ok());
  EXPECT_EQ(found(), pushes({1.0, 2.0, 3.0}));
}

TEST_F(JournalFaults, WhatCannotBeWrittenIsRefusedAndNothingIsLeftOfIt) {
  ASSERT_TRUE(journal_.write(0, push(1.0)).ok());
  files_.takes_bytes = false;
  EXPECT_EQ(journal_.write(0, push(2.0)).code(), base::StatusCode::unavailable);
  EXPECT_FALSE(journal_.trouble().ok());
  files_.takes_bytes = true;
  ASSERT_TRUE(journal_.write(0, push(3.0)).ok());
  EXPECT_TRUE(journal_.trouble().ok()) << "healed";
  EXPECT_EQ(found(), pushes({1.0, 3.0}));
}

TEST_F(JournalFaults, ARequestThatIsRefusedAfterAllIsNoPartOfTheLog) {
  ASSERT_TRUE(journal_.write(0, push(1.0)).ok());
  ASSERT_TRUE(journal_.write(0, push(2.0)).ok());
  journal_.take_back();
  ASSERT_TRUE(journal_.write(0, push(3.0)).ok());
  EXPECT_EQ(found(), pushes({1.0, 3.0}));
}

TEST_F(JournalFaults, ALongLogIsEndedByACheckpointBeforeItsTime) {
  const auto start = std::chrono::steady_clock::now();
  // Before the interval's end, but longer than a disk is left alone.
  const auto is_due = [&] { return journal_.checkpoint_due(start + std::chrono::seconds(5), 0); };
  v1::ClientMessage large = push(1.0);
  large.mutable_impulse()->set_body(std::string(1024 * 1024, 'b'));
  std::uint64_t written_bytes = 0;
  while (written_bytes < base::log_bytes_before_checkpoint) {
    ASSERT_FALSE(is_due()) << "after " << written_bytes << " bytes";
    ASSERT_TRUE(journal_.write(0, large).ok());
    written_bytes += large.ByteSizeLong();
  }
  EXPECT_TRUE(is_due());
  files_.takes_files = false;
  const auto now = std::chrono::steady_clock::now();
  EXPECT_FALSE(checkpoint().ok());
  ASSERT_TRUE(journal_.write(0, large).ok()) << "the old log goes on";
  EXPECT_FALSE(journal_.checkpoint_due(now, 0)) << "not at each edit";
  EXPECT_TRUE(journal_.next_try(now).has_value());
  EXPECT_TRUE(journal_.checkpoint_due(now + std::chrono::seconds(5), 0));
  files_.takes_files = true;
  EXPECT_TRUE(checkpoint().ok());
  EXPECT_FALSE(is_due()) << "the new log is short";
}

// Whoever held a body went; the body was let go, and the log lacks it: a replay of what came after would be on another
// state.
TEST_F(JournalFaults, AfterAChangeThatTheLogLacksNothingIsKeptUntilACheckpointIs) {
  ASSERT_TRUE(journal_.write(0, push(1.0)).ok());
  files_.takes_bytes = false;
  EXPECT_FALSE(journal_.write(0, push(2.0)).ok());
  journal_.lost_a_change();
  files_.takes_bytes = true;
  EXPECT_EQ(journal_.write(0, push(3.0)).code(), base::StatusCode::unavailable);
  EXPECT_EQ(found(), pushes({1.0}));

  files_.takes_files = false;
  EXPECT_FALSE(checkpoint().ok());
  EXPECT_FALSE(journal_.write(0, push(4.0)).ok());
  files_.takes_files = true;
  EXPECT_TRUE(checkpoint().ok());
  EXPECT_TRUE(journal_.write(0, push(5.0)).ok());
  EXPECT_EQ(found(1), pushes({5.0})) << "on the new checkpoint";
}

TEST_F(JournalFaults, ACheckpointThatFailsIsTroubleUntilOneIsWritten) {
  files_.takes_checkpoints = false;
  EXPECT_FALSE(checkpoint().ok());
  EXPECT_FALSE(journal_.trouble().ok());
  EXPECT_TRUE(journal_.write(0, push(1.0)).ok()) << "the checkpoint before and both logs bring the world back";
  EXPECT_EQ(found(), pushes({1.0}));
  files_.takes_checkpoints = true;
  EXPECT_TRUE(checkpoint().ok());
  EXPECT_TRUE(journal_.trouble().ok());
}

}  // namespace
}  // namespace pneuma::app
