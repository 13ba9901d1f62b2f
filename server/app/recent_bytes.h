// Bytes of the last second. Pure; the time is passed in.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>

namespace pneuma::app {

class RecentBytes {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;

  /// Times never go back.
  void add(TimePoint now, std::size_t bytes) {
    if (bytes > 0) entries_.push_back({now, bytes});
    while (!entries_.empty() && entries_.front().at + std::chrono::seconds(1) <= now) entries_.pop_front();
  }
  [[nodiscard]] std::size_t sum(TimePoint now) const {
    std::size_t bytes = 0;
    for (const Entry& entry : entries_) bytes += entry.at + std::chrono::seconds(1) > now ? entry.bytes : 0;
    return bytes;
  }

 private:
  struct Entry {
    TimePoint at;
    std::size_t bytes;
  };
  std::deque<Entry> entries_;
};

}  // namespace pneuma::app
