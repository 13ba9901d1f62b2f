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

/// Of all soft and rigid bodies: of their motion, springs, gases and height.
inline double whole_energy_j(const World& world) {
  double sum_j = 0.0;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    const BodyMeasures of = world.measure(i);
    sum_j += of.kinetic_j + of.elastic_j + of.gas_j + of.gravity_j;
  }
  for (const RigidState& state : world.rigid_bodies()) {
    const Vec3d spin = state.orientation.inverse() * state.angular_velocity;
    const Vec3d axes = state.principal_axes ? Vec3d(state.principal_axes->inverse() * spin) : spin;
    sum_j += 0.5 * state.body.mass_kg * state.velocity.squaredNorm() +
             0.5 * axes.cwiseAbs2().dot(state.inverse_inertia_1_kg_m2.cwiseInverse()) -
             state.body.mass_kg * world.gravity_m_s2().dot(state.position);
  }
  return sum_j;
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
