#include "persist/history.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "persist/world_files.h"

namespace pneuma::persist {

namespace {

/// What the files from a checkpoint on take; 0 for those that are not there.
std::uint64_t bytes_from(const std::string& folder, std::uint64_t sequence, std::uint64_t last_log) {
  const auto size_of = [&folder](std::string_view prefix, std::uint64_t number) -> std::uint64_t {
    std::error_code error;
    const auto size = std::filesystem::file_size(numbered_file(folder, prefix, number), error);
    return error ? 0 : size;
  };
  std::uint64_t bytes = size_of(checkpoint_prefix, sequence);
  for (std::uint64_t log = sequence; log <= last_log; ++log) bytes += size_of(log_prefix, log);
  return bytes;
}

/// Of the checkpoints within the range, ascending.
base::Result<std::vector<std::uint64_t>> sequences_in(const std::string& folder, const HistoryRange& range) {
  auto sequences = numbered_files(folder, checkpoint_prefix);
  if (!sequences.ok()) return sequences;
  std::erase_if(*sequences, [&](std::uint64_t sequence) {
    return sequence < range.sequence_min || sequence > range.until.sequence;
  });
  return sequences;
}

}  // namespace

base::Result<std::uint64_t> history_bytes(const DataDir& data_dir, const std::string& world,
                                          const HistoryRange& range) {
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  const auto sequences = sequences_in(*folder, range);
  if (!sequences.ok()) return sequences.status();
  std::uint64_t most = 0;
  for (const std::uint64_t sequence : *sequences) {
    most = std::max(most, bytes_from(*folder, sequence, range.until.sequence));
  }
  return most;
}

base::Result<History> read_history(const DataDir& data_dir, const std::string& world, const HistoryRange& range) {
  const auto folder = data_dir.world_folder(world);
  if (!folder.ok()) return folder.status();
  auto sequences = sequences_in(*folder, range);
  if (!sequences.ok()) return sequences.status();
  // Forwards to find the oldest of all, or back from now to the newest before the tick.
  if (range.tick) std::ranges::reverse(*sequences);

  std::optional<Checkpoint> found;
  std::optional<std::uint64_t> first_tick;
  bool is_too_large = false;
  for (const std::uint64_t sequence : *sequences) {
    if (bytes_from(*folder, sequence, range.until.sequence) > range.bytes_max) {
      is_too_large = true;
      continue;
    }
    auto checkpoint = read_checkpoint(data_dir, world, sequence);
    if (!checkpoint.ok()) continue;  // damaged; others may do
    first_tick = std::min(first_tick.value_or(checkpoint->tick), checkpoint->tick);
    if (range.tick && checkpoint->tick > *range.tick) continue;
    const bool is_enough = !range.tick || checkpoint->tick < *range.tick;
    found = std::move(*checkpoint);
    if (is_enough) break;
  }
  if (!found) {
    if (is_too_large) {
      return base::Status(base::StatusCode::limit_exceeded,
                          "what is kept of it takes more than " + std::to_string(range.bytes_max) + " bytes");
    }
    if (first_tick)
      return base::not_found("is before tick " + std::to_string(*first_tick) + ", from which on the world is kept");
    return base::not_found("nothing is kept of the world's past");
  }
  auto replay = read_commands(data_dir, world, found->sequence, range.until);
  if (!replay.ok()) return replay.status();
  if (replay->damage) return *replay->damage;
  return History{std::move(*found), std::move(replay->records)};
}

}  // namespace pneuma::persist
