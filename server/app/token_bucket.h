// A token bucket: how often a client may ask. Pure; the time is passed in.
#pragma once

#include <chrono>

namespace pneuma::app {

class TokenBucket {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  TokenBucket(double tokens_per_s, double burst) : tokens_per_s_(tokens_per_s), burst_(burst), tokens_(burst) {}

  /// Takes a token; 0 where there was one, otherwise the seconds until there is.
  [[nodiscard]] double take(TimePoint now);
  /// As at the beginning.
  [[nodiscard]] bool is_full(TimePoint now) const;

 private:
  double tokens_per_s_;
  double burst_;
  double tokens_;
  TimePoint last_{};
  bool used_ = false;
};

}  // namespace pneuma::app
