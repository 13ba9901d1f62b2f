#include "physics/forces/measures.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

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

template <class Real>
std::vector<Vec3d> points_m(const SoftState<Real>& state) {
  std::vector<Vec3d> x(state.x.size());
  std::transform(state.x.begin(), state.x.end(), x.begin(), [](const auto& p) { return p.template cast<double>(); });
  return x;
}

/// `gas_volume_m3` becomes the volume that the gas has, where there is one.
template <class Real>
BodyMeasures measure_motion(const SoftState<Real>& state, const std::vector<Vec3d>& x, double outside_pressure_pa,
                            std::optional<double>& gas_volume_m3) {
  BodyMeasures sums;
  add_particles(state, sums);
  if (state.body.mesh->closed) sums.volume_m3 = signed_volume_m3(x, state.body.mesh->faces);
  if (!state.gas) return sums;
  const Gas& gas = *state.body.gas;
  const bool is_measured = state.body.mesh->closed && state.body.volume.method == VolumeMethod::exact;
  gas_volume_m3 = is_measured ? sums.volume_m3 : body_volume_m3<Real>(state.body, state.x);
  sums.pressure_pa = gas_pressure_pa(*state.gas, gas, *gas_volume_m3) - outside_pressure_pa;
  sums.temperature_k = gas_temperature_k(*state.gas, gas, *gas_volume_m3);
  sums.moles = state.gas->moles;
  return sums;
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
BodyMeasures measure_motion(const SoftState<Real>& state, double outside_pressure_pa) {
  std::optional<double> gas_volume_m3;
  return measure_motion(state, points_m(state), outside_pressure_pa, gas_volume_m3);
}

template <class Real>
BodyMeasures measure(const SoftState<Real>& state, double outside_pressure_pa, const Vec3d& gravity_m_s2) {
  const std::vector<Vec3d> x = points_m(state);
  EnergyPlace at{.x = x, .origin_m = state.origin_m};
  BodyMeasures sums = measure_motion(state, x, outside_pressure_pa, at.volume_m3);
  for (const auto& [a, b, c] : state.body.mesh->faces) sums.area_m2 += 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
  const Surroundings surroundings{gravity_m_s2, {.pressure_pa = outside_pressure_pa}};
  ForceTerms::for_each([&]<class Term>() {
    if constexpr (!term_parts::NoPotential<Term>) sums.*Term::measure += Term::potential_j(state, at, surroundings);
  });
  return sums;
}

template double potential_j(const SoftState<float>&, const EnergyPlace&, const Surroundings&);
template double potential_j(const SoftState<double>&, const EnergyPlace&, const Surroundings&);
template BodyMeasures measure_motion(const SoftState<float>&, double);
template BodyMeasures measure_motion(const SoftState<double>&, double);
template BodyMeasures measure(const SoftState<float>&, double, const Vec3d&);
template BodyMeasures measure(const SoftState<double>&, double, const Vec3d&);

}  // namespace pneuma::physics
