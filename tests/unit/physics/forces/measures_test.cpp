// Shows that a body's sums meet closed forms (rigid motion, uniform scaling, gas work, free fall), and that the forces
// that the step applies are minus the gradient of the energies, by central differences.
#include "physics/forces/measures.h"

#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "physics/forces/soft_setup.h"
#include "physics/mesh/mesh_builders.h"
#include "unit/physics/body_tables.h"

namespace pneuma::physics {
namespace {

SoftBody gas_ball(double radius_m = 0.5) {
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(1, radius_m);
  body.mass_kg = 3.0;
  body.springs.stiffness_n_m = 200.0;
  return body;
}

SoftBody ball_of_gas(GasLaw law) {
  SoftBody body = gas_ball();
  body.gas = Gas{.moles = 0.02, .law = law};
  return body;
}

void scale(SoftState<double>& state, double factor) {
  for (Vec3d& x : state.x) x = state.body.position + factor * (x - state.body.position);
}

TEST(Measures, VerticesCountByTheirMass) {
  SoftBody body;
  body.mesh = *make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  body.vertex_mass_scale = {10.0, 20.0, 30.0};
  body.mass_kg = 6.0;
  SoftState<double> state = make_soft_state<double>(body);
  state.v = {{1, 0, 0}, {0, 2, 0}, {0, 0, -1}};
  const BodyMeasures sums = measure(state, 0.0, {0, -10, 0});
  EXPECT_TRUE(sums.centre_of_mass.isApprox(Vec3d(2.0, 3.0, 0.0) / 6.0, 1e-15));
  EXPECT_TRUE(sums.momentum.isApprox(Vec3d(1.0, 4.0, -3.0), 1e-15));
  EXPECT_TRUE(sums.angular_momentum.isApprox(Vec3d(-3.0, 0.0, 4.0), 1e-15));
  EXPECT_NEAR(sums.kinetic_j, 0.5 + 4.0 + 1.5, 1e-14);
  EXPECT_NEAR(sums.gravity_j, 30.0, 1e-13);
}

TEST(Measures, RigidMotionHasItsMomentaAndKineticEnergy) {
  SoftBody body = gas_ball();
  body.position = {1.0, 2.0, -3.0};
  body.velocity = {0.5, -1.5, 2.0};
  body.angular_velocity = {3.0, 1.0, -2.0};
  const BodyMeasures sums = measure(make_soft_state<double>(body), 0.0, Vec3d::Zero());

  // Equal masses on a sphere, spread as evenly as an icosahedron's: the same moment about every axis.
  const double inertia_kg_m2 = 2.0 / 3.0 * body.mass_kg * 0.25;
  const Vec3d momentum = body.mass_kg * body.velocity;
  const Vec3d angular_momentum = body.position.cross(momentum) + inertia_kg_m2 * body.angular_velocity;
  EXPECT_NEAR((sums.momentum - momentum).norm(), 0.0, 1e-13);
  EXPECT_NEAR((sums.angular_momentum - angular_momentum).norm(), 0.0, 1e-12);
  EXPECT_NEAR((sums.centre_of_mass - body.position).norm(), 0.0, 1e-14);
  EXPECT_NEAR(
      sums.kinetic_j,
      0.5 * body.mass_kg * body.velocity.squaredNorm() + 0.5 * inertia_kg_m2 * body.angular_velocity.squaredNorm(),
      1e-12);
  EXPECT_NEAR(sums.elastic_j, 0.0, 1e-20);
  EXPECT_LE(sums.max_speed_m_s, body.velocity.norm() + 0.5 * body.angular_velocity.norm());
}

TEST(Measures, UniformScalingHasItsElasticEnergyVolumeAndArea) {
  SoftState<double> state = make_soft_state<double>(gas_ball());
  const BodyMeasures before = measure(state, 0.0, Vec3d::Zero());
  const double factor = 1.3;
  scale(state, factor);
  const BodyMeasures after = measure(state, 0.0, Vec3d::Zero());
  double squares_m2 = 0.0;
  for (const double length_m : state.body.mesh->edge_lengths_m) squares_m2 += length_m * length_m;
  EXPECT_NEAR(after.elastic_j, 0.5 * 200.0 * 0.3 * 0.3 * squares_m2, 1e-11);
  EXPECT_NEAR(after.volume_m3, before.volume_m3 * factor * factor * factor, 1e-14);
  EXPECT_NEAR(after.area_m2, before.area_m2 * factor * factor, 1e-13);
}

TEST(Measures, RestScaleCountsInTheElasticEnergy) {
  SoftBody body = gas_ball();
  body.springs.rest_scale = 0.8;
  SoftState<double> state = make_soft_state<double>(body);
  EXPECT_GT(measure(state, 0.0, Vec3d::Zero()).elastic_j, 1.0);
  scale(state, 0.8);
  EXPECT_NEAR(measure(state, 0.0, Vec3d::Zero()).elastic_j, 0.0, 1e-20);
}

TEST(Measures, IsothermalWorkIsNRTLogOfTheVolumes) {
  SoftState<double> state = make_soft_state<double>(ball_of_gas(GasLaw::isothermal));
  const double outside_pa = 300.0;
  const BodyMeasures before = measure(state, outside_pa, Vec3d::Zero());
  scale(state, 1.2);
  const BodyMeasures after = measure(state, outside_pa, Vec3d::Zero());
  const double nrt_j = 0.02 * gas_constant_j_mol_k * 293.15;
  const double work_j = nrt_j * std::log(after.volume_m3 / before.volume_m3);
  EXPECT_NEAR(before.gas_j - after.gas_j, work_j - outside_pa * (after.volume_m3 - before.volume_m3), 1e-11);
  EXPECT_NEAR(after.pressure_pa, nrt_j / after.volume_m3 - outside_pa, 1e-10);
  EXPECT_EQ(after.temperature_k, 293.15);
  EXPECT_EQ(after.moles, 0.02);
}

TEST(Measures, AdiabaticWorkIsTheDifferenceOfPressureTimesVolume) {
  SoftState<double> state = make_soft_state<double>(ball_of_gas(GasLaw::adiabatic));
  const BodyMeasures before = measure(state, 0.0, Vec3d::Zero());
  scale(state, 0.9);
  const BodyMeasures after = measure(state, 0.0, Vec3d::Zero());
  const double work_j = (before.pressure_pa * before.volume_m3 - after.pressure_pa * after.volume_m3) / 0.4;
  EXPECT_NEAR(before.gas_j - after.gas_j, work_j, 1e-11);
  EXPECT_NEAR(after.temperature_k, 293.15 * std::pow(0.9, -3 * 0.4), 1e-9);
  EXPECT_NEAR(after.pressure_pa, before.pressure_pa * std::pow(0.9, -3 * 1.4), 1e-8);
}

TEST(Measures, FreeFallTradesHeightForSpeed) {
  const Vec3d gravity(0.0, -9.81, 1.0);
  SoftState<double> state = make_soft_state<double>(gas_ball());
  const double at_start_j = measure(state, 0.0, gravity).gravity_j;
  const double time_s = 0.7;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.x[i] += 0.5 * time_s * time_s * gravity;
    state.v[i] += time_s * gravity;
  }
  const BodyMeasures after = measure(state, 0.0, gravity);
  EXPECT_NEAR(after.kinetic_j, 0.5 * 3.0 * (time_s * gravity).squaredNorm(), 1e-11);
  EXPECT_NEAR(after.kinetic_j + after.gravity_j, at_start_j, 1e-11);
  EXPECT_NEAR(after.max_speed_m_s, time_s * gravity.norm(), 1e-12);
}

TEST(Measures, VolumeIsExactWhateverTheBodyStepsBy) {
  SoftBody body = ball_of_gas(GasLaw::isothermal);
  body.volume.method = VolumeMethod::box;
  const BodyMeasures sums = measure(make_soft_state<double>(body), 0.0, Vec3d::Zero());
  EXPECT_NEAR(sums.volume_m3, signed_volume_m3(body.mesh->positions_m, body.mesh->faces), 1e-15);
  EXPECT_GT(0.02 * gas_constant_j_mol_k * 293.15 / sums.volume_m3, 1.5 * sums.pressure_pa);
}

TEST(Measures, AnOpenMeshHasAreaButNoVolume) {
  SoftBody body = gas_ball();
  body.mesh = *make_grid(4, 4, 2.0, 1.0);
  const BodyMeasures sums = measure(make_soft_state<double>(body), 0.0, Vec3d::Zero());
  EXPECT_EQ(sums.volume_m3, 0.0);
  EXPECT_EQ(sums.pressure_pa, 0.0);
  EXPECT_NEAR(sums.area_m2, 2.0, 1e-14);
}

TEST(Measures, SinglePrecisionAgrees) {
  SoftBody body = ball_of_gas(GasLaw::isothermal);
  body.velocity = {1.0, 2.0, 3.0};
  const BodyMeasures single = measure(make_soft_state<float>(body), 0.0, Vec3d::Zero());
  const BodyMeasures exact = measure(make_soft_state<double>(body), 0.0, Vec3d::Zero());
  EXPECT_NEAR(single.kinetic_j / exact.kinetic_j, 1.0, 1e-6);
  EXPECT_NEAR(single.volume_m3 / exact.volume_m3, 1.0, 1e-6);
  EXPECT_NEAR(single.pressure_pa / exact.pressure_pa, 1.0, 1e-6);
}

struct GradientCase {
  std::string name;
  GasLaw law;
  double size;  // the body's, over that of its rest
  bool springs_differ = false;
};

class MeasuresGradient : public testing::TestWithParam<GradientCase> {};

TEST_P(MeasuresGradient, OfAllEnergiesIsMinusTheForce) {
  const Surroundings surroundings{{1.0, -9.81, 0.5}, {.pressure_pa = 40.0}};
  SoftBody body = ball_of_gas(GetParam().law);
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> factor(0.0, 100.0);
  for (std::size_t i = 0; GetParam().springs_differ && i < body.mesh->positions_m.size(); ++i) {
    body.springs.vertex_stiffness_scale.push_back(factor(engine));
  }
  SoftState<double> state = make_soft_state<double>(body);
  std::uniform_real_distribution<double> offset(-0.02, 0.02);
  scale(state, GetParam().size);
  for (Vec3d& x : state.x) x += GetParam().size * Vec3d(offset(engine), offset(engine), offset(engine));

  const std::vector<Vec3d> force = forces_on(state, surroundings);
  const auto energy_j = [&] {
    const BodyMeasures sums = measure(state, surroundings.atmosphere.pressure_pa, surroundings.gravity);
    return sums.elastic_j + sums.gas_j + sums.gravity_j;
  };
  const double step_m = 1e-5 * GetParam().size;
  for (const std::size_t vertex : {std::size_t{0}, std::size_t{17}, std::size_t{41}}) {
    for (int axis = 0; axis < 3; ++axis) {
      const double at = state.x[vertex][axis];
      state.x[vertex][axis] = at + step_m;
      const double above_j = energy_j();
      state.x[vertex][axis] = at - step_m;
      const double below_j = energy_j();
      state.x[vertex][axis] = at;
      EXPECT_NEAR((below_j - above_j) / (2 * step_m), force[vertex][axis], 1e-6 * force[vertex].norm());
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Gas, MeasuresGradient,
                         testing::Values(GradientCase{"Isothermal", GasLaw::isothermal, 1.1},
                                         GradientCase{"IsothermalOfUnlikeSprings", GasLaw::isothermal, 1.1, true},
                                         GradientCase{"Adiabatic", GasLaw::adiabatic, 0.9},
                                         GradientCase{"IsothermalBelowTheFloor", GasLaw::isothermal, 0.08},
                                         GradientCase{"AdiabaticBelowTheFloor", GasLaw::adiabatic, 0.08}),
                         [](const auto& param) { return param.param.name; });

}  // namespace
}  // namespace pneuma::physics
