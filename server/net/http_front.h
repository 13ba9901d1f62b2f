// The HTTP address: upgrades /ws to a WebSocket transport, answers every other GET through its owner.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "net/origin.h"
#include "net/transport.h"

namespace pneuma::net {

struct HttpFront {
  std::function<HttpReply(const PageRequest&)> reply;
  /// Takes over a connection that became a WebSocket. Empty: the server is full, and that is all that is answered.
  std::function<void(std::unique_ptr<Transport>)> upgraded;
  /// For a whole request to come, a reply to go, or an idle connection to go on.
  std::chrono::milliseconds timeout;
  /// Of messages that come over WebSockets.
  base::MemoryBudget memory;
  const AllowedHosts& hosts;
  std::string counted_as;  // whose connection it is
};

/// Serves one connection until it ends or is upgraded; `front` outlives it.
asio::awaitable<void> serve_http(asio::ip::tcp::socket socket, asio::ssl::context* tls, const HttpFront& front);

}  // namespace pneuma::net
