// World files that clients are fetching, piece by piece. Any thread.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "base/memory_budget.h"
#include "base/status.h"
#include "net/server.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// Holds one snapshot a session: a new one takes the place of the one before. It goes with its last piece, with its
/// session, and where nobody asks for it for a while.
class SnapshotShelf {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// Its bytes are taken of `budget`, which outlives the shelf.
  explicit SnapshotShelf(const base::MemoryBudget& budget) : budget_(budget) {}

  /// The first piece. `head` has all but that. UNAVAILABLE where the budget has no room for the file.
  [[nodiscard]] base::Result<v1::Snapshot> put(net::SessionId session, v1::Snapshot head, std::string bytes,
                                               TimePoint now);
  /// The piece from `offset` on.
  [[nodiscard]] base::Result<v1::Snapshot> read(net::SessionId session, const v1::ReadSnapshot& request, TimePoint now);
  void drop(net::SessionId session);
  /// Those that nobody asked for.
  void drop_old(TimePoint now);

 private:
  struct Held {
    v1::Snapshot head;
    std::string bytes;
    base::MemoryBudget::Share share;
    TimePoint last_read;
  };
  [[nodiscard]] static v1::Snapshot piece_of(const Held& held, std::size_t offset);
  void drop_old_locked(TimePoint now);

  const base::MemoryBudget& budget_;
  std::mutex mutex_;
  std::map<net::SessionId, Held> held_;
  std::uint64_t last_id_ = 0;
};

}  // namespace pneuma::app
