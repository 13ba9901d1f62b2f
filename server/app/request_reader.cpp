#include "app/request_reader.h"

#include <algorithm>
#include <utility>

#include <google/protobuf/arena.h>

#include "app/message_memory.h"
#include "base/limits.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

// What is answered as it comes, and so waits for nobody, takes no more.
constexpr std::size_t small_request_bytes = 4 * 1024;

bool is_answered_at_once(const v1::ClientMessage& message) {
  return message.has_hello() || message.has_ping() || message.has_pong();
}

google::protobuf::ArenaOptions arena_options() {
  google::protobuf::ArenaOptions options;
  options.max_block_size = 1024 * 1024;  // the allocator gives blocks of this size back to the system
  return options;
}

struct HeldMessage {
  explicit HeldMessage(base::MemoryBudget::Share its_share)
      : share(std::move(its_share)), arena(arena_options()), message(create()) {}
  [[nodiscard]] v1::ClientMessage* create() {
    return google::protobuf::Arena::CreateMessage<v1::ClientMessage>(&arena);
  }

  base::MemoryBudget::Share share;  // given back after the arena has gone
  google::protobuf::Arena arena;
  v1::ClientMessage* message;
};

MessageSize most_of(std::size_t bytes) {
  const std::size_t memory_bytes = base::message_memory_bytes_small + base::message_memory_growth_max * bytes;
  return {std::min(base::message_memory_bytes_max, memory_bytes), base::message_fields_max};
}

Status check_whole(const v1::ClientMessage& whole, std::uint64_t request_id) {
  if (whole.request_id() != request_id) {
    return base::invalid("is " + std::to_string(whole.request_id()) + " in the message and " +
                             std::to_string(request_id) + " in its parts",
                         "request_id");
  }
  if (whole.has_part()) return base::invalid("is of a message that is a part itself", "part");
  return {};
}

}  // namespace

base::Result<ReadMessage> read_request(const Unread& unread, const base::MemoryBudget& budget) {
  const std::string where = unread.came_in_parts ? "part" : "";
  const auto size =
      measure_message(unread.message.bytes, *v1::ClientMessage::descriptor(), most_of(unread.message.bytes.size()));
  if (!size.ok()) return Status(size.status().code(), "what the message holds " + size.status().what(), where);
  const auto no_room = [&] { return Status(StatusCode::unavailable, "too many requests wait", where); };
  auto share = budget.take(size->bytes);
  const bool has_room = share.has_value();
  if (!has_room && size->bytes > small_request_bytes) return no_room();
  if (!has_room) share = budget.take_anyway(size->bytes);
  const auto held = std::make_shared<HeldMessage>(std::move(*share));
  if (!held->message->ParseFromArray(unread.message.bytes.data(), static_cast<int>(unread.message.bytes.size()))) {
    if (unread.came_in_parts) return base::invalid("all parts together are no ClientMessage", "part");
    return Status(StatusCode::malformed, "not a ClientMessage");
  }
  if (!has_room && !is_answered_at_once(*held->message)) return no_room();
  if (unread.came_in_parts) {
    if (Status wrong = check_whole(*held->message, unread.request_id); !wrong.ok()) return wrong;
  }
  return ReadMessage{MessagePtr(held, held->message), size->bytes};
}

}  // namespace pneuma::app
