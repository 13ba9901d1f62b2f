// Many clients on one thread, which note when each frame comes and decode none.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/status.h"

namespace pneuma::bench {

class Crowd {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Pace { prompt, byte_a_second, stuck };

  struct Arrival {
    std::uint64_t tick = 0;
    Clock::time_point at;   // when its last byte was read
    std::size_t group = 0;  // of clients that were added together
  };
  /// What each client of a group watches.
  struct Watched {
    std::string world;
    double rate_hz = 0.0;      // 0: the world's
    double max_error_m = 0.0;  // 0: the server's default
  };

  explicit Crowd(const std::string& address);
  ~Crowd();

  /// Connects and subscribes that many more; the prompt ones have had a frame when it returns.
  [[nodiscard]] base::Status add(Pace pace, std::size_t count, const Watched& watched);
  /// Ends all connections. The frames of the prompt ones.
  [[nodiscard]] base::Result<std::vector<Arrival>> leave();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Keeps the calling thread, and what it starts, on one core while it lives.
class OnCore {
 public:
  explicit OnCore(std::size_t core);
  ~OnCore();
  OnCore(const OnCore&) = delete;
  OnCore& operator=(const OnCore&) = delete;

 private:
  std::vector<std::size_t> before_;
};

}  // namespace pneuma::bench
