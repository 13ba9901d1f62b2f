#include "app/quality_ladder.h"

#include <algorithm>

namespace pneuma::app {

std::optional<std::size_t> QualityLadder::advise(const net::ReaderReport& report) {
  if (last_.at == TimePoint()) {  // nothing to compare it with
    moved_at_ = report.at;
    last_ = report;
    return std::nullopt;
  }
  const bool strained = report.stream.totals.frames_dropped > last_.stream.totals.frames_dropped ||
                        report.stream.queue_age > queue_age_max;
  const auto since_move = report.at - moved_at_;
  std::optional<std::size_t> to;
  if (strained) {
    strained_at_ = report.at;
    if (since_move >= settling && rung_ + 1 < quality_rungs.size()) {
      to = coarser(report);
      if (tried_finer_ && since_move < trial) calm_needed_ = std::min(2 * calm_needed_, calm_max);
    }
  } else {
    if (tried_finer_ && since_move >= trial) calm_needed_ = calm_min;
    if (rung_ > 0 && report.at - std::max(strained_at_, moved_at_) >= calm_needed_) to = rung_ - 1;
  }
  last_ = report;
  return to;
}

// The next one, or further down where the connection takes far less than what the reader should have had.
std::size_t QualityLadder::coarser(const net::ReaderReport& report) const {
  const auto offered = [](const net::ReaderReport& r) {
    return static_cast<double>(r.stream.totals.bytes_sent + r.stream.totals.bytes_dropped);
  };
  const double seconds = std::chrono::duration<double>(report.at - last_.at).count();
  std::size_t to = rung_ + 1;
  if (seconds <= 0.0) return to;
  const double offered_bytes_s = (offered(report) - offered(last_)) / seconds;
  const auto takes_bytes_s = [&](std::size_t rung) {
    return offered_bytes_s * quality_rungs[rung].bytes_share / quality_rungs[rung_].bytes_share;
  };
  while (to + 1 < quality_rungs.size() && takes_bytes_s(to) > report.drain_bytes_s) ++to;
  return to;
}

void QualityLadder::moved(std::size_t rung) {
  tried_finer_ = rung < rung_;
  rung_ = rung;
  moved_at_ = last_.at;
  last_.stream = {};
}

}  // namespace pneuma::app
