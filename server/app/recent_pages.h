// Pages that tell of all worlds, kept for a short while. One thread at a time.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <string>

#include "net/server.h"

namespace pneuma::app {

/// However often they are asked for, making each takes a twentieth of the time: one is given again for nineteen times
/// what it took to make. But none is older than five seconds, whatever that takes.
class RecentPages {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;

  /// The page of that name as it was made lately, or as `make` makes it now.
  [[nodiscard]] net::HttpReply get(const std::string& name, const Clock& now,
                                   const std::function<net::HttpReply()>& make);

 private:
  struct Page {
    net::HttpReply reply;
    std::chrono::steady_clock::time_point until;
  };

  std::map<std::string, Page> pages_;
};

}  // namespace pneuma::app
