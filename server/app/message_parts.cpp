#include "app/message_parts.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "app/message_memory.h"

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

constexpr double retry_hint_s = 1.0;

MessageParts::Taken refuse(Status why, double retry_after_s = 0.0) {
  return {std::move(why), retry_after_s, std::nullopt};
}

MessageParts::Taken parse(std::string_view bytes, std::uint64_t request_id) {
  if (!takes_at_most(bytes, *v1::ClientMessage::descriptor(), base::message_memory_bytes_max)) {
    return refuse({StatusCode::limit_exceeded,
                   "what the message holds takes more than " + std::to_string(base::message_memory_bytes_max) +
                       " bytes of memory",
                   "part"});
  }
  MessageParts::Taken taken;
  v1::ClientMessage& whole = taken.whole.emplace();
  if (!whole.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return refuse(base::invalid("all parts together are no ClientMessage", "part"));
  }
  if (whole.request_id() != request_id) {
    return refuse(base::invalid("is " + std::to_string(whole.request_id()) + " in the message and " +
                                    std::to_string(request_id) + " in its parts",
                                "request_id"));
  }
  if (whole.has_part()) return refuse(base::invalid("is of a message that is a part itself", "part"));
  return taken;
}

}  // namespace

std::size_t parts_bytes_max(const base::Limits& limits) {
  const auto parts = static_cast<std::size_t>(std::max(1.0, limits.commands_burst / 2.0));
  return std::min(base::parts_bytes_max, std::max<std::size_t>(1, parts) * limits.message_bytes_max);
}

MessageParts::Taken MessageParts::take(std::uint64_t session_id, std::uint64_t request_id, v1::Part part,
                                       TimePoint now) {
  const bool is_last = part.last();
  Taken taken = append(senders_[session_id], request_id, std::move(part), now);
  if (!taken.refused.ok()) give_up(session_id, request_id, is_last);
  return taken;
}

MessageParts::Taken MessageParts::append(Sender& sender, std::uint64_t request_id, v1::Part part, TimePoint now) {
  if (sender.assembly && sender.assembly->request_id != request_id) {
    if (!is_late(*sender.assembly, now)) {
      return refuse({StatusCode::failed_precondition,
                     "the parts of request " + std::to_string(sender.assembly->request_id) + " have not all come yet",
                     "part"});
    }
    drop(sender);
  }
  if (sender.assembly && is_late(*sender.assembly, now)) {
    return refuse(
        {StatusCode::unavailable,
         "comes more than " + std::to_string(base::parts_timeout.count()) + " s after the one before", "part"},
        retry_hint_s);
  }
  const std::size_t bytes = part.data().size();
  if (bytes == 0) return refuse(base::invalid("is empty", "part.data"));
  const std::size_t held = sender.assembly ? sender.assembly->bytes : 0;
  if (held + bytes > bytes_max_) {
    return refuse({StatusCode::limit_exceeded,
                   "the message has more than " + std::to_string(bytes_max_) + " bytes in its parts", "part"});
  }
  if (!has_room(bytes, now)) {
    return refuse({StatusCode::unavailable, "too many messages in parts are under way", "part"}, retry_hint_s);
  }
  if (!sender.assembly) sender.assembly.emplace().request_id = request_id;
  PartAssembly& assembly = *sender.assembly;
  assembly.parts.push_back(std::move(*part.mutable_data()));
  assembly.bytes += bytes;
  assembly.last_part = now;
  bytes_ += bytes;
  if (!part.last()) return {};
  std::string whole;
  whole.reserve(assembly.bytes);
  for (const std::string& each : assembly.parts) whole += each;
  drop(sender);
  return parse(whole, request_id);
}

bool MessageParts::passes_over(std::uint64_t session_id, std::uint64_t request_id, bool is_last) {
  const auto sender = senders_.find(session_id);
  if (sender == senders_.end() || sender->second.given_up != request_id) return false;
  if (is_last) sender->second.given_up.reset();
  return true;
}

void MessageParts::give_up(std::uint64_t session_id, std::uint64_t request_id, bool is_last) {
  Sender& sender = senders_[session_id];
  if (sender.assembly && sender.assembly->request_id == request_id) drop(sender);
  if (!is_last) sender.given_up = request_id;
}

void MessageParts::session_ended(std::uint64_t session_id) {
  const auto sender = senders_.find(session_id);
  if (sender == senders_.end()) return;
  drop(sender->second);
  senders_.erase(sender);
}

// Those whose time is over give way; while nobody needs their room, they may stay.
bool MessageParts::has_room(std::size_t bytes, TimePoint now) {
  if (bytes_ + bytes <= base::parts_waiting_bytes_max) return true;
  for (auto& [session_id, sender] : senders_) {
    if (!sender.assembly || !is_late(*sender.assembly, now)) continue;
    bytes_ -= std::exchange(sender.assembly->bytes, 0);
    sender.assembly->parts.clear();  // the next part, if one comes, is told that it is late
  }
  return bytes_ + bytes <= base::parts_waiting_bytes_max;
}

bool MessageParts::is_late(const PartAssembly& assembly, TimePoint now) {
  return now - assembly.last_part > base::parts_timeout;
}

void MessageParts::drop(Sender& sender) {
  if (sender.assembly) bytes_ -= sender.assembly->bytes;
  sender.assembly.reset();
}

}  // namespace pneuma::app
