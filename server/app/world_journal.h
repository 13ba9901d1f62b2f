// What is kept of one world while it runs: its commands as they come, and a checkpoint every few seconds.
// Disk errors are logged and counted; the world goes on. The thread that steps the world.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "app/background_queue.h"
#include "app/live_world.h"
#include "app/metrics.h"
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

  /// Checkpoints are numbered from `next_sequence`; the first one must be written before anything is appended.
  WorldJournal(std::string world, std::uint64_t next_sequence, Wiring wiring);

  /// A request that took effect after `tick` ticks. It is on its way to the disk when this returns, and outlives the
  /// process.
  void append(std::uint64_t tick, const v1::ClientMessage& message);
  /// The world stood at this tick: a replay goes on at least to here.
  void note_tick(std::uint64_t tick);

  /// The interval has passed, something happened since, and the last one is written.
  [[nodiscard]] bool checkpoint_due(TimePoint now, std::uint64_t tick) const;
  /// Begins a new log and hands the state to the disk thread.
  void checkpoint(TimePoint now, LiveWorld::Saved saved, bool paused);
  /// The same, and returns when it is written: a world that was announced outlives the process.
  void checkpoint_now(LiveWorld::Saved saved, bool paused);

  /// Removes the world from the disk.
  void remove();

 private:
  /// Begins a new log; returns what writes the checkpoint that it follows, or nothing where there is no log to be had.
  [[nodiscard]] std::function<void()> begin(TimePoint now, LiveWorld::Saved saved, bool paused);
  void report(const base::Status& status) const;

  const std::string world_;
  const Wiring wiring_;
  std::uint64_t next_sequence_;
  std::optional<persist::CommandLog> log_;
  TimePoint last_checkpoint_{};
  std::uint64_t last_tick_ = 0;  // of the last checkpoint
  bool appended_ = false;        // since then
  std::shared_ptr<std::atomic<bool>> writing_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace pneuma::app
