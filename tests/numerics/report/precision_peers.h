// Bullet's soft body on the same axes.
#pragma once

#include "numerics/report/precision_runs.h"

namespace pneuma::report::precision {

/// The ball in Bullet at 60 Hz, its springs as hard as Bullet has them, with 1 to 50 iterations a step: how far its
/// volume is from `rest_m3` after ten seconds.
[[nodiscard]] std::vector<Peer> bullet_peers(const RestingBall& ball, double rest_m3);
[[nodiscard]] std::vector<Timed> timed_peers(const RestingBall& ball, std::vector<Peer>& peers);

}  // namespace pneuma::report::precision
