// Bytes that came, as a message: measured first, then parsed. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "base/memory_budget.h"
#include "base/status.h"
#include "net/server.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

/// A client's message, not yet parsed.
struct Unread {
  std::uint64_t request_id = 0;
  net::ReceivedMessage message;
  bool came_in_parts = false;
};

/// A client's message. Nobody changes it, so it is shared; it lies on an arena of its own, which goes as a whole.
using MessagePtr = std::shared_ptr<const v1::ClientMessage>;

struct ReadMessage {
  MessagePtr message;
  std::size_t bytes = 0;  // of memory
};

/// Refuses what would be too large once it is parsed, in memory, fields or depth, and what `budget` has no room for.
/// Its memory is the budget's until the message goes. MALFORMED: the bytes are no message, and the connection cannot be
/// trusted any more; in parts, they are an error of the request alone.
[[nodiscard]] base::Result<ReadMessage> read_request(const Unread& unread, const base::MemoryBudget& budget);

}  // namespace pneuma::app
