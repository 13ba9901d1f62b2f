#include "persist/checkpoint.h"

#include <algorithm>
#include <cerrno>
#include <string_view>

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

constexpr std::string_view magic = "PNEUMACK";
constexpr std::uint32_t version = 1;
constexpr std::size_t summed_from = magic.size() + 2 * sizeof(std::uint32_t);
constexpr std::size_t header_bytes = summed_from + 3 * sizeof(std::uint64_t);

std::string make_header(const Checkpoint& checkpoint) {
  std::string summed;
  append_number(summed, checkpoint.sequence);
  append_number(summed, checkpoint.tick);
  append_number(summed, static_cast<std::uint64_t>(checkpoint.bytes.size()));
  std::string header(magic);
  append_number(header, version);
  append_number(header, crc32c(checkpoint.bytes, crc32c(summed)));
  return header + summed;
}

base::Result<Checkpoint> read_file_of(Files& files, const std::string& path, std::uint64_t sequence) {
  auto file = read_file(files, path, header_bytes + base::checkpoint_bytes_max);
  if (!file.ok()) return file.status();
  const auto damaged = [&path](const std::string& what) {
    return base::Status(base::StatusCode::malformed, what, path);
  };
  const std::string_view bytes = *file;
  if (bytes.size() < header_bytes) return damaged("is cut off in its header");
  if (!bytes.starts_with(magic)) return damaged("is not a checkpoint");
  if (const auto its = number_at<std::uint32_t>(bytes, magic.size()); its != version) {
    return damaged("has version " + std::to_string(its) + "; this program reads " + std::to_string(version));
  }
  const auto length = number_at<std::uint64_t>(bytes, header_bytes - sizeof(std::uint64_t));
  if (length != bytes.size() - header_bytes) {
    return damaged("should hold " + std::to_string(length) + " bytes and holds " +
                   std::to_string(bytes.size() - header_bytes));
  }
  if (crc32c(bytes.substr(summed_from)) != number_at<std::uint32_t>(bytes, summed_from - sizeof(std::uint32_t))) {
    return damaged("does not match its checksum");
  }
  if (number_at<std::uint64_t>(bytes, summed_from) != sequence) return damaged("was made under another number");
  Checkpoint checkpoint{sequence, number_at<std::uint64_t>(bytes, summed_from + sizeof(std::uint64_t)), {}};
  file->erase(0, header_bytes);
  checkpoint.bytes = std::move(*file);
  return checkpoint;
}

base::Status write_new_file(Files& files, const std::string& path, const Checkpoint& checkpoint) {
  const int file = files.open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640);
  if (file < 0) return system_failure("make", path);
  const std::string header = make_header(checkpoint);
  base::Status status = write_all(files, file, path, header, 0);
  if (status.ok()) status = write_all(files, file, path, checkpoint.bytes, header.size());
  if (status.ok() && files.fsync(file) < 0) status = system_failure("sync", path);
  if (files.close(file) < 0 && status.ok()) status = system_failure("close", path);
  return status;
}

/// Of the checkpoints but the last few, and of the logs before the first that stays.
base::Status remove_old(Files& files, const std::string& folder) {
  const auto checkpoints = numbered_files(folder, checkpoint_prefix);
  if (!checkpoints.ok()) return checkpoints.status();
  if (checkpoints->size() <= checkpoints_kept) return {};
  const std::uint64_t first_kept = (*checkpoints)[checkpoints->size() - checkpoints_kept];
  for (const std::string_view prefix : {checkpoint_prefix, log_prefix}) {
    const auto numbers = numbered_files(folder, prefix);
    if (!numbers.ok()) return numbers.status();
    for (const std::uint64_t number : *numbers) {
      if (number >= first_kept) break;
      const std::string path = numbered_file(folder, prefix, number);
      if (files.unlink(path.c_str()) < 0 && errno != ENOENT) return system_failure("remove", path);
    }
  }
  return {};
}

}  // namespace

base::Status write_checkpoint(const DataDir& data_dir, const std::string& world, const Checkpoint& checkpoint) {
  if (checkpoint.bytes.size() > base::checkpoint_bytes_max) {
    return {base::StatusCode::limit_exceeded, "the checkpoint has " + std::to_string(checkpoint.bytes.size()) +
                                                  " bytes; at most " + std::to_string(base::checkpoint_bytes_max)};
  }
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  Files& files = data_dir.files();
  if (auto status = make_folder(files, *folder); !status.ok()) return status;

  const std::string temporary = std::string(*folder).append("/").append(unfinished_checkpoint);
  const std::string path = numbered_file(*folder, checkpoint_prefix, checkpoint.sequence);
  base::Status status = write_new_file(files, temporary, checkpoint);
  if (status.ok() && files.rename(temporary.c_str(), path.c_str()) < 0) status = system_failure("rename", temporary);
  if (!status.ok()) {
    files.unlink(temporary.c_str());  // as well as it goes; the next checkpoint writes over it
    return status;
  }
  if (auto synced = sync_folder(files, *folder); !synced.ok()) return synced;
  if (checkpoint.sequence == 0) {  // the world's folder itself may be new
    const std::string parent = folder->substr(0, folder->rfind('/'));
    if (auto synced = sync_folder(files, parent); !synced.ok()) return synced;
  }
  return remove_old(files, *folder);
}

base::Result<Checkpoint> read_checkpoint(const DataDir& data_dir, const std::string& world, std::uint64_t sequence) {
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  return read_file_of(data_dir.files(), numbered_file(*folder, checkpoint_prefix, sequence), sequence);
}

base::Result<Recovered> read_latest_checkpoint(const DataDir& data_dir, const std::string& world) {
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  auto sequences = numbered_files(*folder, checkpoint_prefix);
  if (!sequences.ok()) return sequences.status();
  const auto logs = numbered_files(*folder, log_prefix);
  if (!logs.ok()) return logs.status();
  if (sequences->empty()) return base::not_found("there is no checkpoint of world '" + world + "'", *folder);

  Recovered recovered;
  recovered.next_sequence = std::max(sequences->back(), logs->empty() ? 0 : logs->back()) + 1;
  std::string failures;
  for (auto sequence = sequences->rbegin(); sequence != sequences->rend(); ++sequence) {
    auto checkpoint = read_file_of(data_dir.files(), numbered_file(*folder, checkpoint_prefix, *sequence), *sequence);
    if (checkpoint.ok()) {
      recovered.checkpoint = std::move(*checkpoint);
      return recovered;
    }
    failures += (failures.empty() ? "" : "; ") + checkpoint.status().message();
    recovered.damaged.push_back(checkpoint.status());
  }
  return base::Status(base::StatusCode::malformed, "no checkpoint is whole: " + failures, *folder);
}

}  // namespace pneuma::persist
