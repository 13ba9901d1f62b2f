// What one volume costs by each method, and how far it is off.
#pragma once

#include <string>
#include <vector>

#include "numerics/volume_errors.h"

namespace pneuma::report::volumes {

struct Cost {
  physics::Volume volume;
  double error_rms = 0.0;  // relative to the exact volume, over the turned poses
  double time_us = 0.0;    // CPU, of one volume
};

/// As in scenes: "SUBDIVIDED".
[[nodiscard]] std::string name_of(const physics::Volume& volume);
/// "SUBDIVIDED 16".
[[nodiscard]] std::string plain_title_of(const physics::Volume& volume);
/// For the page: "`SUBDIVIDED`, 16".
[[nodiscard]] std::string title_of(const physics::Volume& volume);

/// Every rung of every ladder of volume_errors.h on the body, in that order; of `body` its own method does not count.
[[nodiscard]] std::vector<Cost> costs_of(physics::SoftBody body, int rounds);

/// The one of this method and resolution, which is there.
[[nodiscard]] const Cost& cost_of(const std::vector<Cost>& costs, const physics::Volume& volume);

}  // namespace pneuma::report::volumes
