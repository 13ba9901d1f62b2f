// The ideal gas inside a body (the paper's equations 4 and 5), isothermal or adiabatic.
#pragma once

#include <algorithm>

#include "physics/state/state.h"

namespace pneuma::physics {

/// Below this share of its volume in the mesh's shape, a gas presses as it would there: a body squeezed flat or turned
/// inside out is pushed back out, by a force that stays bounded.
inline constexpr double gas_volume_floor = 1e-3;

/// A volume that was lost is back where it is past this share of the mesh's: well clear of the noise about 0.
inline constexpr double gas_recovered_share = 0.01;

/// Gas at rest in `volume_m3`, as the scene asks for it.
[[nodiscard]] GasState make_gas_state(const Gas& gas, double volume_m3);
/// Gas that has the scene's temperature in `volume_m3`, which may be 0 or less, of a body with `rest_volume_m3` > 0.
[[nodiscard]] GasState make_gas_state(const Gas& gas, double volume_m3, double rest_volume_m3);

[[nodiscard]] double gas_temperature_k(const GasState& state, const Gas& gas, double volume_m3);

/// The volume that the gas presses as if it had: not below the floor.
[[nodiscard]] inline double floored_volume_m3(const GasState& state, double volume_m3) {
  return std::max(volume_m3, gas_volume_floor * state.volume_ref_m3);
}

/// Absolute pressure P = n R T / V.
[[nodiscard]] inline double gas_pressure_pa(const GasState& state, const Gas& gas, double volume_m3) {
  const double temperature_k =
      gas.law == GasLaw::isothermal ? state.temperature_ref_k : gas_temperature_k(state, gas, volume_m3);
  return state.moles * gas_constant_j_mol_k * temperature_k / floored_volume_m3(state, volume_m3);
}

/// -dP/dV: P / V, and the heat capacity ratio times that where adiabatic; 0 below the floor.
[[nodiscard]] double gas_stiffness_pa_m3(const GasState& state, const Gas& gas, double volume_m3);

/// Pumps and leaks for dt_s: moles move by flow_mol_s, and by leak_mol_s_pa a pascal of `pressure_over_outside_pa`
/// outwards, but not past the balance with `outside_pa` in `volume_m3`. There are never fewer than none.
void flow_gas(GasState& state, const Gas& gas, double volume_m3, double pressure_over_outside_pa, double outside_pa,
              double dt_s);
/// Whether flow_gas does anything.
[[nodiscard]] inline bool flows(const Gas& gas) {
  return gas.flow_mol_s != 0.0 || gas.leak_mol_s_pa != 0.0;
}

/// The body goes on without: an open skin.
template <class Real>
void lose_gas(SoftState<Real>& body);

/// Whether the pressure is past the body's own limit. The body has gas, as in the next one.
template <class Real>
[[nodiscard]] bool bursts(const SoftState<Real>& body) {
  const std::optional<double>& limit_pa = body.body.gas->burst_pressure_pa;
  return limit_pa && body.pressure_pa > *limit_pa;
}
/// Whether a volume is lost that was not before.
template <class Real>
[[nodiscard]] bool inverts(const SoftState<Real>& body) {
  return body.volume_m3 <= 0.0 && !body.inverted;
}

/// Between two substeps: flows, bursts where the pressure over the outside is past the body's own limit (the gas is
/// gone then, and the body an open skin), and notes a volume of 0 or below, once until note_recovery has seen it back.
template <class Real>
void advance_gas(SoftState<Real>& body, double outside_pa, double dt_s);

/// Sets the pressure over the outside from the volume. The body has gas.
template <class Real>
void update_pressure(SoftState<Real>& body, double outside_pa) {
  body.pressure_pa = gas_pressure_pa(*body.gas, *body.body.gas, body.volume_m3) - outside_pa;
}

/// Between two ticks, so that a body is told of as inverted at most once in each.
template <class Real>
void note_recovery(SoftState<Real>& body);

}  // namespace pneuma::physics
