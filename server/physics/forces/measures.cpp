#include "physics/forces/measures.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "physics/forces/force_terms.h"
#include "physics/forces/gas.h"
#include "physics/forces/volume.h"

namespace pneuma::physics {
namespace {

template <class Real>
void add_particles(const SoftState<Real>& state, BodyMeasures& sums) {
  const double mean_kg = static_cast<double>(state.vertex_mass_kg);
  double speed_squared_max = 0.0;
  state.with_mass_shares([&](auto share) {
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      const Vec3d x = state.position_m(i);
      const Vec3d v = state.v[i].template cast<double>();
      const double mass_kg = mean_kg * share(i);
      sums.kinetic_j += 0.5 * mass_kg * v.squaredNorm();
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
double potential_j(const SoftState<Real>& state, const EnergyPlace& at, const Surroundings& surroundings) {
  double sum_j = 0.0;
  ForceTerms::for_each([&]<class Term>() {
    if constexpr (!term_parts::NoPotential<Term>) sum_j += Term::potential_j(state, at, surroundings);
  });
  return sum_j;
}

template <class Real>
BodyMeasures measure(const SoftState<Real>& state, double outside_pressure_pa, const Vec3d& gravity_m_s2) {
  const Mesh& mesh = *state.body.mesh;
  BodyMeasures sums;
  add_particles(state, sums);

  std::vector<Vec3d> x(state.x.size());
  std::transform(state.x.begin(), state.x.end(), x.begin(), [](const auto& p) { return p.template cast<double>(); });
  for (const auto& [a, b, c] : mesh.faces) sums.area_m2 += 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
  if (mesh.closed) sums.volume_m3 = signed_volume_m3(x, mesh.faces);

  EnergyPlace at{.x = x, .origin_m = state.origin_m};
  if (state.gas) {
    const Gas& gas = *state.body.gas;
    at.volume_m3 = body_volume_m3<Real>(state.body, state.x);
    sums.pressure_pa = gas_pressure_pa(*state.gas, gas, *at.volume_m3) - outside_pressure_pa;
    sums.temperature_k = gas_temperature_k(*state.gas, gas, *at.volume_m3);
    sums.moles = state.gas->moles;
  }
  const Surroundings surroundings{gravity_m_s2, {.pressure_pa = outside_pressure_pa}};
  ForceTerms::for_each([&]<class Term>() {
    if constexpr (!term_parts::NoPotential<Term>) sums.*Term::measure += Term::potential_j(state, at, surroundings);
  });
  return sums;
}

template double potential_j(const SoftState<float>&, const EnergyPlace&, const Surroundings&);
template double potential_j(const SoftState<double>&, const EnergyPlace&, const Surroundings&);
template BodyMeasures measure(const SoftState<float>&, double, const Vec3d&);
template BodyMeasures measure(const SoftState<double>&, double, const Vec3d&);

}  // namespace pneuma::physics
