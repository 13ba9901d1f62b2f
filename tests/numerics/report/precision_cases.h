// The scenes that are run with every method, and what each is judged by.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "numerics/report/precision_errors.h"
#include "physics/scene/scene.h"

namespace pneuma::report::precision {

inline constexpr double rate_hz = 60.0;

/// What a case is judged by: one error, or one before contact and one with it.
struct Judged {
  std::string name;   // of its plot, and in outcomes: "bouncing-ball-flight"
  std::string title;  // "Bouncing ball, before it lands"
  double Errors::* error = nullptr;
  std::string label;  // of the plot's axis
};

struct Case {
  std::string name;
  std::string words;          // what moves
  physics::Scene scene = {};  // its stepping is each run's own
  std::uint64_t ticks = 60;
  std::uint64_t free_ticks = std::numeric_limits<std::uint64_t>::max();  // in which nothing touches
  std::uint64_t rest_ticks = 0;                                          // the last ones, in which it rests
  bool breathes = false;
  bool in_single_too = false;              // its ladder is climbed in single precision as well
  std::uint32_t explicit_from = 4;         // substeps a tick: the least of the ladder
  std::uint32_t reference_substeps = 128;  // where the reference's halving begins
  std::vector<Judged> judged = {};         // the reference is converged by the first
};

/// Motions without damping, then stiff balls that come to rest (`quick`: for a shorter time).
[[nodiscard]] std::vector<Case> all_cases(bool quick);

/// A ball of 162 vertices and 1 kg that comes to rest, let go in the shape of its springs, a sphere of 1 m.
struct RestingBall {
  std::string name;  // of its case
  std::string title;
  double stiffness_n_m = 1e4;
  double nrt_j = 100.0;
};
[[nodiscard]] const std::vector<RestingBall>& resting_balls();
/// The closed form (DESIGN section 5) of its volume at rest, exact where all edges are alike.
[[nodiscard]] double closed_form_m3(const RestingBall& ball);

[[nodiscard]] Measuring measuring_of(const Case& subject);

}  // namespace pneuma::report::precision
