// What is kept of one world while it runs: its commands, each before it is carried out, and a checkpoint every few
// seconds. What cannot be written is not to be done; when the disk takes writes again, it can be.
// The thread that steps the world.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "app/background_queue.h"
#include "app/live_world.h"
#include "app/metrics.h"
#include "base/status.h"
#include "persist/checkpoint.h"
#include "persist/command_log.h"
#include "persist/data_dir.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

class WorldJournal {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  struct Wiring {
    const persist::DataDir* data_dir;
    BackgroundQueue* disk;  // where checkpoints are written
    Metrics* metrics;
    std::chrono::duration<double> checkpoint_interval;
    persist::Sync sync = persist::Sync::none;
  };

  /// Checkpoints are numbered from `next_sequence`; the first one must be asked for before anything is written. `log`:
  /// of a world that was kept before, where its log goes on.
  WorldJournal(std::string world, std::uint64_t next_sequence, Wiring wiring,
               std::optional<persist::CommandLog> log = std::nullopt);

  /// A request that will take effect after `tick` ticks: once this returns OK it outlives the process. Where it cannot
  /// be written it must not be carried out.
  [[nodiscard]] base::Status write(std::uint64_t tick, const v1::ClientMessage& message);
  /// The request that was written last was refused after all.
  void take_back();
  /// The world stands at this tick: a replay goes on at least to here.
  [[nodiscard]] base::Status note_tick(std::uint64_t tick);
  /// Something changed the world that could not be written: until a checkpoint is, nothing more can be.
  void lost_a_change();

  /// What was kept before the next checkpoint does not lead to it.
  void forget_past() { first_checkpoint_ = next_sequence_; }
  /// The first checkpoint from which on the logs lead to the world as it is.
  [[nodiscard]] std::uint64_t first_checkpoint() const { return first_checkpoint_; }
  [[nodiscard]] std::optional<persist::LogEnd> log_end() const;

  /// Why not all of the world can be kept now; OK where it can.
  [[nodiscard]] base::Status trouble() const;
  /// The interval has passed, something happened since, and the last one is written. A second is enough where there is
  /// trouble, or where the log is long (base::log_bytes_before_checkpoint).
  [[nodiscard]] bool checkpoint_due(TimePoint now, std::uint64_t tick) const;
  /// Hands what was written to the disk thread, to be synced, where that is to be done each second and it is time.
  void sync_if_due(TimePoint now);
  /// When to look again though nothing happens: where there is trouble, where a checkpoint is under way that may fail,
  /// where the log is long, or something is to be synced.
  [[nodiscard]] std::optional<TimePoint> next_try(TimePoint now) const;
  /// When the last checkpoint was written; none where it has all of the world, which is at `tick`.
  [[nodiscard]] std::optional<TimePoint> behind_checkpoint_of(std::uint64_t tick) const;
  /// Begins a new log and hands the state to the disk thread.
  void checkpoint(TimePoint now, LiveWorld::Saved saved, bool paused);
  /// The same, and returns when it is written: a world that was announced outlives the process.
  [[nodiscard]] base::Status checkpoint_now(LiveWorld::Saved saved, bool paused);

  /// Removes the world from the disk.
  [[nodiscard]] base::Status remove();

 private:
  /// What the disk thread tells.
  struct Written {
    std::mutex mutex;
    bool under_way = false;
    bool syncing = false;
    std::uint64_t next_sequence = 0;  // past the last checkpoint that was written
    TimePoint at{};                   // when that was
    base::Status trouble;             // of the last try
  };

  /// Begins a new log; returns what writes the checkpoint that it follows, or why there is no log to be had.
  [[nodiscard]] base::Result<std::function<base::Status()>> begin(TimePoint now, LiveWorld::Saved saved, bool paused);
  /// What syncs the old log, where that is still to be done.
  [[nodiscard]] base::Result<std::function<base::Status()>> begin_log();
  [[nodiscard]] static base::Status reported(const Wiring& wiring, const std::string& world, base::Status status);
  base::Status report(base::Status status) const { return reported(wiring_, world_, std::move(status)); }
  [[nodiscard]] bool lacks_a_change() const;
  [[nodiscard]] bool is_log_long() const;

  const std::string world_;
  const Wiring wiring_;
  std::uint64_t next_sequence_;
  std::uint64_t first_checkpoint_ = 0;
  std::optional<persist::CommandLog> log_;
  TimePoint last_checkpoint_{};
  std::uint64_t last_tick_ = 0;                     // of the last checkpoint
  TimePoint last_sync_{};                           // begun
  bool written_ = false;                            // to the log, since then
  base::Status log_trouble_;                        // of the last write
  std::optional<std::uint64_t> checkpoint_needed_;  // the first whose state has a change that the log lacks
  std::shared_ptr<Written> checkpoints_ = std::make_shared<Written>();
};

}  // namespace pneuma::app
