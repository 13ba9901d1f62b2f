// The command log: what was asked of a world since a checkpoint, tick by tick, so that replaying it on that checkpoint
// gives the same world. One file follows each checkpoint.
//
// A file is "PNEUMALG", u32 version (2), u32 CRC32C of the sequence, u64 sequence; then records of u32 length, u32 head
// sum, u64 tick, u32 sum, and `length` bytes. The head sum is the CRC32C of the length and the tick, and goes on from
// the sum of the record before (of the first: 0); the sum is that of the bytes, and goes on from the head sum. So no
// record can be taken out of the middle. A record without bytes is the seal: the commands go on in the next file. All
// little-endian. Files of version 1 are read too: their records have u32 length, u32 CRC32C of tick and bytes, u64 tick
// and the bytes, and no seal.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/limits.h"
#include "base/status.h"
#include "persist/data_dir.h"

namespace pneuma::persist {

inline constexpr std::size_t log_header_bytes = 24;

/// How much of a log a machine's crash may lose; a process's own (kill -9) loses none of it.
enum class Sync {
  none,          // what the system had not yet written by itself
  each_second,   // about a second's worth: whoever owns the log calls sync_job()
  every_record,  // nothing: each is on the disk before write() returns
};

/// Where a log stands that may go on.
struct LogEnd {
  std::uint64_t sequence = 0;
  std::uint64_t bytes = 0;  // up to the last whole record
  std::uint32_t sum = 0;    // of that record
};

/// Appends to one file. Not thread-safe.
class CommandLog {
 public:
  /// Begins the log that follows checkpoint `sequence` of the world, empty. It grows to bytes_max, past which
  /// read_commands would not read it.
  [[nodiscard]] static base::Result<CommandLog> start(const DataDir& data_dir, const std::string& world,
                                                      std::uint64_t sequence, Sync sync,
                                                      std::uint64_t bytes_max = base::log_bytes_max);
  /// Goes on with a log that was read back. What lies past its end is cut off before anything is written.
  [[nodiscard]] static base::Result<CommandLog> resume(const DataDir& data_dir, const std::string& world,
                                                       const LogEnd& end, Sync sync,
                                                       std::uint64_t bytes_max = base::log_bytes_max);

  /// Writes a record, not empty; ticks never go down. It is the log's last one from now on, and may be taken back until
  /// the next is written. Where it fails the log is as it was: what got to the disk of it is cut off before anything
  /// else is written.
  [[nodiscard]] base::Status write(std::uint64_t tick, std::string_view bytes);
  /// The last record never was.
  [[nodiscard]] base::Status take_back();
  /// Ends the log: another one goes on.
  [[nodiscard]] base::Status seal(std::uint64_t tick);
  /// Something was written that no sync_job() has covered.
  [[nodiscard]] bool needs_sync() const { return needs_sync_; }
  /// What brings all that is written by now, and the file's name, to the disk. Any thread, also when the log is gone.
  [[nodiscard]] std::function<base::Status()> sync_job();
  /// Up to where it is written.
  [[nodiscard]] LogEnd end() const { return {sequence_, bytes_, sum_}; }

 private:
  struct OpenFile {
    OpenFile(Files& its_files, int its_number) : files(its_files), number(its_number) {}
    OpenFile(const OpenFile&) = delete;
    OpenFile& operator=(const OpenFile&) = delete;
    ~OpenFile() { files.close(number); }
    Files& files;
    int number;
  };
  CommandLog(Files& files, int file, std::string path, std::uint64_t sequence, Sync sync, std::uint64_t bytes_max)
      : file_(std::make_shared<const OpenFile>(files, file)),
        path_(std::move(path)),
        sequence_(sequence),
        sync_(sync),
        bytes_max_(bytes_max) {}
  /// Writes at the end of what is there, which was cut off cleanly before.
  [[nodiscard]] base::Status write_at_end(std::string_view bytes);
  [[nodiscard]] base::Status write_record(std::uint64_t tick, std::string_view bytes);
  [[nodiscard]] base::Status cut_off();

  std::shared_ptr<const OpenFile> file_;  // shared with syncs under way
  std::string path_;
  std::uint64_t sequence_;
  Sync sync_;
  bool needs_sync_ = false;
  std::uint64_t bytes_max_;
  // What is there: how much, and the last record's sum. Past it lies what a failure has left, if any.
  std::uint64_t bytes_ = 0;
  std::uint32_t sum_ = 0;
  bool has_rest_ = false;
  // The same before the last record.
  std::uint64_t bytes_before_ = 0;
  std::uint32_t sum_before_ = 0;
};

struct LogRecord {
  std::uint64_t tick = 0;
  std::string bytes;
};

struct Replay {
  std::vector<LogRecord> records;  // in the order in which they were written
  /// The last log ends within a record: the process ended while it wrote, and the record was never acknowledged.
  std::optional<base::Status> torn;
  /// Something is damaged or missing there, and what comes after would be replayed on the wrong state: which file,
  /// where, and why. `records` are those before.
  std::optional<base::Status> damage;
  /// Where the log ends that may go on: the last one, but for empty ones that were begun before it was sealed. None
  /// that is damaged or of version 1, or has no header.
  std::optional<LogEnd> end;
  /// The log to begin next. What is there of that name, or past it, is empty.
  std::uint64_t next_sequence = 0;
};

/// All that was written after checkpoint `sequence`, through every later log; with `until`, up to there.
[[nodiscard]] base::Result<Replay> read_commands(const DataDir& data_dir, const std::string& world,
                                                 std::uint64_t sequence,
                                                 const std::optional<LogEnd>& until = std::nullopt);

}  // namespace pneuma::persist
