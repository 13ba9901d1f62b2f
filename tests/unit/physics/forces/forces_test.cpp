// Shows that each force meets its law and that the inner ones leave total momentum and angular momentum alone, in both
// precisions, on bodies whose particles were scattered at random.
#include <random>

#include <gtest/gtest.h>

#include "physics/forces/force_terms.h"
#include "physics/forces/soft_setup.h"
#include "physics/forces/volume.h"
#include "physics/mesh/mesh_builders.h"
#include "unit/physics/body_tables.h"

namespace pneuma::physics {
namespace {

template <class Real>
class PressureForce : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(PressureForce, Precisions);

template <class Real>
SoftState<Real> scattered_ball(SoftBody body, unsigned seed) {
  body.name = "ball";
  body.mesh = *make_icosphere(2, 1.0);
  SoftState<Real> state = make_soft_state<Real>(body);
  std::mt19937 random(seed);
  std::normal_distribution<Real> normal(0, Real(0.2));
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.x[i] += Vec3<Real>{normal(random), normal(random), normal(random)};
    state.v[i] += Vec3<Real>{normal(random), normal(random), normal(random)};
  }
  return state;
}

template <class Real>
struct Resultant {
  Vec3d force = Vec3d::Zero();
  Vec3d torque = Vec3d::Zero();
  double magnitude = 0.0;  // sum of the forces' sizes
};

template <class Real>
Resultant<Real> resultant(const SoftState<Real>& state, const std::vector<Vec3<Real>>& force) {
  Resultant<Real> sum;
  for (std::size_t i = 0; i < force.size(); ++i) {
    const Vec3d f = force[i].template cast<double>();
    sum.force += f;
    sum.torque += state.x[i].template cast<double>().cross(f);
    sum.magnitude += f.norm();
  }
  return sum;
}

TYPED_TEST(PressureForce, NetForceAndTorqueOnClosedMeshAreZero) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    SoftState<TypeParam> state = scattered_ball<TypeParam>({}, seed);
    std::vector<Vec3<TypeParam>> force(state.x.size(), Vec3<TypeParam>::Zero());
    add_pressure<TypeParam>(state, 1000.0, state.x, force);
    const auto sum = resultant(state, force);
    const double round_off = 20.0 * static_cast<double>(std::numeric_limits<TypeParam>::epsilon()) * sum.magnitude;
    EXPECT_LT(sum.force.norm(), round_off);
    EXPECT_LT(sum.torque.norm(), round_off);
  }
}

TYPED_TEST(PressureForce, IsThePressureTimesTheVolumesGradient) {
  // Euler: the volume is homogeneous of degree 3, so sum x . gradV = 3 V.
  SoftState<TypeParam> state = scattered_ball<TypeParam>({}, 7);
  std::vector<Vec3<TypeParam>> force(state.x.size(), Vec3<TypeParam>::Zero());
  add_pressure<TypeParam>(state, 1.0, state.x, force);
  double along = 0.0;
  for (std::size_t i = 0; i < force.size(); ++i) along += static_cast<double>(state.x[i].dot(force[i]));
  const double volume_m3 = body_volume_m3<TypeParam>(state.body, state.x);
  EXPECT_NEAR(along, 3.0 * volume_m3,
              50.0 * static_cast<double>(std::numeric_limits<TypeParam>::epsilon()) * volume_m3);
}

TYPED_TEST(PressureForce, SpreadByNormalsPushesABallAsHardAsTheSpreadByFaces) {
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(3, 1.0);
  SoftState<TypeParam> state = make_soft_state<TypeParam>(body);
  const auto outward = [&](PressureSpread spread) {
    state.body.pressure_spread = spread;
    std::vector<Vec3<TypeParam>> force(state.x.size(), Vec3<TypeParam>::Zero());
    add_pressure<TypeParam>(state, 1.0, state.x, force);
    double sum = 0.0;
    for (std::size_t i = 0; i < force.size(); ++i) sum += static_cast<double>(state.x[i].dot(force[i]));
    return sum;
  };
  // Not the same force (the paper's footnote averages the normals), but within a few per cent on a fine ball.
  EXPECT_NEAR(outward(PressureSpread::vertex_normals), outward(PressureSpread::faces),
              0.03 * outward(PressureSpread::faces));
}

TYPED_TEST(PressureForce, KeepsTheRoomOfItsSpread) {
  SoftState<TypeParam> state = scattered_ball<TypeParam>({}, 2);
  state.body.pressure_spread = PressureSpread::vertex_normals;
  std::vector<Vec3<TypeParam>> force(state.x.size(), Vec3<TypeParam>::Zero());
  add_pressure<TypeParam>(state, 1.0, state.x, force);
  const auto* const normal_sums = state.spread.normal_sums.data();
  const auto* const areas_m2 = state.spread.areas_m2.data();
  ASSERT_EQ(state.spread.areas_m2.size(), state.x.size());
  add_pressure<TypeParam>(state, 1.0, state.x, force);
  EXPECT_EQ(state.spread.normal_sums.data(), normal_sums);
  EXPECT_EQ(state.spread.areas_m2.data(), areas_m2);
}

TEST(SpringForce, TwoParticlesPullByHookeAndDampBySpeedAlongTheSpring) {
  SoftBody body;
  body.name = "triangle";
  body.mesh = *make_mesh({{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}, {{0, 1, 2}});
  body.mass_kg = 3.0;
  body.springs = {.stiffness_n_m = 50.0, .damping_n_s_m = 4.0, .rest_scale = 0.5};
  SoftState<double> state = make_soft_state<double>(body);
  state.v[1] = {3.0, 5.0, 0.0};
  std::vector<Vec3d> force = forces_on(state, {});
  // 0-1: stretched by 1 m, parting at 3 m/s: 50 + 12 N. 0-2: 50 N. 1-2 at 45 degrees, of rest length sqrt(2).
  const double diagonal_stretch_n = 50.0 * std::numbers::sqrt2;
  const double diagonal_damping_n = 4.0 * (3.0 - 5.0) / std::numbers::sqrt2;
  EXPECT_NEAR(force[0].x(), 62.0, 1e-12);
  EXPECT_NEAR(force[0].y(), 50.0, 1e-12);
  const double along = (diagonal_stretch_n + diagonal_damping_n) / std::numbers::sqrt2;
  EXPECT_NEAR(force[1].x(), -62.0 - along, 1e-12);
  EXPECT_NEAR(force[1].y(), along, 1e-12);
}

TEST(SpringForce, LeavesMomentumAndAngularMomentumAlone) {
  SoftBody body;
  body.springs = {.stiffness_n_m = 1000.0, .damping_n_s_m = 10.0};
  body.gas = Gas{.moles = 0.1};
  SoftState<double> state = scattered_ball<double>(body, 3);
  std::vector<Vec3d> force = forces_on(state, {});
  const auto sum = resultant(state, force);
  EXPECT_LT(sum.force.norm(), 1e-13 * sum.magnitude);
  EXPECT_LT(sum.torque.norm(), 1e-13 * sum.magnitude);
}

TEST(SpringForce, ParticlesAtOnePlaceGiveNoNaN) {
  SoftBody body;
  body.springs = {.stiffness_n_m = 1000.0, .damping_n_s_m = 10.0};
  body.gas = Gas{.moles = 0.1};
  SoftState<double> state = scattered_ball<double>(body, 3);
  for (Vec3d& x : state.x) x = Vec3d(1.0, 2.0, 3.0);
  std::vector<Vec3d> force = forces_on(state, {});
  for (const Vec3d& f : force) EXPECT_TRUE(f.allFinite());
}

TEST(WindForce, OnAFlatSheetIsTheDragOfAPlate) {
  SoftBody body;
  body.name = "sheet";
  body.mesh = *make_grid(4, 3, 2.0, 1.5);
  body.drag.normal = 1.2;
  SoftState<double> state = make_soft_state<double>(body);
  Surroundings surroundings;
  surroundings.atmosphere = {.density_kg_m3 = 1.25, .wind = Vec3d(0.0, 8.0, 0.0)};
  std::vector<Vec3d> force = forces_on(state, surroundings);
  const double plate_n = 0.5 * 1.25 * 1.2 * (2.0 * 1.5) * 8.0 * 8.0;
  EXPECT_NEAR(resultant(state, force).force.y(), plate_n, 1e-12 * plate_n);

  // A sheet that goes with the wind feels none, and one along it only the tangential part.
  for (Vec3d& v : state.v) v = Vec3d(0.0, 8.0, 0.0);
  force = forces_on(state, surroundings);
  EXPECT_LT(resultant(state, force).magnitude, 1e-12);
  for (Vec3d& v : state.v) v.setZero();
  state.body.drag = {.normal = 1.2, .tangential = 0.1};
  surroundings.atmosphere.wind = Vec3d(6.0, 0.0, 0.0);
  force = forces_on(state, surroundings);
  EXPECT_NEAR(resultant(state, force).force.x(), 0.5 * 1.25 * 0.1 * 3.0 * 36.0, 1e-12);
}

TEST(GrabForce, IsADampedSpring) {
  SoftBody body;
  body.mass_kg = 162.0;
  SoftState<double> state = scattered_ball<double>(body, 1);
  state.v[5] = Vec3d(1.0, 0.0, 0.0);
  state.grabs.push_back(
      {.id = 1, .vertex = 5, .target = state.x[5] + Vec3d(0.0, 0.5, 0.0), .stiffness_n_m = 10.0, .damping_n_s_m = 2.0});
  std::vector<Vec3d> force(state.x.size(), Vec3d::Zero());
  add_other_forces<double>(state, {.x = state.x, .v = state.v, .explicit_dt_s = 0.01}, nullptr, force);
  EXPECT_TRUE(force[5].isApprox(Vec3d(-2.0, 5.0, 0.0), 1e-12));
}

// The mass is 1 kg and the step 0.01 s: 0.25 m/dt^2 = 2500 N/m and 0.5 m/dt = 50 N s/m, however many hands there are.
TEST(GrabForce, HandsOnOneVertexHoldNoHarderTogetherThanAStepBears) {
  for (const std::size_t hands : {1U, 2U, 64U}) {
    SoftBody body;
    body.mass_kg = 162.0;
    SoftState<double> state = scattered_ball<double>(body, 1);
    const Vec3d away(0.0, 0.5, 0.0);
    state.v[5] = Vec3d(1.0, 0.0, 0.0);
    for (std::size_t i = 0; i < hands; ++i) {
      state.grabs.push_back(
          {.id = i, .vertex = 5, .target = state.x[5] + away, .stiffness_n_m = 1e9, .damping_n_s_m = 1e9});
    }
    state.grabs.push_back({.id = 99, .vertex = 7, .target = state.x[7] + away, .stiffness_n_m = 10.0});
    std::vector<Vec3d> force(state.x.size(), Vec3d::Zero());
    add_other_forces<double>(state, {.x = state.x, .v = state.v, .explicit_dt_s = 0.01}, nullptr, force);
    EXPECT_TRUE(force[5].isApprox(Vec3d(-50.0, 0.5 * 2500.0, 0.0), 1e-12)) << hands;
    EXPECT_TRUE(force[7].isApprox(Vec3d(0.0, 5.0, 0.0), 1e-12)) << "another vertex has a share of its own";
  }
}

TEST(GrabForce, AHandPullsInProportionToItsStiffness) {
  SoftBody body;
  body.mass_kg = 162.0;
  SoftState<double> state = scattered_ball<double>(body, 1);
  for (Vec3d& v : state.v) v.setZero();
  state.grabs = {{.id = 1, .vertex = 5, .target = state.x[5] + Vec3d(1.0, 0.0, 0.0), .stiffness_n_m = 3e6},
                 {.id = 2, .vertex = 5, .target = state.x[5] + Vec3d(0.0, 1.0, 0.0), .stiffness_n_m = 1e6}};
  std::vector<Vec3d> force(state.x.size(), Vec3d::Zero());
  add_other_forces<double>(state, {.x = state.x, .v = state.v, .explicit_dt_s = 0.01}, nullptr, force);
  EXPECT_TRUE(force[5].isApprox(2500.0 * Vec3d(0.75, 0.25, 0.0), 1e-12));
}

}  // namespace
}  // namespace pneuma::physics
