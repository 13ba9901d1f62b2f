// When the TLS handshakes of an address may begin: each takes the network's thread milliseconds, before anybody has
// said who it is. Pure; the time is passed in.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <string>

namespace pneuma::net {

class HandshakePace {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// How long a new connection of that address waits: nothing for the first `burst`, as a page's are, and then so that
  /// one begins every `interval`.
  [[nodiscard]] std::chrono::steady_clock::duration wait(const std::string& address, TimePoint now);

  static constexpr std::chrono::milliseconds interval{100};
  static constexpr int burst = 20;

 private:
  std::map<std::string, TimePoint> next_;  // when its next one is due; addresses that are behind that are forgotten
};

}  // namespace pneuma::net
