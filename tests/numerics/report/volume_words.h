// What the part on volume methods found, and what it says to use.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "numerics/report/page.h"
#include "numerics/report/volume_costs.h"
#include "numerics/report/volume_motion.h"

namespace pneuma::report::volumes {

/// A mesh whose volume was measured.
struct Subject {
  std::string name;         // "ball"
  std::string title;        // "a ball of 162 vertices"
  std::vector<Cost> costs;  // EXACT first
};

/// What bodies are moved by, EXACT first. Finer samples would show nothing but their time.
[[nodiscard]] const std::vector<physics::Volume>& moved_by();

/// Errors are relative to EXACT.
struct Moved {
  Motion motion;
  std::vector<MotionResult> results;  // of moved_by()

  [[nodiscard]] const MotionResult& exact() const { return results.front(); }
  [[nodiscard]] double rest_error(std::size_t i) const {
    return results[i].volume_at_rest_m3 / exact().volume_at_rest_m3 - 1.0;
  }
  [[nodiscard]] double period_error(std::size_t i) const { return results[i].period_s / exact().period_s - 1.0; }
  /// Of the greatest kinetic energy.
  [[nodiscard]] double energy_gain(std::size_t i) const { return results[i].energy_gained_j / exact().kinetic_max_j; }
};

/// Two digits with their unit; of a ratio "5.8 %" and "+5.8 %".
[[nodiscard]] std::string microseconds(double time_us);
[[nodiscard]] std::string share(double ratio);
[[nodiscard]] std::string signed_share(double ratio);

/// Which method to use: of the ball and the hand.
void write_advice(Page& page, const std::array<Subject, 2>& subjects, const std::array<Moved, 2>& moved);

}  // namespace pneuma::report::volumes
