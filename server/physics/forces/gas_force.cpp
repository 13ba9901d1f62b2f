#include "physics/forces/gas_force.h"

#include <algorithm>
#include <cmath>

#include "physics/forces/volume.h"

namespace pneuma::physics {
namespace {

// Of the body's length: the furthest that its gas may push a particle in one pass of XPBD.
constexpr double gas_move_max = 0.25;
constexpr int root_iterations_max = 60;

template <class Real>
void add_pressure_on_faces(const Mesh& mesh, double pressure_pa, std::span<const Vec3<Real>> x,
                           std::span<Vec3<Real>> force) {
  const auto sixth =
      static_cast<Real>(pressure_pa / 6.0);  // half the cross product is the area, a third goes to each particle
  for (const Face& face : mesh.faces) {
    const Vec3<Real> share = sixth * (x[face[1]] - x[face[0]]).cross(x[face[2]] - x[face[0]]);
    force[face[0]] += share;
    force[face[1]] += share;
    force[face[2]] += share;
  }
}

// Footnote 3: a particle is pushed along its own normal, the mean of its faces' normals (their sum divided by their
// number). We read the size of the push as a third of the area around it, which keeps it near the spread by faces.
template <class Real>
void add_pressure_on_normals(const Mesh& mesh, double pressure_pa, std::span<const Vec3<Real>> x,
                             NormalSpread<Real>& spread, std::span<Vec3<Real>> force) {
  spread.normal_sums.assign(x.size(), Vec3<Real>::Zero());
  spread.areas_m2.assign(x.size(), Real{0});
  for (const Face& face : mesh.faces) {
    const Vec3<Real> cross = (x[face[1]] - x[face[0]]).cross(x[face[2]] - x[face[0]]);
    const Real twice_area = cross.norm();
    if (!(twice_area > 0)) continue;
    for (const std::uint32_t vertex : face) {
      spread.normal_sums[vertex] += cross / twice_area;
      spread.areas_m2[vertex] += twice_area / 6;
    }
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Real faces = static_cast<Real>(mesh.face_counts[i]);
    force[i] += static_cast<Real>(pressure_pa) * spread.areas_m2[i] * (spread.normal_sums[i] / faces);
  }
}

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

// The root of h^2 P(V + give x) - x. P falls with the volume, so that it lies between 0 and the first term at x = 0:
// Newton's steps, halving where one leaves the bracket.
double gas_multiplier(const GasState& state, const Gas& gas, double outside_pa, double h2, double volume_m3,
                      double give) {
  const auto pressure_pa = [&](double at_m3) { return gas_pressure_pa(state, gas, at_m3) - outside_pa; };
  const double at_once = h2 * pressure_pa(volume_m3);
  double low = std::min(0.0, at_once);
  double high = std::max(0.0, at_once);
  double x = low + 0.5 * (high - low);
  for (int i = 0; i < root_iterations_max && high - low > 1e-15 * (high + std::abs(low)); ++i) {
    const double volume = volume_m3 + give * x;
    const double excess = h2 * pressure_pa(volume) - x;
    if (excess == 0.0) break;
    (excess > 0.0 ? low : high) = x;
    const double slope = 1.0 + h2 * give * gas_stiffness_pa_m3(state, gas, volume);
    const double next = x + excess / slope;
    if (std::abs(next - x) <= 1e-14 * std::abs(x)) break;
    x = next > low && next < high ? next : low + 0.5 * (high - low);
  }
  return x;
}

}  // namespace

template <class Real>
void add_pressure(SoftState<Real>& body, double pressure_pa, std::span<const Vec3<Real>> x,
                  std::span<Vec3<Real>> force) {
  if (body.body.pressure_spread == PressureSpread::faces) {
    add_pressure_on_faces<Real>(*body.body.mesh, pressure_pa, x, force);
  } else {
    add_pressure_on_normals<Real>(*body.body.mesh, pressure_pa, x, body.spread, force);
  }
}

template <class Real>
void GasForce::add(SoftState<Real>& body, const ForcePlace<Real>& at, std::span<Vec3<Real>> force) {
  {  // 2: volume
    const StageTimer timer(at.profile, Stage::volume);
    body.volume_m3 = body_volume_m3<Real>(body.body, at.x);
  }
  // 3: pressure
  const StageTimer timer(at.profile, Stage::pressure);
  update_pressure(body, at.surroundings.atmosphere.pressure_pa);
  add_pressure<Real>(body, body.pressure_pa, at.x, force);
}

template <class Real>
double GasForce::potential_j(const SoftState<Real>& body, const EnergyPlace& at, const Surroundings& surroundings) {
  if (!body.gas) return 0.0;
  const double volume_m3 = at.volume_m3 ? *at.volume_m3 : body_volume_m3<double>(body.body, at.x);
  return gas_energy_j(*body.gas, *body.body.gas, volume_m3, surroundings.atmosphere.pressure_pa);
}

template <class Real>
void GasForce::linearise(const SoftState<Real>& body, const TangentPlace& at, Tangents& tangents) {
  const double turn = body.gas ? at.s * at.s * body.pressure_pa : 0.0;
  if (turn == 0.0) return;
  for (std::size_t e = 0; e < tangents.edges.size(); ++e) {
    const auto& [from, to] = at.opposite[e];
    Eigen::Map<Vec3d>(tangents.edges[e].turn) = turn / 6.0 * (at.x[from] - at.x[to]);
  }
}

template <class Real>
void GasForce::Xpbd<Real>::pass_between(const XpbdPlace<Real>& place) {
  SoftState<Real>& body = place.body;
  if (!body.gas) return;
  const StageTimer timer(place.profile, Stage::pressure);
  const std::size_t count = body.x.size();
  position.resize(count);
  for (std::size_t i = 0; i < count; ++i) position[i] = body.x[i] + body.dr[i];
  gradient.assign(count, Vec3<Real>::Zero());
  add_pressure<Real>(body, 1.0, position, gradient);
  double give = 0.0;  // volume a multiplier
  double longest = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto weight = static_cast<double>(place.inverse_masses_1_kg[i]);
    const auto squared = static_cast<double>(gradient[i].squaredNorm());
    give += weight * squared;
    longest = std::max(longest, weight * weight * squared);
  }
  const double outside_pa = place.surroundings.atmosphere.pressure_pa;
  const double volume_m3 = body_volume_m3<Real>(body.body, position);
  double multiplier = gas_multiplier(*body.gas, *body.body.gas, outside_pa, place.h_s * place.h_s, volume_m3, give);
  const double move_m = std::abs(multiplier) * std::sqrt(longest);
  const double move_max_m = gas_move_max * static_cast<double>(body.length_m);
  if (move_m > move_max_m) multiplier *= move_max_m / move_m;
  for (std::size_t i = 0; i < count; ++i) {
    body.dr[i] += static_cast<Real>(multiplier) * place.inverse_masses_1_kg[i] * gradient[i];
  }
  body.volume_m3 = volume_m3 + give * multiplier;
  update_pressure(body, outside_pa);
}

template struct GasForce::Xpbd<float>;
template struct GasForce::Xpbd<double>;
#define PNEUMA_INSTANTIATE(Real)                                                                                  \
  template void add_pressure<Real>(SoftState<Real>&, double, std::span<const Vec3<Real>>, std::span<Vec3<Real>>); \
  template void GasForce::add(SoftState<Real>&, const ForcePlace<Real>&, std::span<Vec3<Real>>);                  \
  template double GasForce::potential_j(const SoftState<Real>&, const EnergyPlace&, const Surroundings&);         \
  template void GasForce::linearise(const SoftState<Real>&, const TangentPlace&, Tangents&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
