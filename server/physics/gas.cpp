#include "physics/gas.h"

#include <algorithm>
#include <cmath>

namespace pneuma::physics {

namespace {

double floored(const GasState& state, double volume_m3) {
  return std::max(volume_m3, gas_volume_floor * state.volume_ref_m3);
}

}  // namespace

GasState make_gas_state(const Gas& gas, double volume_m3) {
  return {gas.moles, gas.temperature_k, volume_m3};
}

double gas_temperature_k(const GasState& state, const Gas& gas, double volume_m3) {
  if (gas.law == GasLaw::isothermal) return state.temperature_ref_k;
  return state.temperature_ref_k *
         std::pow(state.volume_ref_m3 / floored(state, volume_m3), gas.heat_capacity_ratio - 1.0);
}

double gas_pressure_pa(const GasState& state, const Gas& gas, double volume_m3) {
  return state.moles * gas_constant_j_mol_k * gas_temperature_k(state, gas, volume_m3) / floored(state, volume_m3);
}

void flow_gas(GasState& state, const Gas& gas, double pressure_over_outside_pa, double outside_pa, double dt_s) {
  const double inside_pa = outside_pa + pressure_over_outside_pa;
  double leaked = gas.leak_mol_s_pa * pressure_over_outside_pa * dt_s;
  if (inside_pa > 0.0) {
    // At this volume and temperature the pressure goes with the moles: so many are too many, or lacking.
    const double to_balance = state.moles * pressure_over_outside_pa / inside_pa;
    leaked = std::clamp(leaked, std::min(to_balance, 0.0), std::max(to_balance, 0.0));
  }
  state.moles = std::max(state.moles + gas.flow_mol_s * dt_s - leaked, 0.0);
}

}  // namespace pneuma::physics
