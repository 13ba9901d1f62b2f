// What the numerics suites share beside the known scenes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "numerics/known_scenes.h"
#include "physics/choice/step_choice.h"

namespace pneuma::physics {

/// For the name of a test.
inline std::string test_name_of(const testing::TestParamInfo<Integrator>& param) {
  return std::string(name_of(param.param));
}

/// A hundred random scenes, or as many as PNEUMA_RANDOM_SCENES asks for: the program of the tests, run by itself, takes
/// it.
inline std::uint32_t tens_of_scenes() {
  const char* asked = std::getenv("PNEUMA_RANDOM_SCENES");
  return asked == nullptr ? 10U : std::max(1U, static_cast<std::uint32_t>(std::strtoul(asked, nullptr, 10) / 10));
}

/// Mean period between the crossings, of which there are at least two.
inline double period_s(const std::vector<double>& samples, double dt_s) {
  const std::vector<double> times_s = upward_crossings_s(samples, dt_s);
  if (times_s.size() < 2) {
    ADD_FAILURE() << "the signal does not oscillate";
    return 0.0;
  }
  return (times_s.back() - times_s.front()) / static_cast<double>(times_s.size() - 1);
}

}  // namespace pneuma::physics
