// A client of a FakeServer, and how long a test waits for what must not come.
#pragma once

#include <chrono>
#include <stdexcept>
#include <utility>

#include "pneuma_client/client.h"
#include "unit/client/fake_server.h"

namespace pneuma::client {

inline constexpr std::chrono::milliseconds soon{50};  // for what must not come

/// A client of `server`, which the test cannot do without.
inline Client connected(const FakeServer& server, ConnectOptions options = {}) {
  options.connect_timeout = long_enough;
  options.reply_timeout = long_enough;
  auto client = Client::connect(server.address(), options);
  if (!client.ok()) throw std::runtime_error(client.status().message());
  return std::move(*client);
}

}  // namespace pneuma::client
