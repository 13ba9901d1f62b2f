// When a reader that asked for adaptive quality goes to a coarser one, and when back. Pure; the time is passed in.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "net/reader_stats.h"

namespace pneuma::app {

/// A quality below the one asked for.
struct Rung {
  double error_factor;         // of max_error_m
  std::uint64_t rate_divisor;  // of the rate
  double bytes_share;          // about what it takes of the bytes a second of the quality asked for
};

// The shares are those of `five-balls` and `bouncing-ball` at 60 Hz within 0.5 mm, measured.
inline constexpr std::array<Rung, 5> quality_rungs{
    {{1.0, 1, 1.0}, {2.0, 1, 0.78}, {4.0, 1, 0.61}, {4.0, 2, 0.36}, {4.0, 4, 0.2}}};

class QualityLadder {
 public:
  using TimePoint = net::TimePoint;

  // A frame that waits longer shows a world long gone.
  static constexpr std::chrono::milliseconds queue_age_max{250};
  // A move shows in what is dropped and waits only after this.
  static constexpr std::chrono::seconds settling{1};
  // Without strain for so long, a finer quality is tried; each try that fails doubles it.
  static constexpr std::chrono::seconds calm_min{3};
  static constexpr std::chrono::seconds calm_max{96};
  // A try that holds for so long has not failed.
  static constexpr std::chrono::seconds trial{10};

  [[nodiscard]] std::size_t rung() const { return rung_; }

  /// Of the stream that the reader has now. The rung that it should go to; nothing: it stays.
  [[nodiscard]] std::optional<std::size_t> advise(const net::ReaderReport& report);
  /// The reader has another stream since the last report.
  void moved(std::size_t rung);

 private:
  [[nodiscard]] std::size_t coarser(const net::ReaderReport& report) const;

  std::size_t rung_ = 0;
  bool tried_finer_ = false;  // by the last move
  std::chrono::seconds calm_needed_ = calm_min;
  TimePoint moved_at_{};
  TimePoint strained_at_{};
  net::ReaderReport last_;
};

}  // namespace pneuma::app
