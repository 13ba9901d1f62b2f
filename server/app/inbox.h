// What waits for a world's next tick. Network callbacks put in, the tick takes out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <variant>

#include "app/request_kinds.h"
#include "app/request_reader.h"
#include "app/session.h"
#include "base/limits.h"

namespace pneuma::app {

struct Request {
  std::shared_ptr<Session> session;
  MessagePtr message;
  std::size_t bytes = 0;         // that the message holds in memory
  net::ReaderStats reader = {};  // of GetStats: how the session reads
};
struct KeyWanted {
  net::SessionId session;
  std::uint32_t stream_id;
};
struct SessionEnded {
  net::SessionId session;
};
struct ReaderReported {
  net::SessionId session;
  net::ReaderReport report;
};
using Command = std::variant<Request, KeyWanted, SessionEnded, ReaderReported>;

class Inbox {
 public:
  enum class Post { taken, full, closed };

  /// A full inbox refuses clients' requests, not the server's own, which have no id, nor what keeps its books right.
  /// All that waits counts, in the memory that it takes. Of the reports on a reader of a stream the last one waits,
  /// beside all that: they come of themselves, at a world that takes none while it is paused, too.
  Post post(Command command) {
    const auto* request = std::get_if<Request>(&command);
    const std::size_t bytes = request == nullptr ? 0 : request->bytes;
    const std::lock_guard lock(mutex_);
    if (closed_) return Post::closed;
    if (const auto* reader = std::get_if<ReaderReported>(&command)) {
      reports_.insert_or_assign({reader->session, reader->report.stream.stream_id}, *reader);
      return Post::taken;
    }
    const bool is_full =
        waiting_.size() >= base::world_inbox_requests_max || bytes_ + bytes > base::world_inbox_bytes_max;
    if (request != nullptr && request->message->request_id() != 0 && is_full) return Post::full;
    if (const auto* ended = std::get_if<SessionEnded>(&command)) drop_questions_of(ended->session);
    bytes_ += bytes;
    waiting_.push_back({std::move(command), bytes});
    return Post::taken;
  }

  /// The one that has waited longest, and after all others the reports; nothing where none waits.
  [[nodiscard]] std::optional<Command> take() {
    const std::lock_guard lock(mutex_);
    if (waiting_.empty() && !reports_.empty()) return reports_.extract(reports_.begin()).mapped();
    if (waiting_.empty()) return std::nullopt;
    Waiting next = std::move(waiting_.front());
    waiting_.pop_front();
    bytes_ -= next.bytes;
    return std::move(next.command);
  }

  /// The first request to destroy the world, out of its turn; nothing where there is none.
  [[nodiscard]] std::optional<Request> take_destroy() {
    const std::lock_guard lock(mutex_);
    for (auto it = waiting_.begin(); it != waiting_.end(); ++it) {
      auto* request = std::get_if<Request>(&it->command);
      if (request == nullptr || !request->message->has_destroy_world()) continue;
      Request found = std::move(*request);
      bytes_ -= it->bytes;
      waiting_.erase(it);
      return found;
    }
    return std::nullopt;
  }

  /// Lets nothing more in; what waits can still be taken.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }

 private:
  struct Waiting {
    Command command;
    std::size_t bytes;
  };

  // Nobody is there to hear the answers. What was to be changed is changed all the same.
  void drop_questions_of(net::SessionId session) {
    std::erase_if(waiting_, [&](const Waiting& waiting) {
      const auto* request = std::get_if<Request>(&waiting.command);
      const bool is_dropped = request != nullptr && request->session != nullptr && request->session->id() == session &&
                              role_for(request->message->request_case()) == Role::view;
      if (is_dropped) bytes_ -= waiting.bytes;
      return is_dropped;
    });
  }

  std::mutex mutex_;
  std::deque<Waiting> waiting_;
  std::map<std::pair<net::SessionId, std::uint32_t>, ReaderReported> reports_;  // by session and stream
  std::size_t bytes_ = 0;                                                       // of all that waits
  bool closed_ = false;
};

}  // namespace pneuma::app
