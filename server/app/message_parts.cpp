#include "app/message_parts.h"

#include <algorithm>
#include <string>
#include <utility>

namespace pneuma::app {

using base::Status;
using base::StatusCode;

namespace {

constexpr double parts_retry_hint_s = 1.0;
// More than a client has under way that takes its errors as they come.
constexpr std::size_t given_up_max = 16;

std::size_t most_bytes(const base::Limits& limits) {
  const auto parts = static_cast<std::size_t>(std::max(1.0, limits.commands_burst / 2.0));
  return std::min(base::parts_bytes_max, parts * limits.message_bytes_max);
}

MessageParts::Taken refuse(Status why, double retry_after_s = 0.0) {
  return {std::move(why), retry_after_s, std::nullopt};
}

}  // namespace

MessageParts::MessageParts(const base::Limits& limits)
    : message_bytes_max_(limits.message_bytes_max),
      bytes_max_(most_bytes(limits)),
      waiting_bytes_max_(limits.parts_waiting_bytes_max) {}

MessageParts::Taken MessageParts::take(std::uint64_t session_id, const std::string& client, std::uint64_t request_id,
                                       const PartView& part, TimePoint now) {
  Sender& sender = senders_[session_id];
  sender.client = client;
  Taken taken = append(sender, request_id, part, now);
  if (!taken.refused.ok()) give_up(session_id, request_id, part.last);
  return taken;
}

MessageParts::Taken MessageParts::append(Sender& sender, std::uint64_t request_id, const PartView& part,
                                         TimePoint now) {
  if (sender.assembly && sender.assembly->request_id != request_id) {
    if (now <= sender.assembly->good_until) {
      return refuse({StatusCode::failed_precondition,
                     "the parts of request " + std::to_string(sender.assembly->request_id) + " have not all come yet",
                     "part"});
    }
    drop(sender);
  }
  if (sender.assembly && now > sender.assembly->good_until) {
    return refuse({StatusCode::unavailable,
                   "comes too late: a message must come at " + std::to_string(message_bytes_max_) + " bytes in " +
                       std::to_string(base::parts_timeout.count()) + " s",
                   "part"},
                  parts_retry_hint_s);
  }
  if (part.data.empty()) return refuse(base::invalid("is empty", "part.data"));
  const std::size_t bytes = part.data.size() + (sender.assembly ? sender.assembly->bytes.size() : 0);
  if (bytes > bytes_max_) {
    return refuse({StatusCode::limit_exceeded,
                   "the message has more than " + std::to_string(bytes_max_) + " bytes in its parts", "part"});
  }
  const std::size_t held = sender.assembly ? sender.assembly->held : 0;
  const std::size_t wanted = bytes <= held ? held : std::min(std::max(bytes, 2 * held), bytes_max_);
  if (!has_room(sender.client, wanted - held, now)) {
    return refuse({StatusCode::unavailable, "too many messages in parts are under way", "part"}, parts_retry_hint_s);
  }
  if (!sender.assembly) sender.assembly.emplace(request_id, now + base::parts_timeout);
  Assembly& assembly = *sender.assembly;
  if (wanted > held) {  // a string that grows by itself would take more room than was asked for
    std::string larger;
    larger.reserve(wanted);
    larger.append(assembly.bytes);
    assembly.bytes = std::move(larger);
  }
  assembly.held = assembly.bytes.capacity();
  bytes_ += assembly.held - held;
  assembly.bytes.append(part.data);
  put_off(assembly, part.data.size(), now);
  if (!part.last) return {};
  Taken taken;
  taken.whole = std::move(assembly.bytes);
  drop(sender);
  return taken;
}

// By the part's share of the largest one, so that single bytes do not keep room.
void MessageParts::put_off(Assembly& assembly, std::size_t bytes, TimePoint now) const {
  const double share = static_cast<double>(bytes) / static_cast<double>(message_bytes_max_);
  const auto more = std::chrono::duration_cast<TimePoint::duration>(share * base::parts_timeout);
  assembly.good_until = std::min(assembly.good_until + more, now + base::parts_timeout);
}

bool MessageParts::passes_over(std::uint64_t session_id, std::uint64_t request_id, bool is_last) {
  const auto sender = senders_.find(session_id);
  if (sender == senders_.end()) return false;
  std::deque<std::uint64_t>& given_up = sender->second.given_up;
  const auto found = std::find(given_up.begin(), given_up.end(), request_id);
  if (found == given_up.end()) return false;
  if (is_last) given_up.erase(found);
  return true;
}

void MessageParts::give_up(std::uint64_t session_id, std::uint64_t request_id, bool is_last) {
  Sender& sender = senders_[session_id];
  if (sender.assembly && sender.assembly->request_id == request_id) drop(sender);
  if (is_last) return;
  sender.given_up.push_back(request_id);
  if (sender.given_up.size() > given_up_max) sender.given_up.pop_front();
}

void MessageParts::session_ended(std::uint64_t session_id) {
  const auto sender = senders_.find(session_id);
  if (sender == senders_.end()) return;
  drop(sender->second);
  senders_.erase(sender);
}

// Those whose time is over give way; while nobody needs their room, they may stay.
bool MessageParts::has_room(const std::string& client, std::size_t bytes, TimePoint now) {
  const auto fits = [&] {
    const std::size_t of_client = std::max(waiting_bytes_max_ / 2, bytes_max_);
    return bytes_ + bytes <= waiting_bytes_max_ && held_by(client) + bytes <= of_client;
  };
  if (fits()) return true;
  for (auto& [session_id, sender] : senders_) {
    if (!sender.assembly || now <= sender.assembly->good_until) continue;
    // The next part, if one comes, is told that it is late.
    sender.assembly->bytes = {};
    bytes_ -= std::exchange(sender.assembly->held, 0);
  }
  return fits();
}

std::size_t MessageParts::held_by(const std::string& client) const {
  std::size_t bytes = 0;
  for (const auto& [session_id, sender] : senders_) {
    if (sender.client == client && sender.assembly) bytes += sender.assembly->held;
  }
  return bytes;
}

void MessageParts::drop(Sender& sender) {
  if (sender.assembly) bytes_ -= sender.assembly->held;
  sender.assembly.reset();
}

}  // namespace pneuma::app
