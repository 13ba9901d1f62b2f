// The server as a whole: listens, gives each session its gate, hands what comes through to the worlds, shows its pages.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "app/background_queue.h"
#include "app/config.h"
#include "app/host.h"
#include "app/message_parts.h"
#include "app/metrics.h"
#include "app/session.h"
#include "app/session_gate.h"
#include "app/web_folder.h"
#include "base/memory_budget.h"
#include "base/status.h"
#include "net/server.h"

namespace pneuma::app {

class Service {
 public:
  /// Serves the worlds of a host, which gets the server to speak through; all three outlive the host.
  using MakeHost = std::function<std::unique_ptr<Host>(const Config&, net::Server&, Metrics&)>;
  Service(Config config, const MakeHost& make_host);
  ~Service();
  Service(const Service&) = delete;
  Service& operator=(const Service&) = delete;

  /// Brings the worlds up, then listens. Errors say what could not be had: a file, a scene, an address.
  [[nodiscard]] base::Status start();
  /// HOST:PORT as bound; of HTTP "off" where it is off.
  [[nodiscard]] std::string tcp_address() const;
  [[nodiscard]] std::string http_address() const;
  /// Answers what waits, says goodbye to all, finishes ticks, writes checkpoints, lets the queues empty. What could not
  /// be kept, and why.
  base::Status stop();

 private:
  struct Guest {
    Guest(net::SessionId id, std::string client, std::string_view token, const base::Limits& limits,
          MessageParts& parts)
        : gate(id, token, limits, parts), session(std::make_shared<Session>(id, std::move(client))) {}
    SessionGate gate;
    std::shared_ptr<Session> session;
    std::set<std::string> worlds;  // that may hold something for it
    net::SessionStats counted;     // what the metrics know of it
  };

  // On the network thread:
  [[nodiscard]] net::Callbacks callbacks();
  void opened(net::SessionId id, const net::PeerInfo& peer);
  void received(net::SessionId id, net::ReceivedMessage message);
  void read_apart(net::SessionId id, Unread unread);
  void act_on(Guest& guest, SessionGate::Verdict verdict);
  void closed(net::SessionId id, const base::Status& why);
  void route(Guest& guest, ReadMessage read);
  void remember(Guest& guest, const std::string& world);
  [[nodiscard]] net::HttpReply page(std::string_view path);
  void count_sessions();

  [[nodiscard]] base::Status listen();

  const Config config_;
  std::string token_;
  WebFolder web_;
  Metrics metrics_;
  base::MemoryBudget requests_memory_;
  net::Server server_;
  std::unique_ptr<Host> host_;
  // The network thread's alone:
  MessageParts parts_;
  std::map<net::SessionId, Guest> guests_;
  std::thread network_;
  BackgroundQueue reader_{BackgroundQueue::Priority::low};  // last: its thread uses the rest
};

}  // namespace pneuma::app
