// Shows that a log that could not be begun leaves no hole in the sequence of logs: what was appended before, meanwhile
// and after is all replayed on the checkpoint before.
#include <cerrno>
#include <chrono>
#include <string>

#include <gtest/gtest.h>

#include "app/world_journal.h"
#include "persist/command_log.h"
#include "support/temporary_folder.h"

namespace pneuma::app {
namespace {

/// No file can be made while it is full; those that are open can be written.
class FullDisk : public persist::Files {
 public:
  bool full = false;

  int open(const char* path, int flags, mode_t mode) override {
    if (!full) return Files::open(path, flags, mode);
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

TEST(JournalFaults, ALogThatCouldNotBeBegunLeavesNoHole) {
  const support::TemporaryFolder folder;
  FullDisk files;
  auto data_dir = persist::DataDir::open(folder.path(), files);
  ASSERT_TRUE(data_dir.ok()) << data_dir.status().message();
  auto live = LiveWorld::create(ball());
  ASSERT_TRUE(live.ok()) << live.status().message();
  BackgroundQueue disk;
  Metrics metrics;
  WorldJournal journal("w", 0, {&*data_dir, &disk, &metrics, std::chrono::seconds(10)});
  journal.checkpoint_now(live->save(), true);
  journal.append(0, push(1.0));
  files.full = true;
  journal.checkpoint_now(live->save(), true);
  EXPECT_TRUE(journal.checkpoint_due(std::chrono::steady_clock::now() + std::chrono::seconds(11), 0))
      << "what was appended has no checkpoint yet";
  journal.append(0, push(2.0));
  files.full = false;
  journal.checkpoint_now(live->save(), true);
  journal.append(0, push(3.0));

  const auto replay = persist::read_commands(*data_dir, "w", 0);
  ASSERT_TRUE(replay.ok()) << replay.status().message();
  EXPECT_TRUE(replay->cut.empty()) << replay->cut.front().message();
  ASSERT_EQ(replay->records.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(replay->records[i].bytes, push(static_cast<double>(i + 1)).SerializeAsString());
  }
}

}  // namespace
}  // namespace pneuma::app
