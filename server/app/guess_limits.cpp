#include "app/guess_limits.h"

#include <algorithm>

#include "base/token_limits.h"

namespace pneuma::app {

double GuessLimits::wait_s(const std::string& address, TimePoint now) const {
  const auto found = guessers_.find(address);
  if (found == guessers_.end()) return 0.0;
  return std::max(0.0, std::chrono::duration<double>(found->second.waits_until - now).count());
}

void GuessLimits::note_wrong(const std::string& address, const TokenDigest& digest, TimePoint now) {
  forget(now);
  Guesser& guesser = guessers_[address];
  guesser.last_at = now;
  if (std::ranges::find(guesser.last, digest) != guesser.last.end()) return;
  guesser.last.push_back(digest);
  if (guesser.last.size() > base::token_guesses_remembered) guesser.last.pop_front();
  ++guesser.guesses;
  if (guesser.guesses < base::token_guesses_at_once) return;
  const std::size_t doublings = std::min<std::size_t>(guesser.guesses - base::token_guesses_at_once, 16);
  guesser.waits_until =
      now + std::min<std::chrono::seconds>(base::token_guess_wait_max, base::token_guess_wait_min * (1L << doublings));
}

// Those that have been quiet for long, and where there are too many those that have been quiet for longest.
void GuessLimits::forget(TimePoint now) {
  if (guessers_.size() < base::token_guessers_max) return;
  std::erase_if(guessers_,
                [&](const auto& entry) { return now - entry.second.last_at > base::token_guesses_forgotten_after; });
  if (guessers_.size() < base::token_guessers_max) return;
  guessers_.erase(std::ranges::min_element(guessers_, {}, [](const auto& entry) { return entry.second.last_at; }));
}

}  // namespace pneuma::app
