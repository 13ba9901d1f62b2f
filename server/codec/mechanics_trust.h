// The encoder's choice, frame by frame, between a body's mechanics and its last moves to predict it by. Another encoder
// may choose otherwise; what it chose is in the frame. Sizes are the levels of the residuals, quarter octaves.
#pragma once

#include <cstdint>

namespace pneuma::codec {

/// Of one body, and new where the stream begins with it, as if it were at rest.
class MechanicsTrust {
 public:
  /// Whether mechanics that leave residuals of this level are taken without a look at what the moves would leave.
  [[nodiscard]] bool takes_unseen(std::uint32_t level);
  /// Otherwise: whether they are taken against moves that leave `moves_level`, with all that these take besides. For a
  /// run of frames they may be so though they are a little behind.
  [[nodiscard]] bool takes(std::uint32_t level, double moves_level);

  // A new body was at rest where the mechanics foresee its first frame, better than its moves do by this. Otherwise
  // that frame goes by its moves, which tell its velocities.
  static constexpr double at_rest_levels = 8.0;
  // Mechanics that did better are taken unseen while their level rises by no more, and for so many frames. This and
  // what follows was measured on five balls that bounce.
  static constexpr std::uint32_t unseen_rise = 2;
  static constexpr std::uint32_t unseen_frames = 16;
  // Moves tell velocities to no better than a step; a run of frames by the mechanics does. They get one where they are
  // behind by less than this, and after one that did not pay a pause eight times as long.
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
