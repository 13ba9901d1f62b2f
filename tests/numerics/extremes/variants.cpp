#include "numerics/extremes/variants.h"

#include <cstdio>
#include <stdexcept>

#include "numerics/extremes/extreme_case.h"
#include "physics/stability.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::extremes {

using physics::Precision;

physics::Scene load(const std::string& file) {
  auto message = scene_io::load_scene(scene_path(file));
  if (!message.ok()) throw std::runtime_error(message.status().message());
  auto scene = scene_io::to_physics(*message);
  if (!scene.ok()) throw std::runtime_error(file + ": " + scene.status().message());
  return *scene;
}

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
  return std::string(physics::name_of(variant.integrator))
      .append(variant.precision == Precision::double_precision ? ", double" : ", single");
}

void set(physics::Scene& scene, const Variant& variant) {
  scene.stepping.integrator = variant.integrator;
  scene.stepping.precision = variant.precision;
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

std::string number(double value, int digits) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}

}  // namespace pneuma::extremes
