#include "physics/forces/gas.h"

#include <algorithm>
#include <cmath>

#include "base/limits.h"
#include "physics/machine/portable_math.h"

namespace pneuma::physics {

GasState make_gas_state(const Gas& gas, double volume_m3) {
  return {gas.moles, gas.temperature_k, volume_m3};
}

GasState make_gas_state(const Gas& gas, double volume_m3, double rest_volume_m3) {
  GasState state = make_gas_state(gas, rest_volume_m3);
  if (gas.law == GasLaw::adiabatic) {
    state.temperature_ref_k *=
        portable_pow(floored_volume_m3(state, volume_m3) / rest_volume_m3, gas.heat_capacity_ratio - 1.0);
  }
  return state;
}

double gas_temperature_k(const GasState& state, const Gas& gas, double volume_m3) {
  if (gas.law == GasLaw::isothermal) return state.temperature_ref_k;
  return state.temperature_ref_k *
         portable_pow(state.volume_ref_m3 / floored_volume_m3(state, volume_m3), gas.heat_capacity_ratio - 1.0);
}

double gas_stiffness_pa_m3(const GasState& state, const Gas& gas, double volume_m3) {
  if (volume_m3 <= gas_volume_floor * state.volume_ref_m3) return 0.0;
  const double exponent = gas.law == GasLaw::adiabatic ? gas.heat_capacity_ratio : 1.0;
  return exponent * gas_pressure_pa(state, gas, volume_m3) / volume_m3;
}

void flow_gas(GasState& state, const Gas& gas, double volume_m3, double pressure_over_outside_pa, double outside_pa,
              double dt_s) {
  if (!flows(gas)) return;
  double leaked = gas.leak_mol_s_pa * pressure_over_outside_pa * dt_s;
  if (leaked != 0.0) {
    const double molar_energy_j_mol = gas_constant_j_mol_k * gas_temperature_k(state, gas, volume_m3);
    // So many are too many, or lacking.
    const double to_balance = state.moles - outside_pa * floored_volume_m3(state, volume_m3) / molar_energy_j_mol;
    leaked = std::clamp(leaked, std::min(to_balance, 0.0), std::max(to_balance, 0.0));
  }
  state.moles = std::clamp(state.moles + gas.flow_mol_s * dt_s - leaked, 0.0, base::scene_number_max);
}

template <class Real>
void advance_gas(SoftState<Real>& body, double outside_pa, double dt_s) {
  if (!body.gas) return;
  if (bursts(body)) {
    body.gas_event = GasEvent{GasEvent::Kind::burst, body.pressure_pa, body.volume_m3};
    lose_gas(body);
    return;
  }
  if (inverts(body)) {
    body.gas_event = GasEvent{GasEvent::Kind::inverted, body.pressure_pa, body.volume_m3};
    body.inverted = true;
  }
  flow_gas(*body.gas, *body.body.gas, body.volume_m3, body.pressure_pa, outside_pa, dt_s);
}

template <class Real>
void note_recovery(SoftState<Real>& body) {
  if (body.gas && body.volume_m3 > gas_recovered_share * body.gas->volume_ref_m3) body.inverted = false;
}

template <class Real>
void lose_gas(SoftState<Real>& body) {
  body.gas.reset();
  body.body.gas.reset();
  body.pressure_pa = 0.0;
  body.inverted = false;
}

template void advance_gas<float>(SoftState<float>&, double, double);
template void advance_gas<double>(SoftState<double>&, double, double);
template void note_recovery<float>(SoftState<float>&);
template void note_recovery<double>(SoftState<double>&);
template void lose_gas<float>(SoftState<float>&);
template void lose_gas<double>(SoftState<double>&);

}  // namespace pneuma::physics
