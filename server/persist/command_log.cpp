#include "persist/command_log.h"

#include <algorithm>
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
constexpr std::uint32_t log_version = 1;
constexpr std::size_t log_header_bytes = log_magic.size() + 2 * sizeof(std::uint32_t) + sizeof(std::uint64_t);
constexpr std::size_t record_header_bytes = 2 * sizeof(std::uint32_t) + sizeof(std::uint64_t);

std::string make_header(std::uint64_t sequence) {
  std::string summed;
  append_number(summed, sequence);
  std::string header(log_magic);
  append_number(header, log_version);
  append_number(header, crc32c(summed));
  return header + summed;
}

/// Takes the records of one file; the status says why the rest of it was left out.
base::Status take_records(std::string_view bytes, std::uint64_t sequence, const std::string& path,
                          std::vector<LogRecord>& records) {
  const auto cut = [&path](std::size_t offset, const std::string& what) {
    return base::Status(base::StatusCode::malformed, what + " at byte " + std::to_string(offset), path);
  };
  if (!bytes.starts_with(make_header(sequence))) return cut(0, "no header of this log");
  std::size_t offset = log_header_bytes;
  while (offset < bytes.size()) {
    const std::size_t left = bytes.size() - offset;
    if (left < record_header_bytes) return cut(offset, "a record is cut off");
    const auto length = number_at<std::uint32_t>(bytes, offset);
    if (length > left - record_header_bytes) return cut(offset, "a record is cut off");
    constexpr std::size_t summed_from = 2 * sizeof(std::uint32_t);
    const std::string_view summed = bytes.substr(offset + summed_from, sizeof(std::uint64_t) + length);
    if (crc32c(summed) != number_at<std::uint32_t>(bytes, offset + sizeof(std::uint32_t))) {
      return cut(offset, "a record does not match its checksum");
    }
    records.push_back({number_at<std::uint64_t>(summed, 0), std::string(summed.substr(sizeof(std::uint64_t)))});
    offset += record_header_bytes + length;
  }
  return {};
}

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
  CommandLog log(files, file, path, sync, bytes_max);
  log.pending_ = make_header(sequence);
  if (auto status = log.commit(); !status.ok()) return status;
  if (sync == Sync::every_commit) {
    if (auto status = sync_folder(files, *folder); !status.ok()) return status;
  }
  return log;
}

CommandLog::CommandLog(CommandLog&& other) noexcept
    : files_(other.files_),
      file_(std::exchange(other.file_, -1)),
      path_(std::move(other.path_)),
      sync_(other.sync_),
      bytes_max_(other.bytes_max_),
      committed_bytes_(other.committed_bytes_),
      pending_(std::move(other.pending_)) {}

CommandLog& CommandLog::operator=(CommandLog&& other) noexcept {
  std::swap(files_, other.files_);
  std::swap(file_, other.file_);
  std::swap(path_, other.path_);
  std::swap(sync_, other.sync_);
  std::swap(bytes_max_, other.bytes_max_);
  std::swap(committed_bytes_, other.committed_bytes_);
  std::swap(pending_, other.pending_);
  return *this;
}

CommandLog::~CommandLog() {
  if (file_ >= 0) files_->close(file_);
}

base::Status CommandLog::append(std::uint64_t tick, std::string_view bytes) {
  const std::size_t pending_bytes = pending_.size() + record_header_bytes + bytes.size();
  if (pending_bytes > base::log_pending_bytes_max) {
    return {base::StatusCode::limit_exceeded,
            std::to_string(base::log_pending_bytes_max) + " bytes wait for the disk already", path_};
  }
  if (committed_bytes_ + pending_bytes > bytes_max_) {
    return {base::StatusCode::limit_exceeded,
            "is full: a log has at most " + std::to_string(bytes_max_) + " bytes; the next checkpoint begins another",
            path_};
  }
  std::string summed;
  append_number(summed, tick);
  append_number(pending_, static_cast<std::uint32_t>(bytes.size()));
  append_number(pending_, crc32c(bytes, crc32c(summed)));
  pending_ += summed;
  pending_ += bytes;
  return {};
}

base::Status CommandLog::commit() {
  if (pending_.empty()) return {};
  // Always from the end of what is known to be written: what a write that failed half-way has left is written over.
  if (auto status = write_all(*files_, file_, path_, pending_, committed_bytes_); !status.ok()) return status;
  // After a failed sync the system may drop what it could not write; so it counts as unwritten, and goes again.
  if (sync_ == Sync::every_commit && files_->fsync(file_) < 0) return system_failure("sync", path_);
  committed_bytes_ += pending_.size();
  pending_.clear();
  return {};
}

base::Result<Replay> read_commands(const DataDir& data_dir, const std::string& world, std::uint64_t sequence) {
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  const auto numbers = numbered_files(*folder, log_prefix);
  if (!numbers.ok()) return numbers.status();
  Replay replay;
  for (auto number = std::lower_bound(numbers->begin(), numbers->end(), sequence); number != numbers->end(); ++number) {
    const std::string path = numbered_file(*folder, log_prefix, *number);
    if (*number != sequence) {
      replay.cut.emplace_back(base::StatusCode::malformed, "the log before it is missing", path);
      break;
    }
    const auto bytes = read_file(data_dir.files(), path, base::log_bytes_max);
    if (!bytes.ok()) return bytes.status();
    if (auto status = take_records(*bytes, *number, path, replay.records); !status.ok()) {
      replay.cut.push_back(std::move(status));
      break;
    }
    ++sequence;
  }
  return replay;
}

}  // namespace pneuma::persist
