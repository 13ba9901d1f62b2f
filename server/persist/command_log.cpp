#include "persist/command_log.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include <fcntl.h>

#include "base/byte_order.h"
#include "base/crc32c.h"
#include "base/limits.h"
#include "persist/world_files.h"

namespace pneuma::persist {

using base::append_number;
using base::crc32c;
using base::number_at;

namespace {

constexpr std::string_view log_magic = "PNEUMALG";
constexpr std::uint32_t log_version = 2;
constexpr std::uint32_t log_version_unchained = 1;
static_assert(log_header_bytes == log_magic.size() + 2 * sizeof(std::uint32_t) + sizeof(std::uint64_t));
constexpr std::size_t record_header_bytes = 3 * sizeof(std::uint32_t) + sizeof(std::uint64_t);

std::string make_header(std::uint64_t sequence, std::uint32_t version = log_version) {
  std::string summed;
  append_number(summed, sequence);
  std::string header(log_magic);
  append_number(header, version);
  append_number(header, crc32c(summed));
  return header + summed;
}

std::uint32_t head_sum(std::uint32_t length, std::uint64_t tick, std::uint32_t sum_before) {
  std::string summed;
  append_number(summed, length);
  append_number(summed, tick);
  return crc32c(summed, sum_before);
}

/// How a log ended.
struct End {
  bool chained = true;  // it is of a version that has a seal
  bool sealed = false;
  std::optional<base::Status> torn = {};
  std::optional<base::Status> damage = {};
  std::uint64_t bytes = 0;  // up to the last whole record
  std::uint32_t sum = 0;    // of it
};

/// Goes through the records of one file.
class LogReader {
 public:
  LogReader(std::string_view bytes, const std::string& path) : bytes_(bytes), path_(path) {}

  End read(std::uint64_t sequence, std::vector<LogRecord>& records) {
    if (bytes_.starts_with(make_header(sequence, log_version_unchained))) {
      end_.chained = false;
      end_.bytes = log_header_bytes;
      while (end_.bytes < bytes_.size() && take_unchained(records)) {
      }
      return end_;
    }
    const std::string header = make_header(sequence);
    if (!bytes_.starts_with(header)) {
      const bool is_begun = bytes_.size() < header.size() && header.starts_with(bytes_);
      (void)(is_begun ? torn() : damaged("no header of this log"));
      return end_;
    }
    end_.bytes = log_header_bytes;
    while (end_.bytes < bytes_.size() && take(records)) {
    }
    return end_;
  }

 private:
  /// False where the log ends before its file does.
  bool take(std::vector<LogRecord>& records) {
    const std::size_t at = end_.bytes;
    if (end_.sealed) return damaged("something follows the log's end");
    if (is_blank() || left() < record_header_bytes) return torn();
    const auto length = number_at<std::uint32_t>(bytes_, at);
    const auto tick = number_at<std::uint64_t>(bytes_, at + 2 * sizeof(std::uint32_t));
    const std::uint32_t head = head_sum(length, tick, end_.sum);
    if (head != number_at<std::uint32_t>(bytes_, at + sizeof(std::uint32_t))) {
      return damaged("a record's head does not match its checksum");
    }
    if (length > left() - record_header_bytes) return torn();
    const std::string_view body = bytes_.substr(at + record_header_bytes, length);
    const std::uint32_t sum = crc32c(body, head);
    if (sum != number_at<std::uint32_t>(bytes_, at + record_header_bytes - sizeof(std::uint32_t))) {
      return damaged("a record does not match its checksum");
    }
    if (length == 0) {
      end_.sealed = true;
    } else {
      records.push_back({tick, std::string(body)});
    }
    end_.sum = sum;
    end_.bytes += record_header_bytes + length;
    return true;
  }

  bool take_unchained(std::vector<LogRecord>& records) {
    constexpr std::size_t summed_from = 2 * sizeof(std::uint32_t);
    constexpr std::size_t head_bytes = summed_from + sizeof(std::uint64_t);
    const std::size_t at = end_.bytes;
    if (is_blank() || left() < head_bytes) return torn();
    const auto length = number_at<std::uint32_t>(bytes_, at);
    if (length > left() - head_bytes) return torn();
    const std::string_view summed = bytes_.substr(at + summed_from, sizeof(std::uint64_t) + length);
    if (crc32c(summed) != number_at<std::uint32_t>(bytes_, at + sizeof(std::uint32_t))) {
      return damaged("a record does not match its checksum");
    }
    records.push_back({number_at<std::uint64_t>(summed, 0), std::string(summed.substr(sizeof(std::uint64_t)))});
    end_.bytes += head_bytes + length;
    return true;
  }

  [[nodiscard]] std::size_t left() const { return bytes_.size() - end_.bytes; }
  /// Where the machine itself went down, a file may have its new length and not yet its bytes.
  [[nodiscard]] bool is_blank() const { return bytes_.find_first_not_of('\0', end_.bytes) == std::string_view::npos; }
  [[nodiscard]] base::Status at_end(const std::string& what) const {
    return {base::StatusCode::malformed, what + " at byte " + std::to_string(end_.bytes), path_};
  }
  bool torn() {
    end_.torn = at_end("a record is cut off");
    return false;
  }
  bool damaged(const std::string& what) {
    end_.damage = at_end(what);
    return false;
  }

  std::string_view bytes_;
  const std::string& path_;
  End end_;
};

}  // namespace

base::Result<CommandLog> CommandLog::start(const DataDir& data_dir, const std::string& world, std::uint64_t sequence,
                                           Sync sync, std::uint64_t bytes_max) {
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  Files& files = data_dir.files();
  if (auto status = make_folder(files, *folder); !status.ok()) return status;
  const std::string path = numbered_file(*folder, log_prefix, sequence);
  const int file = files.open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
  if (file < 0) return system_failure("make", path);
  CommandLog log(files, file, path, sequence, sync, bytes_max);
  const std::string header = make_header(sequence);
  base::Status status = log.write_at_end(header);
  if (status.ok() && sync == Sync::every_record) status = sync_folder(files, *folder);
  // What is there of it stays: the seal of the log before may be on the disk, though it failed.
  if (!status.ok()) return status;
  log.bytes_ = log.bytes_before_ = header.size();
  return log;
}

base::Result<CommandLog> CommandLog::resume(const DataDir& data_dir, const std::string& world, const LogEnd& end,
                                            Sync sync, std::uint64_t bytes_max) {
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  const std::string path = numbered_file(*folder, log_prefix, end.sequence);
  const int file = data_dir.files().open(path.c_str(), O_WRONLY | O_CLOEXEC, 0);
  if (file < 0) return system_failure("open", path);
  CommandLog log(data_dir.files(), file, path, end.sequence, sync, bytes_max);
  log.bytes_ = log.bytes_before_ = end.bytes;
  log.sum_ = log.sum_before_ = end.sum;
  log.has_rest_ = true;
  return log;
}

base::Status CommandLog::write(std::uint64_t tick, std::string_view bytes) {
  assert(!bytes.empty());
  const std::uint64_t room = bytes_max_ - std::min(bytes_max_, bytes_);
  if (room < 2 * record_header_bytes || bytes.size() > room - 2 * record_header_bytes) {  // its seal's place is kept
    return {base::StatusCode::limit_exceeded,
            "is full: a log has at most " + std::to_string(bytes_max_) + " bytes; the next checkpoint begins another",
            path_};
  }
  return write_record(tick, bytes);
}

base::Status CommandLog::seal(std::uint64_t tick) {
  return write_record(tick, {});
}

base::Status CommandLog::write_record(std::uint64_t tick, std::string_view bytes) {
  const auto length = static_cast<std::uint32_t>(bytes.size());
  const std::uint32_t head = head_sum(length, tick, sum_);
  const std::uint32_t sum = crc32c(bytes, head);
  std::string record;
  record.reserve(record_header_bytes + bytes.size());
  append_number(record, length);
  append_number(record, head);
  append_number(record, tick);
  append_number(record, sum);
  record += bytes;
  if (base::Status failed = write_at_end(record); !failed.ok()) return failed;
  bytes_before_ = std::exchange(bytes_, bytes_ + record.size());
  sum_before_ = std::exchange(sum_, sum);
  return {};
}

base::Status CommandLog::write_at_end(std::string_view bytes) {
  if (has_rest_) {
    if (base::Status failed = cut_off(); !failed.ok()) return failed;
  }
  base::Status failed = write_all(file_->files, file_->number, path_, bytes, bytes_);
  // After a failed sync the system may drop what it could not write; so it counts as unwritten.
  if (failed.ok() && sync_ == Sync::every_record && file_->files.fsync(file_->number) < 0) {
    failed = system_failure("sync", path_);
  }
  needs_sync_ = needs_sync_ || sync_ == Sync::each_second;
  if (failed.ok()) return {};
  has_rest_ = true;
  (void)cut_off();  // or before the next record
  return failed;
}

base::Status CommandLog::take_back() {
  bytes_ = bytes_before_;
  sum_ = sum_before_;
  has_rest_ = true;
  return cut_off();
}

base::Status CommandLog::cut_off() {
  if (file_->files.ftruncate(file_->number, static_cast<off_t>(bytes_)) < 0) return system_failure("cut", path_);
  has_rest_ = false;
  return {};
}

std::function<base::Status()> CommandLog::sync_job() {
  needs_sync_ = false;
  return [file = file_, path = path_]() -> base::Status {
    if (file->files.fsync(file->number) < 0) return system_failure("sync", path);
    return sync_folder(file->files, path.substr(0, path.rfind('/')));
  };
}

base::Result<Replay> read_commands(const DataDir& data_dir, const std::string& world, std::uint64_t sequence,
                                   const std::optional<LogEnd>& until) {
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  const auto numbers = numbered_files(*folder, log_prefix);
  if (!numbers.ok()) return numbers.status();
  Replay replay;
  const auto missing = [&](std::uint64_t number) {
    replay.damage.emplace(base::StatusCode::malformed, "is missing", numbered_file(*folder, log_prefix, number));
    return replay;
  };
  auto number = std::lower_bound(numbers->begin(), numbers->end(), sequence);
  if (number == numbers->end()) return missing(sequence);  // a log follows each checkpoint
  std::optional<base::Status> unsealed;  // a log that was passed, and what is wrong if any other goes on
  End end;
  End last;  // of the first that is not sealed, or of the very last
  std::uint64_t last_sequence = sequence;
  for (; number != numbers->end() && (!until || sequence <= until->sequence); ++number, ++sequence) {
    if (*number != sequence) return missing(sequence);
    const std::string path = numbered_file(*folder, log_prefix, *number);
    auto bytes = read_file(data_dir.files(), path, base::log_bytes_max);
    if (!bytes.ok()) {
      replay.damage = bytes.status();
      return replay;
    }
    if (until && *number == until->sequence && bytes->size() > until->bytes) bytes->resize(until->bytes);
    const std::size_t records_before = replay.records.size();
    end = LogReader(*bytes, path).read(*number, replay.records);
    if (unsealed && replay.records.size() > records_before) {
      // A log is sealed once the next one is begun, and before anything is written to that.
      replay.records.resize(records_before);
      end.damage = unsealed;
    }
    if (end.damage) {
      replay.damage = std::move(end.damage);
      return replay;
    }
    if (unsealed) continue;
    last = end;
    last_sequence = sequence;
    if (end.torn) {
      unsealed = end.torn;
    } else if (end.chained && !end.sealed) {
      unsealed.emplace(base::StatusCode::malformed, "its end is missing", path);
    }
  }
  if (until) {
    if (sequence <= until->sequence || end.bytes != until->bytes) return missing(until->sequence);
    return replay;
  }
  if (end.sealed) return missing(sequence);
  replay.torn = last.torn;
  replay.next_sequence = last.bytes > 0 ? last_sequence + 1 : last_sequence;
  if (!last.chained) replay.next_sequence = sequence;
  if (last.chained && last.bytes > 0) replay.end = LogEnd{last_sequence, last.bytes, last.sum};
  return replay;
}

}  // namespace pneuma::persist
