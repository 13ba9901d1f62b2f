#include "net/handshake_pace.h"

#include <algorithm>

namespace pneuma::net {

std::chrono::steady_clock::duration HandshakePace::wait(const std::string& address, TimePoint now) {
  std::erase_if(next_, [now](const auto& known) { return known.second <= now; });
  TimePoint& next = next_.try_emplace(address, now).first->second;
  const TimePoint due = next;
  next += interval;
  return std::max<std::chrono::steady_clock::duration>(due - now - burst * interval, {});
}

}  // namespace pneuma::net
