#include "app/token_bucket.h"

#include <algorithm>

namespace pneuma::app {

double TokenBucket::take(TimePoint now) {
  if (used_ && now > last_) {
    tokens_ = std::min(burst_, tokens_ + std::chrono::duration<double>(now - last_).count() * tokens_per_s_);
  }
  if (!used_ || now > last_) last_ = now;
  used_ = true;
  if (tokens_ < 1.0) return (1.0 - tokens_) / tokens_per_s_;
  tokens_ -= 1.0;
  return 0.0;
}

bool TokenBucket::is_full(TimePoint now) const {
  return !used_ || tokens_ + std::chrono::duration<double>(now - last_).count() * tokens_per_s_ >= burst_;
}

}  // namespace pneuma::app
