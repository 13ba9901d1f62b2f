#include "mechanics.h"

#include <array>
#include <utility>

namespace pneuma::client {

namespace {

std::array<double, 3> vector_of(const v1::Vec3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

}  // namespace

base::Result<codec::Mechanics> mechanics_of(const v1::Mechanics& message, const codec::MeshOrder& order,
                                            double grid_step_m) {
  codec::Mechanics mechanics;
  if (static_cast<std::size_t>(message.planes_size()) > codec::simulated_planes_max) {
    return base::Status(base::StatusCode::malformed, "more than any body has", "planes");
  }
  mechanics.frame_s = message.frame_s();
  mechanics.substeps = message.substeps();
  mechanics.masses_kg.assign(message.masses_kg().begin(), message.masses_kg().end());
  mechanics.rest_lengths_m.assign(message.rest_lengths_m().begin(), message.rest_lengths_m().end());
  mechanics.stiffnesses_n_m.assign(message.stiffnesses_n_m().begin(), message.stiffnesses_n_m().end());
  mechanics.damping_n_s_m = message.damping_n_s_m();
  if (message.has_gas()) {
    const v1::Mechanics::Gas& gas = message.gas();
    mechanics.gas = {gas.pressure_pa(), gas.volume_m3(), gas.exponent_65536ths(), gas.outside_pa()};
  }
  mechanics.gravity_m_s2 = vector_of(message.gravity_m_s2());
  for (const v1::Mechanics::Plane& plane : message.planes()) {
    mechanics.planes.push_back({vector_of(plane.normal()), plane.offset_m(), plane.restitution(), plane.friction()});
  }
  if (const auto checked = codec::SimulatedMotion::check(order, mechanics, grid_step_m); !checked.ok()) {
    return base::Status(base::StatusCode::malformed, checked.what(), checked.where());
  }
  return mechanics;
}

}  // namespace pneuma::client
