#include "numerics/extremes/variants.h"

#include <stdexcept>

namespace pneuma::extremes {

using physics::Precision;

physics::World make_world(physics::Scene scene) {
  auto world = physics::World::create(std::move(scene));
  if (!world.ok()) throw std::runtime_error(world.status().message());
  return std::move(*world);
}

std::vector<Variant> every_variant() {
  std::vector<Variant> variants;
  for (const physics::Integrator integrator : every_integrator) {
    for (const Precision precision : {Precision::double_precision, Precision::single_precision}) {
      variants.push_back({integrator, precision});
    }
  }
  return variants;
}

std::string name_of(const Variant& variant) {
  return method_name(variant.integrator)
      .append(variant.precision == Precision::double_precision ? ", double" : ", single");
}

physics::Scene with(physics::Scene scene, const Variant& variant) {
  scene.stepping.integrator = variant.integrator;
  scene.stepping.precision = variant.precision;
  return scene;
}

std::vector<physics::Vec3d> positions_of(const physics::World& world, std::size_t body) {
  std::vector<double> coordinates(3 * world.soft_body(body).mesh->positions_m.size());
  world.copy_positions(body, coordinates);
  std::vector<physics::Vec3d> positions;
  for (std::size_t i = 0; i < coordinates.size(); i += 3) {
    positions.emplace_back(coordinates[i], coordinates[i + 1], coordinates[i + 2]);
  }
  return positions;
}

}  // namespace pneuma::extremes
