// What others may know of a world without asking the thread that runs it.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "pneuma/v1/session.pb.h"

namespace pneuma::app {

struct WorldStatus {
  v1::WorldList::World listing;
  std::chrono::steady_clock::time_point last_active;  // when a tick last ended, or the world began or went on
  std::string disk_trouble;                           // why the world cannot be kept; empty: it can
  double lateness_s = 0.0;                            // of its ticks' ends, 99th percentile of the last seconds
  double time_ratio = 1.0;                            // as in v1::Stats
  /// When the last checkpoint was written that lacks something since; none: nothing is kept, or all is in it.
  std::optional<std::chrono::steady_clock::time_point> behind_checkpoint_of;
};

}  // namespace pneuma::app
