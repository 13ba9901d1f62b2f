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

/// Holds one snapshot a session and two a client: a new one takes the place of the oldest. It goes with its last piece,
/// with its session, and where nobody asks for more of it for a while.
class SnapshotShelf {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// Its bytes are taken of `budget`, and are an eighth of it at most.
  explicit SnapshotShelf(const base::MemoryBudget& budget);

  /// The first piece. `head` has all but that. UNAVAILABLE where the budget has no room for the file.
  [[nodiscard]] base::Result<v1::Snapshot> put(net::SessionId session, const std::string& client, v1::Snapshot head,
                                               std::string bytes, TimePoint now);
  /// The piece from `offset` on.
  [[nodiscard]] base::Result<v1::Snapshot> read(net::SessionId session, const v1::ReadSnapshot& request, TimePoint now);
  void drop(net::SessionId session);
  /// Those that nobody asked for.
  void drop_old(TimePoint now);

 private:
  struct Held {
    v1::Snapshot head;  // ids ascend
    std::string client;
    std::string bytes;
    base::MemoryBudget::Share share;
    std::size_t read_to = 0;
    TimePoint last_read;  // when more of it was read than before
  };
  [[nodiscard]] static v1::Snapshot piece_of(const Held& held, std::size_t offset);
  void drop_old_locked(TimePoint now);
  void make_room_locked(const std::string& client);

  const base::MemoryBudget budget_;
  std::mutex mutex_;
  std::map<net::SessionId, Held> held_;
  std::uint64_t last_id_ = 0;
};

}  // namespace pneuma::app
