// Checkpoints: a world's whole state, as bytes that mean nothing here. The last three of a world are kept, and a
// damaged one is passed over for the one before it.
//
// A file is "PNEUMACK", then little-endian: u32 version (1), u32 CRC32C of all that follows, u64 sequence, u64 tick,
// u64 length, and that many bytes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/status.h"
#include "persist/data_dir.h"

namespace pneuma::persist {

inline constexpr std::size_t checkpoints_kept = 3;

struct Checkpoint {
  // Numbers a world's checkpoints; commands that come after checkpoint n go to log n (command_log.h).
  std::uint64_t sequence = 0;
  std::uint64_t tick = 0;
  std::string bytes;
};

struct Recovered {
  Checkpoint checkpoint;
  std::vector<base::Status> damaged;  // newer ones that could not be used: which file, and why
  std::uint64_t next_sequence = 0;    // past every checkpoint and log on the disk
};

/// Writes to a temporary file, syncs it, renames it into place and syncs the folder; then removes the checkpoints that
/// are no longer among the last three, and the logs that only they needed. Where anything fails, the checkpoints that
/// were there are still there. One at a time for a world; any number for different worlds.
[[nodiscard]] base::Status write_checkpoint(const DataDir& data_dir, const std::string& world,
                                            const Checkpoint& checkpoint);

/// One checkpoint; fails with malformed, naming the file, where it is damaged.
[[nodiscard]] base::Result<Checkpoint> read_checkpoint(const DataDir& data_dir, const std::string& world,
                                                       std::uint64_t sequence);

/// The newest checkpoint that is whole. Fails with not_found where there is none at all, and with malformed, naming
/// each file, where all are damaged.
[[nodiscard]] base::Result<Recovered> read_latest_checkpoint(const DataDir& data_dir, const std::string& world);

}  // namespace pneuma::persist
