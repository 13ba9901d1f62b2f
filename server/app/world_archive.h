// The data directory as the host sees it: worlds that were, and room for those to come.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "app/live_world.h"
#include "app/world_journal.h"
#include "app/world_memory.h"
#include "base/status.h"
#include "persist/data_dir.h"
#include "persist/files.h"
#include "persist/history.h"

namespace pneuma::app {

class WorldArchive {
 public:
  /// `disk`, `metrics` and `files` must outlive the archive. Errors name the directory.
  [[nodiscard]] static base::Result<WorldArchive> open(const std::string& data_dir,
                                                       std::chrono::duration<double> checkpoint_interval,
                                                       persist::Sync sync, BackgroundQueue& disk, Metrics& metrics,
                                                       persist::Files& files = persist::system_files());

  struct Restored {
    std::string name;
    LiveWorld live;
    bool paused = false;
    std::unique_ptr<WorldJournal> journal;
    WorldMemory memory;
  };
  /// The worlds that are kept, by name. Folders whose names no world can have are left alone, and logged.
  [[nodiscard]] base::Result<std::vector<std::string>> names() const;
  /// A world's latest good checkpoint with its commands replayed. It counts in the memory of `room`, and comes back
  /// past its limit too. With `recover` it comes back up to a damage, and the damaged files are kept aside. Where
  /// `is_over` becomes true, UNAVAILABLE. Any thread; one at a time for a world.
  [[nodiscard]] base::Result<Restored> restore(const std::string& name, const WorldMemory::Limits& room, bool recover,
                                               const std::atomic<bool>& is_over) const;

  /// Removes what is kept of a world.
  [[nodiscard]] base::Status remove(const std::string& name) const { return data_dir_->remove_world(name); }

  /// persist::read_history of a world; on the thread that writes checkpoints.
  [[nodiscard]] base::Result<persist::History> read_history(const std::string& name,
                                                            const persist::HistoryRange& range) const {
    return persist::read_history(*data_dir_, name, range);
  }

  /// persist::history_bytes of a world, likewise.
  [[nodiscard]] base::Result<std::uint64_t> history_bytes(const std::string& name,
                                                          const persist::HistoryRange& range) const {
    return persist::history_bytes(*data_dir_, name, range);
  }

  /// A journal for a new world, whose first checkpoint is written; nothing is left of it where that fails.
  [[nodiscard]] base::Result<std::unique_ptr<WorldJournal>> begin(const std::string& name, const LiveWorld& live,
                                                                  bool paused);

 private:
  WorldArchive(std::unique_ptr<persist::DataDir> data_dir, WorldJournal::Wiring wiring)
      : data_dir_(std::move(data_dir)), wiring_(wiring) {}

  std::unique_ptr<persist::DataDir> data_dir_;  // the journals point to it
  WorldJournal::Wiring wiring_;
};

}  // namespace pneuma::app
