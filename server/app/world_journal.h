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

  /// Why not all of the world can be kept now; OK where it can.
  [[nodiscard]] base::Status trouble() const;
  /// The interval has passed, something happened since, and the last one is written. Where there is trouble, sooner.
  [[nodiscard]] bool checkpoint_due(TimePoint now, std::uint64_t tick) const;
  /// When to look again though nothing happens: where there is trouble, or a checkpoint is under way that may fail.
  [[nodiscard]] std::optional<TimePoint> next_try() const;
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
    std::uint64_t next_sequence = 0;  // past the last checkpoint that was written
    base::Status trouble;             // of the last try
  };

  /// Begins a new log; returns what writes the checkpoint that it follows, or why there is no log to be had.
  [[nodiscard]] base::Result<std::function<base::Status()>> begin(TimePoint now, LiveWorld::Saved saved, bool paused);
  [[nodiscard]] base::Status begin_log();
  base::Status report(base::Status status) const;
  [[nodiscard]] bool lacks_a_change() const;

  const std::string world_;
  const Wiring wiring_;
  std::uint64_t next_sequence_;
  std::optional<persist::CommandLog> log_;
  TimePoint last_checkpoint_{};
  std::uint64_t last_tick_ = 0;                     // of the last checkpoint
  bool written_ = false;                            // to the log, since then
  base::Status log_trouble_;                        // of the last write
  std::optional<std::uint64_t> checkpoint_needed_;  // the first whose state has a change that the log lacks
  std::shared_ptr<Written> checkpoints_ = std::make_shared<Written>();
};

}  // namespace pneuma::app
