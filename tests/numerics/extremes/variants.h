// A scene in each of the ways that it can be stepped.
#pragma once

#include <string>
#include <vector>

#include "numerics/extremes/run.h"

namespace pneuma::extremes {

struct Variant {
  physics::Integrator integrator;
  physics::Precision precision;
};

/// Each integrator in both precisions.
[[nodiscard]] std::vector<Variant> every_variant();
/// "RK4, single".
[[nodiscard]] std::string name_of(const Variant& variant);
[[nodiscard]] physics::Scene with(physics::Scene scene, const Variant& variant);

/// Throws std::runtime_error where the scene is refused.
[[nodiscard]] physics::World make_world(physics::Scene scene);
[[nodiscard]] std::vector<physics::Vec3d> positions_of(const physics::World& world, std::size_t body);

}  // namespace pneuma::extremes
