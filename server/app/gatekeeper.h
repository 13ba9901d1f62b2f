// Who gets in, what they may do and how often: knows the tokens, and finds the grant of one that is said. The network
// thread's.
#pragma once

#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "app/client_rates.h"
#include "app/grant.h"
#include "app/guess_limits.h"
#include "app/token_file.h"
#include "base/limits.h"
#include "base/status.h"

namespace pneuma::app {

class Gatekeeper {
 public:
  using TimePoint = GuessLimits::TimePoint;

  struct Verdict {
    GrantPtr grant;        // null: refused
    base::Status refusal;  // UNAUTHENTICATED; or LIMIT_EXCEEDED after too many wrong tokens of the address
    double retry_after_s = 0.0;
  };

  /// Lets everyone do everything, until it is given tokens.
  explicit Gatekeeper(const base::Limits& limits = {}) : rates_(limits) {}

  /// From now on these tokens count and no others.
  void use(std::vector<Token> tokens);
  [[nodiscard]] bool asks_for_tokens() const { return asks_for_tokens_; }

  /// The token's grant, if it has one now. `address` is who says it, as it is counted.
  [[nodiscard]] Verdict admit(std::string_view token, const std::string& address, TimePoint now,
                              std::chrono::sys_seconds wall_clock);
  /// Why a grant of admit() holds no longer: its token expired, was revoked or changed.
  [[nodiscard]] base::Status check_still(const GrantPtr& grant, std::chrono::sys_seconds wall_clock) const;
  /// What the client's requests are taken from.
  [[nodiscard]] std::shared_ptr<TokenBucket> commands_of(const std::string& client, TimePoint now) {
    return rates_.commands_of(client, now);
  }

 private:
  struct Known {
    GrantPtr grant;
    TokenDigest digest{};
    bool is_guessable = false;
  };
  std::vector<Known> known_;
  std::set<GrantPtr> valid_;  // those of known_
  bool asks_for_tokens_ = false;
  GuessLimits guesses_;
  ClientRates rates_;
};

/// Whose requests, worlds and guesses count together: a token at an address, or the address alone where no token is
/// asked for.
[[nodiscard]] std::string client_of(const Grant& grant, const std::string& address);

/// By the wall clock, which expiry goes by.
[[nodiscard]] std::chrono::sys_seconds wall_clock_now();

}  // namespace pneuma::app
