#include "codec/mechanics_trust.h"

#include <algorithm>
#include <utility>

namespace pneuma::codec {

bool MechanicsTrust::takes_unseen(std::uint32_t level) {
  if (unseen_frames_left_ == 0 || level > unseen_level_max_) return false;
  --unseen_frames_left_;
  unseen_level_max_ = std::min(unseen_level_max_, level + unseen_rise);
  return true;
}

bool MechanicsTrust::takes(std::uint32_t level, double moves_level) {
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
  if (behind >= close_levels) return false;
  if (--run_frames_left_ == 0) pause_frames_left_ = pause_frames;
  return true;
}

}  // namespace pneuma::codec
