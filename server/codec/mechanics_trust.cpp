#include "codec/mechanics_trust.h"

#include <algorithm>
#include <utility>

namespace pneuma::codec {

bool MechanicsTrust::take_unseen(std::uint32_t level) {
  if (unseen_frames_left_ == 0 || level > unseen_level_max_) return false;
  --unseen_frames_left_;
  unseen_level_max_ = std::min(unseen_level_max_, level + unseen_rise);
  return true;
}

bool MechanicsTrust::take(std::uint32_t level, double moves_level) {
  const double behind = level - moves_level;
  if (std::exchange(is_new_, false) && behind > -at_rest_levels) return false;
  if (behind < 0.0) {
    run_frames_left_ = run_frames;
    pause_frames_left_ = 0;
    unseen_level_max_ = level + unseen_rise;
    unseen_frames_left_ = unseen_frames;
    return true;
  }
  unseen_frames_left_ = 0;
  if (pause_frames_left_ > 0) {
    if (--pause_frames_left_ == 0) run_frames_left_ = run_frames;
    return false;
  }
  const bool is_close = behind < close_levels;
  const bool has_run = run_frames_left_ < run_frames;
  if (is_close) --run_frames_left_;
  if (run_frames_left_ == 0 || (has_run && !is_close)) pause_frames_left_ = pause_frames;
  return is_close;
}

}  // namespace pneuma::codec
