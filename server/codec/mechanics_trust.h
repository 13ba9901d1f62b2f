// The encoder's choice, frame by frame, between a body's mechanics and its last moves to predict it by. Another encoder
// may choose otherwise; what it chose is in the frame. Sizes are the levels of the residuals, quarter octaves.
#pragma once

#include <cstdint>

namespace pneuma::codec {

/// Of one body. A new one is of a body that a stream begins with, or that has leapt: as if it were at rest.
class MechanicsTrust {
 public:
  /// Asked first of each frame: mechanics that leave residuals of this level are taken, whatever the moves would leave.
  [[nodiscard]] bool take_unseen(std::uint32_t level);
  /// Asked otherwise: they are taken against moves that leave `moves_level`, which has the cost of new weights in it.
  [[nodiscard]] bool take(std::uint32_t level, double moves_level);

  // A new body counts as at rest where the mechanics foresee its first frame better than its moves do by this: 13 to 16
  // levels of balls at rest, 7 at most of balls in flight. Otherwise that frame goes by its moves, which tell about how
  // fast it is. The wrong choice takes some 10 % more for a second.
  static constexpr double at_rest_levels = 8.0;
  // Mechanics that did better are taken unseen while their level rises by no more, and for so many frames: measured on
  // five balls that bounce.
  static constexpr std::uint32_t unseen_rise = 2;
  static constexpr std::uint32_t unseen_frames = 16;
  // Moves tell velocities to no better than a step; a run of frames by the mechanics does. They get one where they are
  // behind by less than this; it ends where they are not, and a pause eight times as long follows one that did not pay.
  // Bodies that gain nothing by their mechanics, as these five, pay 1.8 % for it; with 1 level 0.8 %, but then a ball
  // in flight within 0.01 mm stays with its moves, which take 1.4 times as much.
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
