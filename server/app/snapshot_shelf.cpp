#include "app/snapshot_shelf.h"

#include <algorithm>
#include <utility>

#include "base/limits.h"

namespace pneuma::app {

using base::Result;
using base::Status;

namespace {

// A client that fetches one world's file after the other needs one at a time.
constexpr std::ptrdiff_t client_snapshots_max = 2;
constexpr std::size_t snapshots_max = 16;
// Of the memory that worlds need too.
constexpr std::size_t memory_part = 8;

}  // namespace

SnapshotShelf::SnapshotShelf(const base::MemoryBudget& budget)
    : budget_(std::clamp(budget.bytes_max() / memory_part, base::world_file_bytes_max,
                         snapshots_max * base::world_file_bytes_max),
              budget) {}

v1::Snapshot SnapshotShelf::piece_of(const Held& held, std::size_t offset) {
  v1::Snapshot piece = held.head;
  piece.set_offset(offset);
  piece.set_data(held.bytes.substr(offset, base::snapshot_piece_bytes));
  return piece;
}

Result<v1::Snapshot> SnapshotShelf::put(net::SessionId session, const std::string& client, v1::Snapshot head,
                                        std::string bytes, TimePoint now) {
  const std::lock_guard lock(mutex_);
  drop_old_locked(now);
  held_.erase(session);
  make_room_locked(client);
  head.set_snapshot_id(++last_id_);
  head.set_bytes_total(bytes.size());
  Held held{std::move(head), client, std::move(bytes), {}, 0, now};
  v1::Snapshot first = piece_of(held, 0);
  if (first.data().size() == held.bytes.size()) return first;
  auto share = budget_.take(held.bytes.size());
  if (!share) return Status(base::StatusCode::unavailable, "there is no memory for the snapshot now", "take_snapshot");
  held.share = std::move(*share);
  held_.insert_or_assign(session, std::move(held));
  return first;
}

Result<v1::Snapshot> SnapshotShelf::read(net::SessionId session, const v1::ReadSnapshot& request, TimePoint now) {
  const std::lock_guard lock(mutex_);
  drop_old_locked(now);
  const auto found = held_.find(session);
  if (found == held_.end() || found->second.head.snapshot_id() != request.snapshot_id()) {
    return base::not_found("this session has no snapshot " + std::to_string(request.snapshot_id()) +
                               ", or asked for nothing of it for too long",
                           "read_snapshot.snapshot_id");
  }
  Held& held = found->second;
  if (request.offset() >= held.bytes.size()) {
    return base::invalid(
        "is " + std::to_string(request.offset()) + " of " + std::to_string(held.bytes.size()) + " bytes",
        "read_snapshot.offset");
  }
  if (request.offset() > held.read_to) {
    held.read_to = request.offset();
    held.last_read = now;
  }
  v1::Snapshot piece = piece_of(held, request.offset());
  if (request.offset() + piece.data().size() == held.bytes.size()) held_.erase(found);
  return piece;
}

void SnapshotShelf::drop(net::SessionId session) {
  const std::lock_guard lock(mutex_);
  held_.erase(session);
}

void SnapshotShelf::drop_old(TimePoint now) {
  const std::lock_guard lock(mutex_);
  drop_old_locked(now);
}

void SnapshotShelf::make_room_locked(const std::string& client) {
  const auto is_its = [&client](const auto& entry) { return entry.second.client == client; };
  if (std::ranges::count_if(held_, is_its) < client_snapshots_max) return;
  const auto age = [&](const auto& entry) {
    return std::pair(!is_its(entry), entry.second.head.snapshot_id());  // its own come first
  };
  held_.erase(std::ranges::min_element(held_, {}, age));
}

void SnapshotShelf::drop_old_locked(TimePoint now) {
  std::erase_if(held_, [now](const auto& held) { return now - held.second.last_read > base::snapshot_timeout; });
}

}  // namespace pneuma::app
