// Shows that the gas meets the ideal gas law, isothermal and adiabatic, flows as asked, and stays bounded where its
// volume vanishes.
#include "physics/forces/gas.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "physics/forces/soft_setup.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

constexpr double gas_volume_m3 = 2.0;

TEST(Gas, IsothermalPressureTimesVolumeIsConstant) {
  const Gas gas{.moles = 0.5, .temperature_k = 300.0};
  const GasState state = make_gas_state(gas, gas_volume_m3);
  const double nrt = 0.5 * gas_constant_j_mol_k * 300.0;
  for (const double v : {0.1, 1.0, 2.0, 50.0}) {
    EXPECT_NEAR(gas_pressure_pa(state, gas, v) * v, nrt, 1e-12 * nrt);
    EXPECT_EQ(gas_temperature_k(state, gas, v), 300.0);
  }
}

TEST(Gas, AdiabaticPressureTimesVolumeToTheRatioIsConstant) {
  const Gas gas{.moles = 0.5, .temperature_k = 300.0, .law = GasLaw::adiabatic, .heat_capacity_ratio = 5.0 / 3.0};
  const GasState state = make_gas_state(gas, gas_volume_m3);
  const double at_start = gas_pressure_pa(state, gas, gas_volume_m3) * std::pow(gas_volume_m3, gas.heat_capacity_ratio);
  for (const double v : {0.1, 1.0, 2.0, 50.0}) {
    const double pressure_pa = gas_pressure_pa(state, gas, v);
    EXPECT_NEAR(pressure_pa * std::pow(v, gas.heat_capacity_ratio), at_start, 1e-12 * at_start);
    EXPECT_NEAR(pressure_pa * v, state.moles * gas_constant_j_mol_k * gas_temperature_k(state, gas, v), 1e-9);
  }
}

TEST(Gas, PressesOutwardsAndBoundedWhereTheVolumeVanishesOrTurnsOver) {
  for (const GasLaw law : {GasLaw::isothermal, GasLaw::adiabatic}) {
    const Gas gas{.moles = 0.5, .law = law};
    const GasState state = make_gas_state(gas, gas_volume_m3);
    const double at_floor = gas_pressure_pa(state, gas, gas_volume_floor * gas_volume_m3);
    for (const double v : {0.0, -1.0, -1e9, 1e-300}) {
      EXPECT_EQ(gas_pressure_pa(state, gas, v), at_floor);
      EXPECT_GT(at_floor, 0.0);
      EXPECT_TRUE(std::isfinite(at_floor));
    }
  }
}

TEST(Gas, FlowAddsMolesAndNeverLeavesFewerThanNone) {
  const Gas pump{.moles = 1.0, .flow_mol_s = 0.25};
  GasState state = make_gas_state(pump, gas_volume_m3);
  for (int i = 0; i < 100; ++i) flow_gas(state, pump, gas_volume_m3, 0.0, 0.0, 0.01);
  EXPECT_NEAR(state.moles, 1.25, 1e-12);

  const Gas drain{.moles = 0.1, .flow_mol_s = -1.0};
  state = make_gas_state(drain, gas_volume_m3);
  for (int i = 0; i < 100; ++i) flow_gas(state, drain, gas_volume_m3, 0.0, 0.0, 0.01);
  EXPECT_EQ(state.moles, 0.0);
}

TEST(Gas, FlowStopsAtWhatASceneMayHave) {
  const Gas pump{.moles = 1.0, .flow_mol_s = base::scene_number_max};
  GasState state = make_gas_state(pump, gas_volume_m3);
  for (int i = 0; i < 3; ++i) flow_gas(state, pump, gas_volume_m3, 0.0, 0.0, 0.7);
  EXPECT_EQ(state.moles, base::scene_number_max);
}

TEST(Gas, LeakFollowsThePressureDifferenceBothWays) {
  const Gas gas{.moles = 1.0, .leak_mol_s_pa = 1e-6};
  GasState state = make_gas_state(gas, gas_volume_m3);
  const double inside_pa = gas_pressure_pa(state, gas, gas_volume_m3);
  flow_gas(state, gas, gas_volume_m3, 100.0, inside_pa - 100.0, 0.5);
  EXPECT_NEAR(state.moles, 0.99995, 1e-15);
  flow_gas(state, gas, gas_volume_m3, -100.0, inside_pa + 100.0, 0.5);
  EXPECT_NEAR(state.moles, 1.0, 1e-15);
}

TEST(Gas, LeakStopsAtTheBalanceHoweverLargeItIs) {
  const Gas gas{.moles = 3.0, .leak_mol_s_pa = 1e6};
  GasState state = make_gas_state(gas, gas_volume_m3);
  const double inside_pa = gas_pressure_pa(state, gas, gas_volume_m3);
  flow_gas(state, gas, gas_volume_m3, inside_pa / 1.5, inside_pa / 3.0, 1.0);
  EXPECT_NEAR(state.moles, 1.0, 1e-12);
  state = make_gas_state(gas, gas_volume_m3);
  flow_gas(state, gas, gas_volume_m3, -inside_pa, 2.0 * inside_pa, 1.0);
  EXPECT_NEAR(state.moles, 6.0, 1e-12);
}

TEST(Gas, LeaksIntoAnEmptySkinNoFurtherThanTheBalance) {
  const Gas gas{.moles = 0.0, .leak_mol_s_pa = 1e6};
  GasState state = make_gas_state(gas, gas_volume_m3);
  flow_gas(state, gas, gas_volume_m3, -1e5, 1e5, 1.0);
  EXPECT_NEAR(gas_pressure_pa(state, gas, gas_volume_m3), 1e5, 1e-6);
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
  EXPECT_NEAR(work_j(make_gas_state(isothermal, gas_volume_m3), isothermal, from_m3, to_m3),
              nrt_j * std::log(to_m3 / from_m3), 1e-9 * nrt_j);

  const Gas adiabatic{.moles = 0.5, .temperature_k = 300.0, .law = GasLaw::adiabatic, .heat_capacity_ratio = 1.4};
  const GasState state = make_gas_state(adiabatic, gas_volume_m3);
  const double before_j = gas_pressure_pa(state, adiabatic, from_m3) * from_m3;
  const double after_j = gas_pressure_pa(state, adiabatic, to_m3) * to_m3;
  EXPECT_NEAR(work_j(state, adiabatic, from_m3, to_m3), (before_j - after_j) / 0.4, 1e-9 * nrt_j);
}

TEST(Gas, LeaksUntilThePressuresAreInBalanceFromBothSides) {
  const double outside_pa = 1000.0;
  for (const double start_moles : {0.2, 5.0}) {
    const Gas gas{.moles = start_moles, .leak_mol_s_pa = 1e-3};
    GasState state = make_gas_state(gas, gas_volume_m3);
    for (int i = 0; i < 2000; ++i) {
      flow_gas(state, gas, gas_volume_m3, gas_pressure_pa(state, gas, gas_volume_m3) - outside_pa, outside_pa, 0.01);
    }
    EXPECT_NEAR(gas_pressure_pa(state, gas, gas_volume_m3), outside_pa, 1e-6);
    EXPECT_NEAR(state.moles, outside_pa * gas_volume_m3 / (gas_constant_j_mol_k * gas.temperature_k), 1e-9);
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

/// How often a body tells that it is inverted, whose volume takes these shares of the one at the start.
int inversions_told(const std::vector<double>& shares, bool tick_ends_each_time) {
  SoftState<double> body = ball_with({.moles = 1.0});
  const double start_m3 = body.volume_m3;
  int told = 0;
  for (const double share : shares) {
    body.volume_m3 = share * start_m3;
    body.gas_event.reset();
    EXPECT_EQ(inverts(body), share <= 0.0 && !body.inverted);
    advance_gas(body, 0.0, 0.01);
    if (body.gas_event) {
      EXPECT_EQ(body.gas_event->kind, GasEvent::Kind::inverted);
      ++told;
    }
    if (tick_ends_each_time) note_recovery(body);
  }
  return told;
}

TEST(Gas, TellsOfALostVolumeOnceUntilItIsBack) {
  EXPECT_EQ(inversions_told({1.0, 0.0, -0.3, -0.6, 0.2, -0.2}, true), 2);
  EXPECT_EQ(inversions_told({1.0, 0.0, 0.009, -0.001, 0.009, -0.001}, true), 1) << "noise about 0";
}

TEST(Gas, TellsOfALostVolumeOnceATick) {
  EXPECT_EQ(inversions_told({1.0, -1.0, 1.0, -1.0, 1.0, -1.0}, false), 1);
}

/// The ball drawn to another size, or inside out, as live state.
SoftState<double> ball_scaled(const Gas& gas, double scale) {
  SoftState<double> body = ball_with(gas);
  for (Vec3<double>& x : body.x) x *= scale;
  body.volume_m3 *= scale * scale * scale;
  return body;
}

TEST(Gas, GivenToASkinThatIsFlatOrInsideOutPressesOutwardsAsAtTheFloor) {
  for (const GasLaw law : {GasLaw::isothermal, GasLaw::adiabatic}) {
    const Gas gas{.moles = 1.0, .temperature_k = 300.0, .law = law};
    for (const double scale : {0.0, -1.0, 1e-3}) {
      SoftState<double> body = ball_scaled(gas, scale);
      const double floor_m3 = gas_volume_floor * ball_with(gas).volume_m3;
      const double expected_pa = gas.moles * gas_constant_j_mol_k * 300.0 / floor_m3;
      SoftBody with_gas = body.body;
      lose_gas(body);
      change_soft_state(body, with_gas);
      EXPECT_NEAR(gas_pressure_pa(*body.gas, gas, body.volume_m3), expected_pa, 1e-9 * expected_pa);

      with_gas.gas->temperature_k = 600.0;
      change_soft_state(body, with_gas);
      EXPECT_NEAR(gas_pressure_pa(*body.gas, *with_gas.gas, body.volume_m3), 2.0 * expected_pa, 1e-9 * expected_pa);
      EXPECT_GT(body.gas->volume_ref_m3, 0.0);
    }
  }
}

TEST(Gas, GoesOnAtItsTemperatureUnderAnotherLawRatioOrMeasureOfVolume) {
  const Gas gas{.moles = 1.0, .temperature_k = 300.0, .law = GasLaw::adiabatic, .heat_capacity_ratio = 1.4};
  const auto temperature_after = [&](const auto& edit) {
    SoftState<double> body = ball_scaled(gas, 0.5);
    SoftBody edited = live_body(body);
    EXPECT_NEAR(edited.gas->temperature_k, 300.0 * std::pow(8.0, 0.4), 1e-9);
    edit(edited);
    change_soft_state(body, edited);
    return gas_temperature_k(*body.gas, *edited.gas, body.volume_m3);
  };
  const double live_k = 300.0 * std::pow(8.0, 0.4);
  EXPECT_NEAR(temperature_after([](SoftBody& body) { body.gas->heat_capacity_ratio = 5.0 / 3.0; }), live_k, 1e-9);
  EXPECT_NEAR(temperature_after([](SoftBody& body) { body.gas->law = GasLaw::isothermal; }), live_k, 1e-9);
  EXPECT_NEAR(temperature_after([](SoftBody& body) { body.volume.method = VolumeMethod::box; }), live_k, 1e-9);
  const Volume coarse{VolumeMethod::subdivided, 3};
  EXPECT_NEAR(temperature_after([&](SoftBody& body) { body.volume = coarse; }), live_k, 1e-9);
  EXPECT_NEAR(temperature_after([](SoftBody& body) { body.gas->moles = 2.0; }), live_k, 1e-9);
}

}  // namespace
}  // namespace pneuma::physics
