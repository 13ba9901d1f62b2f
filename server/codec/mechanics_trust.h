// The encoder's choice, frame by frame, between a body's mechanics and its last moves to predict it by. Another encoder
// may choose otherwise; what it chose is in the frame. Sizes are the levels of the residuals, quarter octaves.
#pragma once

#include <cstdint>

namespace pneuma::codec {

/// Of one body, and new where it begins at rest. Its first frame goes by its moves: that makes its velocities known.
class MechanicsTrust {
 public:
  /// Whether mechanics that leave residuals of this level are taken without a look at what the moves would leave.
  [[nodiscard]] bool takes_unseen(std::uint32_t level);
  /// Otherwise: whether they are taken against moves that leave `moves_level`, with all that these take besides. For a
  /// run of frames they may be so though they are a little behind.
  [[nodiscard]] bool takes(std::uint32_t level, double moves_level);

  // Measured on five balls that bounce. Mechanics that did better are taken unseen while their level rises by no more,
  // and for so many frames.
  static constexpr std::uint32_t unseen_rise = 2;
  static constexpr std::uint32_t unseen_frames = 16;
  // A body's velocities only come to be known in a run of frames that its mechanics predict. Where its moves do better
  // by less than this, the mechanics get such a run; one that did not pay is followed by a pause eight times as long.
  static constexpr double close_levels = 2.0;
  static constexpr std::uint32_t run_frames = 8;
  static constexpr std::uint32_t pause_frames = 64;

 private:
  bool is_new_ = true;
  std::uint32_t unseen_level_max_ = 0;
  std::uint32_t unseen_frames_left_ = 0;
  std::uint32_t run_frames_left_ = run_frames;
  std::uint32_t pause_frames_left_ = 0;
};

}  // namespace pneuma::codec
