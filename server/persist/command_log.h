// The command log: what was asked of a world since a checkpoint, tick by tick, so that replaying it on that checkpoint
// gives the same world. One file follows each checkpoint.
//
// A file is "PNEUMALG", u32 version (1), u32 CRC32C of the sequence, u64 sequence; then records of u32 length,
// u32 CRC32C of tick and bytes, u64 tick and `length` bytes. All little-endian.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/limits.h"
#include "base/status.h"
#include "persist/data_dir.h"

namespace pneuma::persist {

enum class Sync {
  none,          // committed records outlive the process (kill -9), not the machine
  every_commit,  // and the machine
};

/// Appends to one file. Not thread-safe.
class CommandLog {
 public:
  /// Begins the log that follows checkpoint `sequence` of the world, empty. It grows to bytes_max, past which
  /// read_commands would not read it.
  [[nodiscard]] static base::Result<CommandLog> start(const DataDir& data_dir, const std::string& world,
                                                      std::uint64_t sequence, Sync sync,
                                                      std::uint64_t bytes_max = base::log_bytes_max);
  CommandLog(CommandLog&& other) noexcept;
  CommandLog& operator=(CommandLog&& other) noexcept;
  ~CommandLog();  // what was not committed is lost

  /// Takes a record into memory; no file is touched. Ticks never go down. Refused where more than
  /// log_pending_bytes_max bytes wait already, and where the file would pass its bytes_max.
  [[nodiscard]] base::Status append(std::uint64_t tick, std::string_view bytes);
  /// Writes what was appended. Where that fails, the records stay in memory and the next commit writes them again.
  [[nodiscard]] base::Status commit();

 private:
  CommandLog(Files& files, int file, std::string path, Sync sync, std::uint64_t bytes_max)
      : files_(&files), file_(file), path_(std::move(path)), sync_(sync), bytes_max_(bytes_max) {}

  Files* files_;
  int file_;
  std::string path_;
  Sync sync_;
  std::uint64_t bytes_max_;
  std::uint64_t committed_bytes_ = 0;
  std::string pending_;
};

struct LogRecord {
  std::uint64_t tick = 0;
  std::string bytes;
};

struct Replay {
  std::vector<LogRecord> records;  // in the order in which they were appended
  std::vector<base::Status> cut;   // damaged ends that were left out: which file, where, and why
};

/// All that was committed after checkpoint `sequence`, through every later log. Reading ends at the first damaged or
/// cut-off record, or missing log: what comes after it would be replayed on the wrong state.
[[nodiscard]] base::Result<Replay> read_commands(const DataDir& data_dir, const std::string& world,
                                                 std::uint64_t sequence);

}  // namespace pneuma::persist
