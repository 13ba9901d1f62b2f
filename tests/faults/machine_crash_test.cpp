// Shows what a crash of the machine may lose under each --sync: nothing of what was answered, what came within a
// second, or whatever the system had not written. The disk here keeps of each file what was synced of it.
#include <cerrno>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "app/world_journal.h"
#include "persist/command_log.h"
#include "support/temporary_folder.h"

namespace pneuma::app {
namespace {

/// A disk that forgets, when it crashes, what was never synced. Thread-safe.
class ForgetfulFiles : public persist::Files {
 public:
  bool syncs = true;  // otherwise fsync fails

  int open(const char* path, int flags, mode_t mode) override {
    const int file = Files::open(path, flags, mode);
    const std::lock_guard lock(mutex_);
    if (file >= 0 && (flags & (O_WRONLY | O_RDWR)) != 0) paths_[file] = path;
    if ((flags & O_TRUNC) != 0) synced_bytes_[path] = 0;
    return file;
  }
  int fsync(int file) override {
    const std::lock_guard lock(mutex_);
    if (!syncs) {
      errno = EIO;
      return -1;
    }
    struct stat status{};
    if (const auto path = paths_.find(file); path != paths_.end() && ::fstat(file, &status) == 0) {
      synced_bytes_[path->second] = status.st_size;
      ++syncs_;
    }
    return 0;
  }
  int close(int file) override {
    const std::lock_guard lock(mutex_);
    paths_.erase(file);
    return Files::close(file);
  }
  int rename(const char* from, const char* to) override {
    const std::lock_guard lock(mutex_);
    synced_bytes_[to] = synced_bytes_[from];
    return Files::rename(from, to);
  }

  void crash() {
    const std::lock_guard lock(mutex_);
    for (const auto& [path, bytes] : synced_bytes_) {
      if (::truncate(path.c_str(), bytes) != 0) {
        EXPECT_EQ(errno, ENOENT) << path;
      }
    }
  }
  [[nodiscard]] int syncs_done() {
    const std::lock_guard lock(mutex_);
    return syncs_;
  }

 private:
  std::mutex mutex_;
  std::map<int, std::string> paths_;
  std::map<std::string, off_t> synced_bytes_;
  int syncs_ = 0;
};

class MachineCrash : public testing::TestWithParam<persist::Sync> {
 protected:
  using TimePoint = WorldJournal::TimePoint;

  void SetUp() override {
    v1::Scene scene;
    scene.add_meshes()->set_name("sphere");
    scene.mutable_meshes(0)->mutable_icosphere();
    scene.add_soft_bodies()->set_name("ball");
    scene.mutable_soft_bodies(0)->set_mesh("sphere");
    auto live = LiveWorld::create(scene);
    ASSERT_TRUE(live.ok() && data_dir_.ok());
    journal_.emplace("w", std::uint64_t{0},
                     WorldJournal::Wiring{&*data_dir_, &disk_, &metrics_, std::chrono::seconds(10), GetParam()});
    ASSERT_TRUE(journal_->checkpoint_now(live->save(), true).ok());
  }
  base::Status write(double n_s) {
    v1::ClientMessage message;
    message.mutable_impulse()->set_world("w");
    message.mutable_impulse()->mutable_impulse()->set_x(n_s);
    return journal_->write(0, message);
  }
  /// The commands that are there when the machine is back.
  std::size_t left_after_crash() {
    disk_.flush();
    files_.crash();
    const auto replay = persist::read_commands(*data_dir_, "w", 0);
    EXPECT_TRUE(replay.ok() && !replay->damage) << replay.status().message();
    return replay->records.size();
  }

  const support::TemporaryFolder crash_folder_;
  ForgetfulFiles files_;
  base::Result<persist::DataDir> data_dir_ = persist::DataDir::open(crash_folder_.path(), files_);
  Metrics metrics_;
  BackgroundQueue disk_;
  std::optional<WorldJournal> journal_;
  const TimePoint start_ = std::chrono::steady_clock::now();
};

TEST_P(MachineCrash, LosesNoMoreThanTheFlagSays) {
  ASSERT_TRUE(write(1.0).ok());
  journal_->sync_if_due(start_);
  disk_.flush();
  ASSERT_TRUE(write(2.0).ok());
  ASSERT_TRUE(write(3.0).ok());
  journal_->sync_if_due(start_ + std::chrono::milliseconds(500));
  const std::size_t left = left_after_crash();
  switch (GetParam()) {
    case persist::Sync::every_record:
      EXPECT_EQ(left, 3U);
      break;
    case persist::Sync::each_second:
      EXPECT_EQ(left, 1U);
      break;
    case persist::Sync::none:
      EXPECT_EQ(left, 0U);
      break;
  }
}

TEST_P(MachineCrash, WhatIsASecondOldIsThereUnlessTheSystemIsToDecide) {
  ASSERT_TRUE(write(1.0).ok());
  journal_->sync_if_due(start_);
  ASSERT_TRUE(write(2.0).ok());
  const bool waits = GetParam() == persist::Sync::each_second;
  ASSERT_EQ(journal_->next_try(start_).has_value(), waits);
  if (waits) {
    EXPECT_EQ(*journal_->next_try(start_), start_ + std::chrono::seconds(1));
  }
  disk_.flush();
  journal_->sync_if_due(start_ + std::chrono::seconds(1));
  EXPECT_EQ(left_after_crash(), GetParam() == persist::Sync::none ? 0U : 2U);
  EXPECT_FALSE(journal_->next_try(start_)) << "nothing more is to be synced";
}

TEST_P(MachineCrash, ASyncThatFailsIsToldAndMadeUpForByACheckpoint) {
  files_.syncs = false;
  const base::Status written = write(1.0);
  EXPECT_EQ(written.ok(), GetParam() != persist::Sync::every_record) << "what is not on the disk is not acknowledged";
  journal_->sync_if_due(start_);
  disk_.flush();
  EXPECT_EQ(journal_->trouble().ok(), GetParam() == persist::Sync::none);
  EXPECT_EQ(journal_->checkpoint_due(start_ + std::chrono::seconds(3), 0), GetParam() != persist::Sync::none);
}

INSTANTIATE_TEST_SUITE_P(Flags, MachineCrash,
                         testing::Values(persist::Sync::every_record, persist::Sync::each_second, persist::Sync::none),
                         [](const auto& flag) {
                           return flag.param == persist::Sync::none          ? "os"
                                  : flag.param == persist::Sync::each_second ? "second"
                                                                             : "request";
                         });

}  // namespace
}  // namespace pneuma::app
