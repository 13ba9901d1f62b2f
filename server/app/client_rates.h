// How often each client may ask, however many connections it has. The network thread's.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>

#include "app/token_bucket.h"
#include "base/limits.h"

namespace pneuma::app {

class ClientRates {
 public:
  explicit ClientRates(const base::Limits& limits)
      : commands_per_s_(limits.commands_per_s), commands_burst_(limits.commands_burst) {}

  /// Shared by the client's connections. It outlives them until it is full again: to connect anew gains nothing.
  [[nodiscard]] std::shared_ptr<TokenBucket> commands_of(const std::string& client, TokenBucket::TimePoint now);

  [[nodiscard]] std::size_t clients() const { return commands_.size(); }

 private:
  double commands_per_s_;
  double commands_burst_;
  std::map<std::string, std::shared_ptr<TokenBucket>> commands_;
};

}  // namespace pneuma::app
