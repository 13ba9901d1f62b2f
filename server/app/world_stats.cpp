#include "app/world_stats.h"

#include <chrono>
#include <cstddef>
#include <string>

#include "physics/choice/step_choice.h"
#include "scene_io/vectors.h"

namespace pneuma::app {

using scene_io::set;

void describe(const physics::World& world, std::size_t index, v1::Stats::Body& body) {
  const physics::BodyMeasures measures = world.measure(index);
  body.set_name(world.soft_body(index).name);
  body.set_volume_m3(measures.volume_m3);
  body.set_area_m2(measures.area_m2);
  body.set_pressure_pa(measures.pressure_pa);
  body.set_temperature_k(measures.temperature_k);
  body.set_moles(measures.moles);
  body.set_kinetic_j(measures.kinetic_j);
  body.set_elastic_j(measures.elastic_j);
  body.set_gas_j(measures.gas_j);
  body.set_gravity_j(measures.gravity_j);
  set(*body.mutable_centre_of_mass(), measures.centre_of_mass);
  set(*body.mutable_momentum(), measures.momentum);
  set(*body.mutable_angular_momentum(), measures.angular_momentum);
  body.set_max_speed_m_s(measures.max_speed_m_s);
  body.set_frozen(world.is_frozen(index));
  body.set_asleep(world.is_asleep(index));
  body.set_vertices(static_cast<std::uint32_t>(world.soft_body(index).mesh->positions_m.size()));
}

void describe(const physics::RigidState& state, v1::Stats::Rigid& body) {
  body.set_name(state.body.name);
  set(*body.mutable_position(), state.position);
  set(*body.mutable_orientation(), state.orientation);
  set(*body.mutable_velocity(), state.velocity);
  set(*body.mutable_angular_velocity(), state.angular_velocity);
  body.set_frozen(state.frozen);
  body.set_asleep(state.rest.asleep);
}

void describe(const physics::World& world, v1::Stats& out) {
  out.set_time_s(world.time_s());
  out.set_state_hash(world.state_hash());
  out.set_rate_hz(1.0 / world.tick_period_s());
  out.set_substeps(world.substeps());
  out.set_substeps_reason(world.substeps_reason());
  out.set_integrator(std::string(physics::name_of(world.integrator())));
  const physics::Profile profile = world.profile();
  for (std::size_t i = 0; i < profile.size(); ++i) {
    v1::Stats::Stage& stage = *out.add_stages();
    stage.set_name(std::string(physics::stage_names[i]));
    stage.set_time_s(std::chrono::duration<double>(profile[i].time).count());
    stage.set_calls(profile[i].calls);
    stage.set_bytes(profile[i].bytes);
  }
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) describe(world, i, *out.add_soft_bodies());
  for (const physics::RigidState& state : world.rigid_bodies()) describe(state, *out.add_rigid_bodies());
}

}  // namespace pneuma::app
