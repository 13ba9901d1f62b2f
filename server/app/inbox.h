// What waits for a world's next tick. Network callbacks put in, the tick takes out.
#pragma once

#include <algorithm>
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
/// The session takes no frames of the stream until it wants a key.
struct StreamStalled {
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
using Command = std::variant<Request, KeyWanted, StreamStalled, SessionEnded, ReaderReported>;

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
    const bool is_full = waiting_ >= base::world_inbox_requests_max || bytes_ + bytes > base::world_inbox_bytes_max;
    if (request != nullptr && request->message->request_id() != 0 && is_full) return Post::full;
    Line& line = line_of(session_of(command));
    if (std::holds_alternative<SessionEnded>(command)) drop_questions(line);
    bytes_ += bytes;
    ++waiting_;
    line.commands.push_back({std::move(command), bytes});
    return Post::taken;
  }

  /// What to leave where it waits. A session's requests stay in order, so those behind one wait too; what the server
  /// itself has to say of the session does not.
  enum class Leave { nothing, looks_at_bodies };

  /// Sessions have their turns, each with what has waited longest of its own; after all others come the reports.
  /// Nothing where none waits that may be taken.
  [[nodiscard]] std::optional<Command> take(Leave leave = Leave::nothing) {
    const std::lock_guard lock(mutex_);
    const auto may_go = [leave](Line& of) { return next_of(of, leave) != of.commands.end(); };
    const auto next = std::ranges::find_if(lines_, may_go);
    if (next == lines_.end()) {
      if (reports_.empty()) return std::nullopt;
      return reports_.extract(reports_.begin()).mapped();
    }
    Line line = std::move(*next);
    lines_.erase(next);
    Command taken = take_from(line, next_of(line, leave));
    if (!line.commands.empty()) lines_.push_back(std::move(line));
    return taken;
  }

  /// Whether no command waits, reports left out.
  [[nodiscard]] bool is_empty() const {
    const std::lock_guard lock(mutex_);
    return lines_.empty();
  }

  /// The first request to destroy the world, out of its turn; nothing where there is none.
  [[nodiscard]] std::optional<Request> take_destroy() {
    const std::lock_guard lock(mutex_);
    for (auto line = lines_.begin(); line != lines_.end(); ++line) {
      const auto found = std::ranges::find_if(line->commands, [](const Waiting& waiting) {
        const auto* request = std::get_if<Request>(&waiting.command);
        return request != nullptr && request->message->has_destroy_world();
      });
      if (found == line->commands.end()) continue;
      Command taken = take_from(*line, found);
      if (line->commands.empty()) lines_.erase(line);
      return std::get<Request>(std::move(taken));
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
  // What waits of one session, which is never nothing.
  struct Line {
    net::SessionId session;
    std::deque<Waiting> commands;
  };

  // 0: nobody's.
  static net::SessionId id_of(const Request& request) { return request.session ? request.session->id() : 0; }
  template <class Notice>
  static net::SessionId id_of(const Notice& notice) {
    return notice.session;
  }
  static bool is_look_at_bodies(const Command& command) {
    const auto* request = std::get_if<Request>(&command);
    return request != nullptr && looks_at_bodies(request->message->request_case());
  }
  static net::SessionId session_of(const Command& command) {
    return std::visit([](const auto& of) { return id_of(of); }, command);
  }

  // Of a line: what may be taken from it, or its end.
  static std::deque<Waiting>::iterator next_of(Line& line, Leave leave) {
    const auto first = line.commands.begin();
    if (leave == Leave::nothing || !is_look_at_bodies(first->command)) return first;
    const auto other = std::ranges::find_if_not(
        line.commands, [](const Waiting& waiting) { return is_look_at_bodies(waiting.command); });
    const bool is_request = other != line.commands.end() && std::holds_alternative<Request>(other->command);
    return is_request ? line.commands.end() : other;
  }

  // The last in turn where the session has none yet.
  Line& line_of(net::SessionId session) {
    const auto found = std::ranges::find(lines_, session, &Line::session);
    return found != lines_.end() ? *found : lines_.emplace_back(Line{session, {}});
  }

  Command take_from(Line& line, std::deque<Waiting>::iterator which) {
    Command taken = std::move(which->command);
    bytes_ -= which->bytes;
    --waiting_;
    line.commands.erase(which);
    return taken;
  }

  // Nobody is there to hear the answers. What was to be changed is changed all the same.
  void drop_questions(Line& line) {
    for (auto it = line.commands.begin(); it != line.commands.end();) {
      const auto* request = std::get_if<Request>(&it->command);
      if (request == nullptr || role_for(request->message->request_case()) != Role::view) {
        ++it;
        continue;
      }
      bytes_ -= it->bytes;
      --waiting_;
      it = line.commands.erase(it);
    }
  }

  mutable std::mutex mutex_;
  std::deque<Line> lines_;                                                      // in the order of their turns
  std::map<std::pair<net::SessionId, std::uint32_t>, ReaderReported> reports_;  // by session and stream
  std::size_t waiting_ = 0;                                                     // commands in all lines
  std::size_t bytes_ = 0;                                                       // of all that waits
  bool closed_ = false;
};

}  // namespace pneuma::app
