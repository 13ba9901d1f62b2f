// The server as a whole: listens, gives each session its gate, hands what comes through to the worlds, shows its pages.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "app/background_queue.h"
#include "app/config.h"
#include "app/gatekeeper.h"
#include "app/host.h"
#include "app/message_parts.h"
#include "app/metrics.h"
#include "app/recent_pages.h"
#include "app/session.h"
#include "app/session_gate.h"
#include "app/token_file.h"
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

  // While it serves, on the thread that started it; both log what could not be read, and go on with what was there.

  /// Reads the tokens again where their file has changed, and ends the sessions whose token counts no more. About once
  /// a second.
  void tend();
  /// Reads the tokens and the certificate again.
  void reload();

 private:
  struct Guest {
    Guest(net::SessionId its_id, std::string address, Gatekeeper& gatekeeper, const base::Limits& limits,
          MessageParts& parts, base::MemoryBudget its_requests)
        : id(its_id), gate(id, std::move(address), gatekeeper, limits, parts), requests(std::move(its_requests)) {}
    net::SessionId id;
    SessionGate gate;
    std::shared_ptr<Session> session;  // null until a good hello came
    std::set<std::string> worlds;      // that may hold something for it
    base::MemoryBudget requests;       // its client's share, once that is known
    net::SessionStats counted;         // what the metrics know of it
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
  [[nodiscard]] net::HttpReply page(const net::PageRequest& asked);
  [[nodiscard]] Gatekeeper::Verdict who_reads(const net::PageRequest& asked);
  /// What the requests of a client may take: all its sessions' together.
  [[nodiscard]] base::MemoryBudget requests_of(const std::string& client);
  void count_sessions();
  /// As they were a moment ago: who asks often makes no work for the network's thread.
  [[nodiscard]] const std::vector<WorldStatus>& recent_statuses();
  void end_stale_sessions();

  [[nodiscard]] base::Status check_openness() const;
  [[nodiscard]] base::Status listen();
  /// Those of the file and the one of --token-file; nothing where no token is asked for.
  [[nodiscard]] base::Result<std::optional<std::vector<Token>>> read_all_tokens();
  void read_tokens_again();

  const Config config_;
  std::optional<Token> own_token_;  // of --token-file or the environment
  std::optional<WatchedTokenFile> token_file_;
  WebFolder web_;
  Metrics metrics_;
  base::MemoryBudget requests_memory_;
  net::Server server_;
  std::unique_ptr<Host> host_;
  // The network thread's alone:
  Gatekeeper gatekeeper_;
  MessageParts parts_;
  std::map<net::SessionId, Guest> guests_;
  std::map<std::string, base::MemoryBudget> requests_of_;  // by client
  RecentPages pages_;
  std::vector<WorldStatus> statuses_;
  std::optional<std::chrono::steady_clock::time_point> statuses_at_;
  std::thread network_;
  BackgroundQueue reader_{BackgroundQueue::Priority::low};  // last: its thread uses the rest
};

}  // namespace pneuma::app
