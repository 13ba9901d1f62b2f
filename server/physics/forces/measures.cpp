#include "physics/forces/measures.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "physics/forces/forces.h"
#include "physics/forces/gas.h"

namespace pneuma::physics {
namespace {

/// Minus the integral of P - p_outside over the volume, from the volume at the start (isothermal) or from infinity
/// (adiabatic). Below the floor of gas.h the pressure stays, and the energy goes on in a straight line.
double gas_energy_j(const GasState& state, const Gas& gas, double volume_m3, double outside_pressure_pa) {
  const double floor_m3 = gas_volume_floor * state.volume_ref_m3;
  const double curved_m3 = std::max(volume_m3, floor_m3);
  const double pressure_pa = gas_pressure_pa(state, gas, curved_m3);
  const double work_j = gas.law == GasLaw::isothermal
                            ? -pressure_pa * curved_m3 * std::log(curved_m3 / state.volume_ref_m3)
                            : pressure_pa * curved_m3 / (gas.heat_capacity_ratio - 1.0);
  const double straight_j = -pressure_pa * std::min(volume_m3 - floor_m3, 0.0);
  return work_j + straight_j + outside_pressure_pa * (volume_m3 - state.volume_ref_m3);
}

template <class Real>
double elastic_j(const SoftState<Real>& state, std::span<const Vec3d> x) {
  const std::vector<Edge>& edges = state.body.mesh->edges;
  const Springs& springs = state.body.springs;
  double sum_j = 0.0;
  const auto add = [&](std::size_t e, double stiffness_n_m) {
    const double length_m = (x[edges[e][1]] - x[edges[e][0]]).norm();
    const double stretch_m = length_m - static_cast<double>(state.rest_length_m(e));
    sum_j += 0.5 * stiffness_n_m * stretch_m * stretch_m;
  };
  if (springs.vertex_stiffness_scale.empty()) {
    for (std::size_t e = 0; e < edges.size(); ++e) add(e, springs.stiffness_n_m);
  } else {
    for (std::size_t e = 0; e < edges.size(); ++e) add(e, springs.stiffness_n_m * springs.stiffness_scale(edges[e]));
  }
  return sum_j + bending_energy_j(state.hinges, springs.bend_stiffness_n_m, x);
}

template <class Real>
void add_particles(const SoftState<Real>& state, const Vec3d& gravity_m_s2, BodyMeasures& sums) {
  const double mean_kg = static_cast<double>(state.vertex_mass_kg);
  double speed_squared_max = 0.0;
  state.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      const Vec3d x = state.position_m(i);
      const Vec3d v = state.v[i].template cast<double>();
      const double mass_kg = mean_kg * share(i);
      sums.kinetic_j += 0.5 * mass_kg * v.squaredNorm();
      sums.gravity_j -= mass_kg * gravity_m_s2.dot(x);
      sums.momentum += mass_kg * v;
      sums.angular_momentum += mass_kg * x.cross(v);
      sums.centre_of_mass += share(i) * x;
      speed_squared_max = std::max(speed_squared_max, v.squaredNorm());
    }
  });
  sums.centre_of_mass /= static_cast<double>(state.x.size());
  sums.max_speed_m_s = std::sqrt(speed_squared_max);
}

}  // namespace

template <class Real>
double potential_j(const SoftState<Real>& state, std::span<const Vec3d> x, double outside_pressure_pa,
                   const Vec3d& gravity_m_s2) {
  Vec3d sum_m = Vec3d::Zero();
  state.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < x.size(); ++i) sum_m += share(i) * x[i];
  });
  double sum_j = elastic_j(state, x) - static_cast<double>(state.vertex_mass_kg) * gravity_m_s2.dot(sum_m);
  if (state.gas) {
    const double volume_m3 = body_volume_m3<double>(state.body, x);
    sum_j += gas_energy_j(*state.gas, *state.body.gas, volume_m3, outside_pressure_pa);
  }
  return sum_j;
}

template <class Real>
BodyMeasures measure(const SoftState<Real>& state, double outside_pressure_pa, const Vec3d& gravity_m_s2) {
  const Mesh& mesh = *state.body.mesh;
  BodyMeasures sums;
  add_particles(state, gravity_m_s2, sums);

  std::vector<Vec3d> x(state.x.size());
  std::transform(state.x.begin(), state.x.end(), x.begin(), [](const auto& p) { return p.template cast<double>(); });
  sums.elastic_j = elastic_j(state, x);
  for (const auto& [a, b, c] : mesh.faces) sums.area_m2 += 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
  if (mesh.closed) sums.volume_m3 = signed_volume_m3(x, mesh.faces);

  if (state.gas) {
    const Gas& gas = *state.body.gas;
    const double volume_m3 = body_volume_m3<Real>(state.body, state.x);
    sums.pressure_pa = gas_pressure_pa(*state.gas, gas, volume_m3) - outside_pressure_pa;
    sums.temperature_k = gas_temperature_k(*state.gas, gas, volume_m3);
    sums.moles = state.gas->moles;
    sums.gas_j = gas_energy_j(*state.gas, gas, volume_m3, outside_pressure_pa);
  }
  return sums;
}

template double potential_j(const SoftState<float>&, std::span<const Vec3d>, double, const Vec3d&);
template double potential_j(const SoftState<double>&, std::span<const Vec3d>, double, const Vec3d&);
template BodyMeasures measure(const SoftState<float>&, double, const Vec3d&);
template BodyMeasures measure(const SoftState<double>&, double, const Vec3d&);

}  // namespace pneuma::physics
