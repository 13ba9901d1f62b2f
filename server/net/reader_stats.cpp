#include "net/reader_stats.h"

#include <algorithm>

namespace pneuma::net {

void QueueAges::add(Duration age) {
  const double age_s = std::chrono::duration<double>(age).count();
  const auto bound = std::ranges::lower_bound(bounds_s, age_s);
  ++counts[static_cast<std::size_t>(bound - bounds_s.begin())];
  sum_s += age_s;
}

void DrainMeter::add(TimePoint now, std::size_t bytes) {
  const std::int64_t present = part_of(now);
  // What is older than a second makes room.
  const std::int64_t outdated = std::min<std::int64_t>(present - last_, parts);
  for (std::int64_t i = 1; i <= outdated; ++i) bytes_[static_cast<std::size_t>(last_ + i) % parts] = 0;
  last_ = std::max(last_, present);
  bytes_[static_cast<std::size_t>(last_) % parts] += bytes;
}

double DrainMeter::bytes_s(TimePoint now) const {
  const std::int64_t oldest = part_of(now) - static_cast<std::int64_t>(parts) + 1;
  std::size_t sum = 0;
  for (std::int64_t i = std::max(oldest, last_ - static_cast<std::int64_t>(parts) + 1); i <= last_; ++i) {
    sum += bytes_[static_cast<std::size_t>(i) % parts];
  }
  constexpr double second = std::chrono::duration<double>(part * parts).count();
  return static_cast<double>(sum) / second;
}

}  // namespace pneuma::net
