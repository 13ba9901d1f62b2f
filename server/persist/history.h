// What is kept of a running world's past: a checkpoint, and what was asked of the world since.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/status.h"
#include "persist/checkpoint.h"
#include "persist/command_log.h"
#include "persist/data_dir.h"

namespace pneuma::persist {

struct History {
  Checkpoint begin;
  std::vector<LogRecord> records;
};

struct HistoryRange {
  /// The newest checkpoint before this tick, or else the oldest one at it. None: the oldest one of all.
  std::optional<std::uint64_t> tick;
  std::uint64_t sequence_min = 0;  // no older checkpoint
  LogEnd until;                    // where the log stands
  std::uint64_t bytes_max = 0;     // of the checkpoint and the logs together, on the disk
};

/// Fails with not_found, and the first tick that there is, where the past does not go back so far; with limit_exceeded
/// where no checkpoint and its logs are within bytes_max. Not while old checkpoints are being removed: on the thread
/// that writes them.
[[nodiscard]] base::Result<History> read_history(const DataDir& data_dir, const std::string& world,
                                                 const HistoryRange& range);

/// What read_history reads at most, whatever the range's tick and bytes_max.
[[nodiscard]] base::Result<std::uint64_t> history_bytes(const DataDir& data_dir, const std::string& world,
                                                        const HistoryRange& range);

}  // namespace pneuma::persist
