// How a scene of an extreme case is loaded and set up to run.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "physics/world.h"

namespace pneuma::extremes {

/// A scene of tests/numerics/scenes. Throws std::runtime_error with what is wrong in it.
[[nodiscard]] physics::Scene load(const std::string& file);

/// Throws where the scene is refused.
[[nodiscard]] physics::World make_world(physics::Scene scene);

struct Variant {
  physics::Integrator integrator;
  physics::Precision precision;
};

inline constexpr std::array<physics::Integrator, 7> every_integrator{physics::Integrator::explicit_euler,
                                                                     physics::Integrator::midpoint,
                                                                     physics::Integrator::rk4,
                                                                     physics::Integrator::symplectic_euler,
                                                                     physics::Integrator::implicit_euler,
                                                                     physics::Integrator::tr_bdf2,
                                                                     physics::Integrator::xpbd};

/// Each integrator in both precisions.
[[nodiscard]] std::vector<Variant> every_variant();
/// "RK4, single".
[[nodiscard]] std::string name_of(const Variant& variant);
void set(physics::Scene& scene, const Variant& variant);

[[nodiscard]] std::vector<physics::Vec3d> positions_of(const physics::World& world, std::size_t body);

/// To so many significant digits.
[[nodiscard]] std::string number(double value, int digits = 3);

}  // namespace pneuma::extremes
