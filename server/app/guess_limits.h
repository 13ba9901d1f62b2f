// How often an address may say a wrong token: a few times at once, then after waits that grow. Pure; the time is passed
// in.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <map>
#include <string>

#include "app/auth.h"

namespace pneuma::app {

class GuessLimits {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// Seconds until a guess of the address is looked at again; 0: it is now.
  [[nodiscard]] double wait_s(const std::string& address, TimePoint now) const;
  /// The address said a token that is none. The same one once more tells it nothing new, and counts for nothing.
  void note_wrong(const std::string& address, const TokenDigest& digest, TimePoint now);

  [[nodiscard]] std::size_t addresses() const { return guessers_.size(); }

 private:
  struct Guesser {
    std::size_t guesses = 0;
    std::deque<TokenDigest> last;  // what it said
    TimePoint last_at{};
    TimePoint waits_until{};
  };
  void forget(TimePoint now);

  std::map<std::string, Guesser> guessers_;  // by address
};

}  // namespace pneuma::app
