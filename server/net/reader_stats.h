// How a session reads: what it was sent, what was left out, how long frames wait for it. Pure; the time is passed in.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace pneuma::net {

using TimePoint = std::chrono::steady_clock::time_point;
using Duration = std::chrono::steady_clock::duration;

struct FrameTotals {
  std::uint64_t frames_sent = 0;
  std::uint64_t frames_dropped = 0;
  std::uint64_t bytes_sent = 0;
  std::uint64_t bytes_dropped = 0;
  std::uint64_t vertices_sent = 0;  // that the frames sent showed, all together
};

struct StreamStats {
  std::uint32_t stream_id = 0;
  FrameTotals totals;    // since it began
  Duration queue_age{};  // of the oldest frame that is not written yet; 0: none waits
};

/// Of a stream that is reported on.
struct ReaderReport {
  TimePoint at;
  double drain_bytes_s = 0.0;  // what the connection took in the last second
  StreamStats stream;
};

struct ReaderStats {
  TimePoint at;
  double drain_bytes_s = 0.0;  // what the connection took in the last second
  std::vector<StreamStats> streams;
};

/// How long frames waited before their write began.
struct QueueAges {
  static constexpr std::array bounds_s{1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5, 1.0, 5.0};
  std::array<std::uint64_t, bounds_s.size() + 1> counts{};  // up to each bound, and past the last
  double sum_s = 0.0;

  void add(Duration age);
};

/// What a connection took in the last second.
class DrainMeter {
 public:
  void add(TimePoint now, std::size_t bytes);
  [[nodiscard]] double bytes_s(TimePoint now) const;

 private:
  static constexpr std::chrono::milliseconds part{100};
  static constexpr std::size_t parts = 10;
  [[nodiscard]] static std::int64_t part_of(TimePoint time) { return time.time_since_epoch() / part; }

  std::array<std::size_t, parts> bytes_{};  // of the last parts of time, each at its number modulo `parts`
  std::int64_t last_ = 0;                   // the latest part with bytes
};

}  // namespace pneuma::net
