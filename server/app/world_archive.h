// The data directory as the host sees it: worlds that were, and room for those to come.
#pragma once

#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "app/live_world.h"
#include "app/world_journal.h"
#include "app/world_memory.h"
#include "base/status.h"
#include "persist/data_dir.h"

namespace pneuma::app {

class WorldArchive {
 public:
  /// `disk` and `metrics` must outlive the archive. Errors name the directory.
  [[nodiscard]] static base::Result<WorldArchive> open(const std::string& data_dir,
                                                       std::chrono::duration<double> checkpoint_interval,
                                                       BackgroundQueue& disk, Metrics& metrics);

  struct Restored {
    std::string name;
    LiveWorld live;
    bool paused = false;
    std::unique_ptr<WorldJournal> journal;
    WorldMemory memory;
  };
  struct Found {
    std::vector<Restored> worlds;
    std::vector<std::string> damaged;  // names; why was logged
  };
  /// Of the worlds named in `recover` what comes before the damage comes back; the damaged files are kept aside.
  /// Each world's latest good checkpoint with its commands replayed, on `threads` threads. They count in the memory of
  /// `room`, and come back past its limit too.
  [[nodiscard]] base::Result<Found> restore_all(std::size_t threads, const WorldMemory::Limits& room,
                                                const std::set<std::string>& recover);

  /// Removes what is kept of a world.
  [[nodiscard]] base::Status remove(const std::string& name) const { return data_dir_->remove_world(name); }

  /// A journal for a new world, whose first checkpoint is written; nothing is left of it where that fails.
  [[nodiscard]] base::Result<std::unique_ptr<WorldJournal>> begin(const std::string& name, const LiveWorld& live,
                                                                  bool paused);

 private:
  WorldArchive(std::unique_ptr<persist::DataDir> data_dir, WorldJournal::Wiring wiring)
      : data_dir_(std::move(data_dir)), wiring_(wiring) {}
  [[nodiscard]] base::Result<Restored> restore(const std::string& name, const WorldMemory::Limits& room,
                                               bool recover) const;

  std::unique_ptr<persist::DataDir> data_dir_;  // the journals point to it
  WorldJournal::Wiring wiring_;
};

}  // namespace pneuma::app
