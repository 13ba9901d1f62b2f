// The time that sessions go by.
#pragma once

#include <chrono>

#include <boost/asio/steady_timer.hpp>

namespace pneuma::net {

/// The machine's own monotonic clock. A simulation has another.
class Clock {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;
  virtual ~Clock() = default;

  [[nodiscard]] virtual TimePoint now() const { return std::chrono::steady_clock::now(); }
  /// Whoever waits for the timer from now on does so for this long.
  virtual void set(boost::asio::steady_timer& timer, Duration after) { timer.expires_after(after); }
};

}  // namespace pneuma::net
