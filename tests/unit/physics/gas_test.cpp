// Shows that the gas meets the ideal gas law, isothermal and adiabatic, flows as asked, and stays bounded where its
// volume vanishes.
#include "physics/gas.h"

#include <cmath>

#include <gtest/gtest.h>

#include "physics/soft_setup.h"

namespace pneuma::physics {
namespace {

constexpr double volume_m3 = 2.0;

TEST(Gas, IsothermalPressureTimesVolumeIsConstant) {
  const Gas gas{.moles = 0.5, .temperature_k = 300.0};
  const GasState state = make_gas_state(gas, volume_m3);
  const double nrt = 0.5 * gas_constant_j_mol_k * 300.0;
  for (const double v : {0.1, 1.0, 2.0, 50.0}) {
    EXPECT_NEAR(gas_pressure_pa(state, gas, v) * v, nrt, 1e-12 * nrt);
    EXPECT_EQ(gas_temperature_k(state, gas, v), 300.0);
  }
}

TEST(Gas, AdiabaticPressureTimesVolumeToTheRatioIsConstant) {
  const Gas gas{.moles = 0.5, .temperature_k = 300.0, .law = GasLaw::adiabatic, .heat_capacity_ratio = 5.0 / 3.0};
  const GasState state = make_gas_state(gas, volume_m3);
  const double at_start = gas_pressure_pa(state, gas, volume_m3) * std::pow(volume_m3, gas.heat_capacity_ratio);
  for (const double v : {0.1, 1.0, 2.0, 50.0}) {
    const double pressure_pa = gas_pressure_pa(state, gas, v);
    EXPECT_NEAR(pressure_pa * std::pow(v, gas.heat_capacity_ratio), at_start, 1e-12 * at_start);
    EXPECT_NEAR(pressure_pa * v, state.moles * gas_constant_j_mol_k * gas_temperature_k(state, gas, v), 1e-9);
  }
}

TEST(Gas, PressesOutwardsAndBoundedWhereTheVolumeVanishesOrTurnsOver) {
  for (const GasLaw law : {GasLaw::isothermal, GasLaw::adiabatic}) {
    const Gas gas{.moles = 0.5, .law = law};
    const GasState state = make_gas_state(gas, volume_m3);
    const double at_floor = gas_pressure_pa(state, gas, gas_volume_floor * volume_m3);
    for (const double v : {0.0, -1.0, -1e9, 1e-300}) {
      EXPECT_EQ(gas_pressure_pa(state, gas, v), at_floor);
      EXPECT_GT(at_floor, 0.0);
      EXPECT_TRUE(std::isfinite(at_floor));
    }
  }
}

TEST(Gas, FlowAddsMolesAndNeverLeavesFewerThanNone) {
  const Gas pump{.moles = 1.0, .flow_mol_s = 0.25};
  GasState state = make_gas_state(pump, volume_m3);
  for (int i = 0; i < 100; ++i) flow_gas(state, pump, 0.0, 0.0, 0.01);
  EXPECT_NEAR(state.moles, 1.25, 1e-12);

  const Gas drain{.moles = 0.1, .flow_mol_s = -1.0};
  state = make_gas_state(drain, volume_m3);
  for (int i = 0; i < 100; ++i) flow_gas(state, drain, 0.0, 0.0, 0.01);
  EXPECT_EQ(state.moles, 0.0);
}

TEST(Gas, LeakFollowsThePressureDifferenceBothWays) {
  const Gas gas{.moles = 1.0, .leak_mol_s_pa = 1e-6};
  GasState state = make_gas_state(gas, volume_m3);
  flow_gas(state, gas, 100.0, 1e5, 0.5);
  EXPECT_NEAR(state.moles, 0.99995, 1e-15);
  flow_gas(state, gas, -100.0, 1e5, 0.5);
  EXPECT_NEAR(state.moles, 1.0, 1e-15);
}

TEST(Gas, LeakStopsAtTheBalanceHoweverLargeItIs) {
  const Gas gas{.moles = 3.0, .leak_mol_s_pa = 1e6};
  GasState state = make_gas_state(gas, volume_m3);
  flow_gas(state, gas, 2e5, 1e5, 1.0);  // three times the outside pressure inside
  EXPECT_NEAR(state.moles, 1.0, 1e-12);
  state = make_gas_state(gas, volume_m3);
  flow_gas(state, gas, -0.5e5, 1e5, 1.0);  // half of it inside
  EXPECT_NEAR(state.moles, 6.0, 1e-12);
}

// Simpson's rule over the volume.
double work_j(const GasState& state, const Gas& gas, double from_m3, double to_m3) {
  const int panels = 1000;
  const double step_m3 = (to_m3 - from_m3) / panels;
  double sum = 0.0;
  for (int i = 0; i < panels; ++i) {
    const double left = from_m3 + i * step_m3;
    sum += gas_pressure_pa(state, gas, left) + 4.0 * gas_pressure_pa(state, gas, left + 0.5 * step_m3) +
           gas_pressure_pa(state, gas, left + step_m3);
  }
  return sum * step_m3 / 6.0;
}

TEST(Gas, DoesTheWorkOfTheClosedForms) {
  const double from_m3 = 1.5;
  const double to_m3 = 4.0;
  const Gas isothermal{.moles = 0.5, .temperature_k = 300.0};
  const double nrt_j = 0.5 * gas_constant_j_mol_k * 300.0;
  EXPECT_NEAR(work_j(make_gas_state(isothermal, volume_m3), isothermal, from_m3, to_m3),
              nrt_j * std::log(to_m3 / from_m3), 1e-9 * nrt_j);

  const Gas adiabatic{.moles = 0.5, .temperature_k = 300.0, .law = GasLaw::adiabatic, .heat_capacity_ratio = 1.4};
  const GasState state = make_gas_state(adiabatic, volume_m3);
  const double before_j = gas_pressure_pa(state, adiabatic, from_m3) * from_m3;
  const double after_j = gas_pressure_pa(state, adiabatic, to_m3) * to_m3;
  EXPECT_NEAR(work_j(state, adiabatic, from_m3, to_m3), (before_j - after_j) / 0.4, 1e-9 * nrt_j);
}

TEST(Gas, LeaksUntilThePressuresAreInBalanceFromBothSides) {
  const double outside_pa = 1000.0;
  for (const double start_moles : {0.2, 5.0}) {
    const Gas gas{.moles = start_moles, .leak_mol_s_pa = 1e-3};
    GasState state = make_gas_state(gas, volume_m3);
    for (int i = 0; i < 2000; ++i) {
      flow_gas(state, gas, gas_pressure_pa(state, gas, volume_m3) - outside_pa, outside_pa, 0.01);
    }
    EXPECT_NEAR(gas_pressure_pa(state, gas, volume_m3), outside_pa, 1e-6);
    EXPECT_NEAR(state.moles, outside_pa * volume_m3 / (gas_constant_j_mol_k * gas.temperature_k), 1e-9);
  }
}

SoftState<double> ball_with(const Gas& gas) {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  body.gas = gas;
  return make_soft_state<double>(body);
}

TEST(Gas, BurstsPastItsPressureAndIsGone) {
  SoftState<double> body = ball_with({.moles = 1.0, .burst_pressure_pa = 500.0});
  body.pressure_pa = 500.0;
  advance_gas(body, 0.0, 0.01);
  EXPECT_TRUE(body.gas.has_value());
  EXPECT_FALSE(body.gas_event.has_value());
  body.pressure_pa = 500.1;
  advance_gas(body, 0.0, 0.01);
  ASSERT_TRUE(body.gas_event.has_value());
  EXPECT_EQ(body.gas_event->kind, GasEvent::Kind::burst);
  EXPECT_EQ(body.gas_event->pressure_pa, 500.1);
  EXPECT_FALSE(body.gas.has_value());
  EXPECT_FALSE(live_body(body).gas.has_value());
  EXPECT_EQ(body.pressure_pa, 0.0);
}

TEST(Gas, TellsOfALostVolumeOnceUntilItIsBack) {
  SoftState<double> body = ball_with({.moles = 1.0});
  int told = 0;
  for (const double volume : {1.0, 0.0, -1.0, -2.0, 0.5, -0.5}) {
    body.volume_m3 = volume;
    body.gas_event.reset();
    advance_gas(body, 0.0, 0.01);
    if (body.gas_event) {
      EXPECT_EQ(body.gas_event->kind, GasEvent::Kind::inverted);
      ++told;
    }
  }
  EXPECT_EQ(told, 2);
}

}  // namespace
}  // namespace pneuma::physics
