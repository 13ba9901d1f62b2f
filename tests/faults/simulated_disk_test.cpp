// Shows that a world's journal keeps its word on any disk: lives of a world, drawn from a seed, on a disk whose
// operations fail and that dies in the middle of one, with the process or with the machine. After each death a world
// comes back that has all that was acknowledged, and nothing else but at most one request after that, which the disk
// did not let go again. A seed that fails names itself: PNEUMA_SEED runs it alone, PNEUMA_SEEDS as many as it says.
#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include "app/world_archive.h"
#include "support/environment.h"
#include "support/sanitizers.h"
#include "support/temporary_folder.h"

namespace pneuma::app {
namespace {

using Random = std::mt19937_64;

/// In memory where there is such a folder: what a disk does is simulated.
std::filesystem::path parent_folder() {
  const std::filesystem::path in_memory = "/dev/shm";
  return std::filesystem::is_directory(in_memory) ? in_memory : std::filesystem::temp_directory_path();
}

double draw(Random& random) {
  return static_cast<double>(random() >> 11U) * 0x1p-53;
}

/// Fails as drawn, and ends after so many operations: then none has an effect. What was written and not synced may be
/// lost with the machine. Operations come one at a time.
class SimulatedDisk : public persist::Files {
 public:
  Random random;
  double failing_share = 0.0;
  std::optional<std::uint64_t> lives_for;  // operations

  [[nodiscard]] bool is_dead() const { return is_dead_; }
  void revive() {
    is_dead_ = false;
    lives_for.reset();
    failing_share = 0.0;
  }
  /// Of each file some of what was not synced is gone.
  void lose_unsynced() {
    for (const auto& [path, synced] : synced_bytes_) {
      struct stat status{};
      if (::stat(path.c_str(), &status) != 0 || status.st_size <= synced) continue;
      const auto kept = static_cast<off_t>(random() % static_cast<std::uint64_t>(status.st_size - synced + 1));
      EXPECT_EQ(::truncate(path.c_str(), synced + kept), 0);
    }
  }

  int open(const char* path, int flags, mode_t mode) override {
    const bool writes = (flags & (O_WRONLY | O_RDWR)) != 0;
    if (is_dead_ || (writes && fails())) return failure();
    const int file = Files::open(path, flags, mode);
    if (file < 0 || !writes) return file;
    paths_[file] = path;
    if ((flags & O_TRUNC) != 0 || !synced_bytes_.contains(path)) synced_bytes_[path] = 0;
    return file;
  }
  ssize_t pread(int file, void* bytes, std::size_t count, off_t offset) override {
    return is_dead_ ? failure() : Files::pread(file, bytes, count, offset);
  }
  ssize_t pwrite(int file, const void* bytes, std::size_t count, off_t offset) override {
    if (is_dead_) return failure();
    const bool fails = this->fails();
    // A write may be short, and one that fails may have got some of its bytes to the disk.
    const bool is_short = fails || (failing_share > 0.0 && draw(random) < failing_share);
    if (is_short) count = random() % (count + 1);
    const ssize_t written = count == 0 ? 0 : Files::pwrite(file, bytes, count, offset);
    return fails || written == 0 ? failure() : written;
  }
  int ftruncate(int file, off_t length) override {
    if (is_dead_ || fails()) return failure();
    if (const auto path = paths_.find(file); path != paths_.end()) {
      synced_bytes_[path->second] = std::min(synced_bytes_[path->second], length);
    }
    return Files::ftruncate(file, length);
  }
  int fsync(int file) override {
    if (is_dead_ || fails()) return failure();
    struct stat status{};
    if (const auto path = paths_.find(file); path != paths_.end() && ::fstat(file, &status) == 0) {
      synced_bytes_[path->second] = status.st_size;
    }
    return 0;
  }
  int close(int file) override {
    paths_.erase(file);
    return Files::close(file);
  }
  int rename(const char* from, const char* to) override {
    if (is_dead_ || fails()) return failure();
    synced_bytes_[to] = synced_bytes_[from];
    synced_bytes_.erase(from);
    return Files::rename(from, to);
  }
  int link(const char* from, const char* to) override {
    return is_dead_ || fails() ? failure() : Files::link(from, to);
  }
  int unlink(const char* path) override {
    if (is_dead_ || fails()) return failure();
    synced_bytes_.erase(path);
    return Files::unlink(path);
  }
  int rmdir(const char* path) override { return is_dead_ || fails() ? failure() : Files::rmdir(path); }
  int mkdir(const char* path, mode_t mode) override {
    return is_dead_ || fails() ? failure() : Files::mkdir(path, mode);
  }

 private:
  bool fails() {
    if (lives_for && (*lives_for)-- == 0) is_dead_ = true;
    return is_dead_ || draw(random) < failing_share;
  }
  static int failure() {
    errno = EIO;
    return -1;
  }

  bool is_dead_ = false;
  std::map<int, std::string> paths_;  // of what is open for writing
  std::map<std::string, off_t> synced_bytes_;
};

/// A world and its disk, from a seed, through some lives.
class SimulatedLives {
 public:
  explicit SimulatedLives(std::uint64_t seed) : random_(seed) {
    files_.random.seed(seed + 1);
    const std::uint64_t kind = random_() % 3;
    sync_ = kind == 0 ? persist::Sync::none : kind == 1 ? persist::Sync::each_second : persist::Sync::every_record;
  }

  void run() {
    ASSERT_NO_FATAL_FAILURE(begin());
    for (int life = 0; life < 3; ++life) {
      ASSERT_NO_FATAL_FAILURE(live_on());
      ASSERT_NO_FATAL_FAILURE(die_and_come_back()) << "in life " << life << ":" << story_;
      story_.clear();
    }
  }

 private:
  /// A request that was refused after the last one that was acknowledged: where the disk took it, and neither its sync
  /// nor its end, it is there.
  struct Doubtful {
    v1::ClientMessage message;
    LiveWorld::Saved before;
  };

  void open() {
    disk_ = std::make_unique<BackgroundQueue>();
    auto archive = WorldArchive::open(folder_.path(), std::chrono::seconds(10), sync_, *disk_, metrics_, files_);
    ASSERT_TRUE(archive.ok()) << archive.status().message();
    archive_.emplace(std::move(*archive));
  }

  void begin() {
    v1::Scene scene;
    scene.add_meshes()->set_name("ball-mesh");
    scene.mutable_meshes(0)->mutable_icosphere();
    scene.add_soft_bodies()->set_name("ball");
    scene.mutable_soft_bodies(0)->set_mesh("ball-mesh");
    auto live = LiveWorld::create(scene);
    ASSERT_TRUE(live.ok()) << live.status().message();
    live_.emplace(std::move(*live));
    ASSERT_NO_FATAL_FAILURE(open());
    auto journal = archive_->begin("w", *live_, false);
    ASSERT_TRUE(journal.ok()) << journal.status().message();
    journal_ = std::move(*journal);
  }

  void live_on() {
    if (random_() % 2 == 0) files_.failing_share = 0.3 * draw(random_);
    files_.lives_for = random_() % 120;
    for (int deeds = 0; deeds < 60 && !files_.is_dead(); ++deeds) {
      switch (random_() % 8) {
        case 0:
        case 1:
        case 2:
          request();
          break;
        case 3:
        case 4:
          live_->physics().step_tick(workers_);
          story_ += " tick";
          break;
        case 5:
          story_ += " checkpoint";
          hold_disk_thread();
          journal_->checkpoint(now_, live_->save(), false);
          break;
        case 6:
          now_ += std::chrono::milliseconds(random_() % 1'500);
          story_ += " sync";
          hold_disk_thread();
          journal_->sync_if_due(now_);
          break;
        default:
          release_disk_thread();
          break;
      }
    }
  }

  void request() {
    v1::ClientMessage message;
    v1::Impulse& impulse = *message.mutable_impulse();
    impulse.set_world("w");
    impulse.set_body(random_() % 8 == 0 ? "nobody" : "ball");
    impulse.mutable_impulse()->set_x(draw(random_) - 0.5);
    if (!journal_->write(live_->tick(), message).ok()) {
      doubtful_.push_back({message, live_->save()});
      story_ += " refused";
      return;
    }
    doubtful_.clear();
    const bool is_done = live_->change(message).ok();
    story_ += is_done ? " done" : " taken-back";
    if (!is_done) journal_->take_back();
  }

  // What the disk's thread is to do waits until it is released, so that the same seed gives the same order.
  void hold_disk_thread() {
    if (held_) return;
    held_.emplace();
    disk_->post([until = std::shared_future<void>(held_->get_future())] { until.wait(); });
  }
  void release_disk_thread() {
    story_ += " flush";
    if (held_) held_->set_value();
    held_.reset();
    disk_->flush();
  }

  void die_and_come_back() {
    story_ += files_.is_dead() ? " dead" : " killed";
    files_.lives_for = 0;
    (void)files_.mkdir((folder_ / "none").c_str(), 0700);  // and so it is dead, if it was not
    release_disk_thread();
    journal_.reset();
    archive_.reset();
    disk_.reset();
    files_.revive();
    // Only what is synced with each record survives the machine.
    if (sync_ == persist::Sync::every_record && random_() % 2 == 0) {
      story_ += " with-the-machine";
      files_.lose_unsynced();
    }
    ASSERT_NO_FATAL_FAILURE(open());
    if (random_() % 4 == 0) fail_to_come_back();
    const std::atomic<bool> is_over = false;
    auto restored = archive_->restore("w", no_limits(), false, is_over);
    ASSERT_TRUE(restored.ok()) << restored.status().message();
    ASSERT_LE(restored->live.tick(), live_->tick());
    const std::uint64_t hash = hash_at_end(restored->live);
    if (hash != live_->physics().state_hash()) {
      ASSERT_TRUE(std::ranges::any_of(doubtful_, [&](const Doubtful& one) { return hash == hash_with(one); }))
          << "something that was acknowledged is lost, or something else was done";
    }
    live_.emplace(std::move(restored->live));
    journal_ = std::move(restored->journal);
    doubtful_.clear();
  }

  /// A start on a disk that fails, which loses nothing.
  void fail_to_come_back() {
    files_.failing_share = 0.3;
    const std::atomic<bool> is_over = false;
    (void)archive_->restore("w", no_limits(), false, is_over);
    files_.failing_share = 0.0;
  }

  std::uint64_t hash_with(const Doubtful& one) {
    auto other = LiveWorld::restore(one.before);
    EXPECT_TRUE(other.ok());
    return other->change(one.message).ok() ? hash_at_end(*other) : 0;
  }

  /// Ticks after the last record are no request's, and may be run again.
  std::uint64_t hash_at_end(const LiveWorld& of) {
    auto copy = LiveWorld::restore(of.save());
    EXPECT_TRUE(copy.ok());
    while (copy->tick() < live_->tick()) copy->physics().step_tick(workers_);
    return copy->physics().state_hash();
  }

  static WorldMemory::Limits no_limits() { return {base::MemoryBudget(std::size_t{1} << 30U), std::size_t{1} << 30U}; }

  Random random_;
  const support::TemporaryFolder folder_{parent_folder()};
  SimulatedDisk files_;
  persist::Sync sync_;
  Metrics metrics_;
  physics::Workers workers_{1};
  std::unique_ptr<BackgroundQueue> disk_;
  std::optional<std::promise<void>> held_;
  std::optional<WorldArchive> archive_;
  std::optional<LiveWorld> live_;
  std::unique_ptr<WorldJournal> journal_;
  std::vector<Doubtful> doubtful_;
  std::string story_;  // what was done, for who looks into a seed that fails
  WorldJournal::TimePoint now_ = std::chrono::steady_clock::now();
};

TEST(SimulatedDisk, WhatIsAcknowledgedOutlivesEveryDeath) {
  spdlog::set_level(spdlog::level::off);
  constexpr std::uint64_t in_ci = support::is_sanitized ? 1'000 : 10'000;
  const std::uint64_t first = support::number_from_environment("PNEUMA_SEED", 0);
  const std::uint64_t count =
      support::number_from_environment("PNEUMA_SEEDS", std::getenv("PNEUMA_SEED") == nullptr ? in_ci : 1);
  for (std::uint64_t seed = first; seed < first + count && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("PNEUMA_SEED=" + std::to_string(seed));
    SimulatedLives(seed).run();
  }
  spdlog::set_level(spdlog::level::info);
}

}  // namespace
}  // namespace pneuma::app
