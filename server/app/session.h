// A session that has said hello, as the worlds know it.
#pragma once

#include <cstddef>
#include <mutex>
#include <set>
#include <string>
#include <utility>

#include "app/grant.h"
#include "net/server.h"

namespace pneuma::app {

class Session {
 public:
  explicit Session(net::SessionId id, std::string client = {}, GrantPtr grant = everything())
      : id_(id), client_(std::move(client)), grant_(std::move(grant)) {}

  [[nodiscard]] net::SessionId id() const { return id_; }
  [[nodiscard]] const Grant& grant() const { return *grant_; }
  /// Whose session it is, as what sessions take together is counted.
  [[nodiscard]] const std::string& client() const { return client_; }

  /// The world ends with the session. False where the session has ended already. Any thread.
  [[nodiscard]] bool own(const std::string& world) {
    const std::lock_guard lock(mutex_);
    if (has_ended_) return false;
    owned_.insert(world);
    return true;
  }
  /// The world ended before.
  void disown(const std::string& world) {
    const std::lock_guard lock(mutex_);
    owned_.erase(world);
  }
  /// The session has ended: the worlds that end with it.
  [[nodiscard]] std::set<std::string> end() {
    const std::lock_guard lock(mutex_);
    has_ended_ = true;
    return std::exchange(owned_, {});
  }

  /// The client says that it holds the topology.
  void knows_topology(const std::string& hash) {
    send_topology(hash, [] {});
  }

  /// Calls `send` where the client does not hold the topology, and notes that it will. Any thread: worlds that share a
  /// topology share the session, and none may rely on a topology that another one has not handed to the network yet; so
  /// `send` is called under the lock. Past topologies_max a topology may be sent again.
  template <class Send>
  void send_topology(const std::string& hash, Send send) {
    const std::lock_guard lock(mutex_);
    if (topologies_.contains(hash)) return;
    if (topologies_.size() < topologies_max) topologies_.insert(hash);
    send();
  }

 private:
  // A client names what it likes; 16 bytes each, this stays below a quarter of a megabyte.
  static constexpr std::size_t topologies_max = 4'096;

  net::SessionId id_;
  const std::string client_;
  const GrantPtr grant_;
  std::mutex mutex_;
  std::set<std::string> topologies_;
  std::set<std::string> owned_;
  bool has_ended_ = false;
};

}  // namespace pneuma::app
