// What waits for a world's next tick. Network callbacks put in, the tick takes out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <variant>
#include <vector>

#include "app/session.h"
#include "base/limits.h"
#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

struct Request {
  std::shared_ptr<Session> session;
  v1::ClientMessage message;
};
struct KeyWanted {
  net::SessionId session;
  std::uint32_t stream_id;
};
struct SessionEnded {
  net::SessionId session;
};
using Command = std::variant<Request, KeyWanted, SessionEnded>;

class Inbox {
 public:
  enum class Post { taken, full, closed };

  /// A full inbox refuses requests, not what keeps its own books right.
  Post post(Command command) {
    const std::lock_guard lock(mutex_);
    if (closed_) return Post::closed;
    if (const auto* request = std::get_if<Request>(&command)) {
      const std::size_t bytes = request->message.ByteSizeLong();
      if (commands_.size() >= base::world_inbox_requests_max || bytes_ + bytes > base::world_inbox_bytes_max) {
        return Post::full;
      }
      bytes_ += bytes;
    }
    commands_.push_back(std::move(command));
    return Post::taken;
  }

  [[nodiscard]] std::vector<Command> take() {
    const std::lock_guard lock(mutex_);
    bytes_ = 0;
    return std::exchange(commands_, {});
  }

  /// Takes nothing more; returns what waited.
  [[nodiscard]] std::vector<Command> close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    return std::exchange(commands_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<Command> commands_;
  std::size_t bytes_ = 0;  // of the requests
  bool closed_ = false;
};

}  // namespace pneuma::app
