// What a volume that is measured wrongly does to the motion of a body with gas.
#pragma once

#include <array>
#include <string>

#include "physics/scene/scene.h"

namespace pneuma::report::volumes {

/// A body with gas in the void, in two scenes.
struct Motion {
  std::string name;          // "ball"
  physics::Scene rest = {};  // damped: it comes to rest
  physics::Scene free = {};  // undamped: it turns, and goes on as it began
  double period_s = 0.0;     // of its breathing when free, about; 0: it has no one period
};
/// A ball of 162 vertices that breathes, and the hand, without its pins, tumbling.
[[nodiscard]] std::array<Motion, 2> motions();

/// Not a number where the body ran away.
struct MotionResult {
  double volume_at_rest_m3 = 0.0;  // the exact one, the mean over the last sixth of the run
  double period_s = 0.0;
  double kinetic_max_j = 0.0;
  // Gained from nowhere, from the run's first quarter to its last. Of a volume that is off by the same ratio at every
  // pose and size, none: it acts as less gas would, or more.
  double energy_gained_j = 0.0;
};
[[nodiscard]] MotionResult run_motion(const Motion& motion, const physics::Volume& volume);

}  // namespace pneuma::report::volumes
