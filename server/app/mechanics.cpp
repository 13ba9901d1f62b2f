#include "app/mechanics.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>
#include <variant>
#include <vector>

#include "physics/forces/gas.h"
#include "physics/rigid/contact_surface.h"
#include "physics/state/vertex_masses.h"

namespace pneuma::app {

namespace {

// A substep of the prediction turns the fastest motion by no more than this (it grows past 2), and two substeps more
// leave half of the phase error that is left.
constexpr double substep_rad = 1.5;
constexpr double substeps_more = 2.0;
// And lets the most damped one decay by no more than this, since it knows the speed of before.
constexpr double substep_decay = 0.6;
// More take longer than what they save is worth.
constexpr double substeps_max = 24.0;
// Of any motion at all.
constexpr auto substeps_least = static_cast<std::uint32_t>(substeps_more) + 1;

std::vector<float> masses_kg(const physics::SoftBody& body) {
  const auto count = body.mesh->positions_m.size();
  const double mean_kg = body.mass_kg / static_cast<double>(count);
  const bool alike = body.vertex_mass_scale.empty() && body.pins.empty() && !body.pin_boundary;
  if (alike) return {static_cast<float>(mean_kg)};
  std::vector<float> masses(count, static_cast<float>(mean_kg));
  const std::vector<double> shares = physics::mass_shares(body);
  for (std::size_t i = 0; i < shares.size(); ++i) masses[i] = static_cast<float>(mean_kg * shares[i]);
  for (const std::uint32_t vertex : body.pins) masses[vertex] = 0.0F;
  if (body.pin_boundary) {
    for (const std::uint32_t vertex : body.mesh->boundary) masses[vertex] = 0.0F;
  }
  return masses;
}

/// Lists of one an edge of the order, from those of the mesh.
void take_springs(const physics::SoftBody& body, const codec::MeshOrder& order, codec::Mechanics& mechanics) {
  const physics::Mesh& mesh = *body.mesh;
  const bool alike = body.springs.vertex_stiffness_scale.empty();
  if (alike) mechanics.stiffnesses_n_m = {static_cast<float>(body.springs.stiffness_n_m)};
  for (const auto& [a, b] : codec::spring_edges(order)) {
    const auto [low, high] = std::minmax(order.vertices[a], order.vertices[b]);
    const physics::Edge edge{low, high};
    const auto found = std::ranges::lower_bound(mesh.edges, edge);
    assert(found != mesh.edges.end() && *found == edge);  // the order is of the mesh's own faces
    const double length_m = mesh.edge_lengths_m[static_cast<std::size_t>(found - mesh.edges.begin())];
    mechanics.rest_lengths_m.push_back(static_cast<float>(body.springs.rest_scale * length_m));
    if (alike) continue;
    const double stiffness_n_m = body.springs.stiffness_n_m * body.springs.stiffness_scale(edge);
    mechanics.stiffnesses_n_m.push_back(static_cast<float>(stiffness_n_m));
  }
}

codec::Mechanics::Gas gas_of(const physics::Gas& gas, const physics::GasState& state, double outside_pa) {
  const double exponent = gas.law == physics::GasLaw::adiabatic ? gas.heat_capacity_ratio : 1.0;
  return {.pressure_pa = physics::gas_pressure_pa(state, gas, state.volume_ref_m3),
          .volume_m3 = state.volume_ref_m3,
          .exponent_65536ths = static_cast<std::uint32_t>(std::lround(65536.0 * exponent)),
          .outside_pa = outside_pa};
}

std::vector<codec::Mechanics::Plane> planes_of(const physics::World& world, const physics::Surface& surface) {
  std::vector<codec::Mechanics::Plane> planes;
  for (const physics::ColliderState& collider : world.colliders()) {
    const auto* const shape = std::get_if<physics::PlaneShape>(&collider.collider.shape);
    const bool moves = !collider.collider.velocity.isZero() || !collider.collider.angular_velocity.isZero();
    if (shape == nullptr || moves || planes.size() == codec::simulated_planes_max) continue;
    const physics::Vec3d normal = (collider.orientation * shape->normal).normalized();
    const physics::ContactSurface both = physics::combine(surface, collider.collider.surface);
    planes.push_back({.normal = {normal.x(), normal.y(), normal.z()},
                      .offset_m = normal.dot(collider.position) + both.thickness_m,
                      .restitution = both.restitution,
                      .friction = both.friction});
  }
  return planes;
}

}  // namespace

std::optional<codec::Mechanics> mechanics_of(const physics::World& world, std::size_t soft_index,
                                             const codec::MeshOrder& order, MechanicsTerms& terms) {
  const physics::SoftBody& body = world.soft_body(soft_index);
  const auto& gas = world.gas(soft_index);  // it may have burst
  if (!physics::is_explicit(world.integrator()) || !world.is_predictable(soft_index)) {
    return std::nullopt;
  }
  std::vector<codec::Mechanics::Plane> planes = planes_of(world, body.surface);
  const auto work = [&](std::uint32_t substeps) {
    return codec::simulated_work(substeps, order.size(), body.mesh->faces.size(), planes.size());
  };
  const std::uint64_t work_least = work(substeps_least);
  if (work_least > terms.work_left) return std::nullopt;
  terms.work_left -= work_least;  // those that turn out to be too fast cost the estimate, too

  const physics::Frequencies frequencies = world.frequencies(soft_index);
  const double substeps = std::max(std::ceil(frequencies.fastest_rad_s * terms.frame_s / substep_rad) + substeps_more,
                                   std::ceil(frequencies.fastest_decay_1_s * terms.frame_s / substep_decay));
  if (!(substeps <= substeps_max)) return std::nullopt;
  codec::Mechanics mechanics;
  mechanics.frame_s = terms.frame_s;
  mechanics.substeps = std::max(static_cast<std::uint32_t>(substeps), substeps_least);
  const std::uint64_t work_more = work(mechanics.substeps) - work_least;
  if (work_more > terms.work_left) return std::nullopt;
  mechanics.masses_kg = masses_kg(body);
  take_springs(body, order, mechanics);
  mechanics.damping_n_s_m = body.springs.damping_n_s_m;
  if (gas && body.gas) mechanics.gas = gas_of(*body.gas, *gas, world.atmosphere().pressure_pa);
  const physics::Vec3d& gravity = world.gravity_m_s2();
  mechanics.gravity_m_s2 = {gravity.x(), gravity.y(), gravity.z()};
  mechanics.planes = std::move(planes);
  if (!codec::SimulatedMotion::check(order, mechanics, terms.grid_step_m).ok()) return std::nullopt;
  terms.work_left -= work_more;
  return mechanics;
}

v1::Mechanics to_proto(const codec::Mechanics& mechanics) {
  v1::Mechanics out;
  out.set_frame_s(mechanics.frame_s);
  out.set_substeps(mechanics.substeps);
  out.mutable_masses_kg()->Add(mechanics.masses_kg.begin(), mechanics.masses_kg.end());
  out.mutable_rest_lengths_m()->Add(mechanics.rest_lengths_m.begin(), mechanics.rest_lengths_m.end());
  out.mutable_stiffnesses_n_m()->Add(mechanics.stiffnesses_n_m.begin(), mechanics.stiffnesses_n_m.end());
  out.set_damping_n_s_m(mechanics.damping_n_s_m);
  const auto set = [](v1::Vec3& to, const std::array<double, 3>& from) {
    to.set_x(from[0]);
    to.set_y(from[1]);
    to.set_z(from[2]);
  };
  if (mechanics.gas.pressure_pa != 0.0 || mechanics.gas.outside_pa != 0.0) {
    v1::Mechanics::Gas& gas = *out.mutable_gas();
    gas.set_pressure_pa(mechanics.gas.pressure_pa);
    gas.set_volume_m3(mechanics.gas.volume_m3);
    gas.set_exponent_65536ths(mechanics.gas.exponent_65536ths);
    gas.set_outside_pa(mechanics.gas.outside_pa);
  }
  set(*out.mutable_gravity_m_s2(), mechanics.gravity_m_s2);
  for (const codec::Mechanics::Plane& plane : mechanics.planes) {
    v1::Mechanics::Plane& to = *out.add_planes();
    set(*to.mutable_normal(), plane.normal);
    to.set_offset_m(plane.offset_m);
    to.set_restitution(plane.restitution);
    to.set_friction(plane.friction);
  }
  return out;
}

}  // namespace pneuma::app
