// Who hosts the worlds that a service speaks for.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "app/inbox.h"
#include "app/session.h"
#include "app/world_status.h"
#include "base/status.h"
#include "net/server.h"

namespace pneuma::app {

class Host {
 public:
  virtual ~Host() = default;

  /// Brings the worlds up, before anyone is listened to.
  [[nodiscard]] virtual base::Status start() = 0;

  // The network thread; all return at once.

  /// Answers a CreateWorld or RestoreWorld when the world is built.
  virtual void create(Request request) = 0;
  /// Queues a request for its world. False, and answered, where that cannot be.
  virtual bool ask(const std::string& world, Request request) = 0;
  virtual bool ask_stream(std::uint32_t stream_id, Request request) = 0;
  /// Answers with the next piece of a snapshot that the session took.
  virtual void read_snapshot(Request request) = 0;
  virtual void key_wanted(net::SessionId session, std::uint32_t stream_id) = 0;
  virtual void stream_stalled(net::SessionId session, std::uint32_t stream_id) = 0;
  virtual void reader_report(net::SessionId session, const net::ReaderReport& report) = 0;
  virtual void session_ended(net::SessionId session, const std::string& world) = 0;
  /// Destroys a world that is the session's own; nothing where it is not, or gone.
  virtual void end_owned(const std::shared_ptr<Session>& session, const std::string& world) = 0;
  [[nodiscard]] virtual std::vector<WorldStatus> statuses() const = 0;
  [[nodiscard]] virtual bool has(const std::string& world) const = 0;

  /// Takes no more requests; those that wait are answered.
  virtual void close() = 0;
  /// After close(): keeps what is to be kept, and returns. What could not be kept, and why.
  [[nodiscard]] virtual base::Status stop() = 0;
};

}  // namespace pneuma::app
