// Shows that symplectic Euler may be stepped close to its limit where springs are damped, and that it keeps its margin
// where they are not.
#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "physics/choice/longest_step.h"
#include "physics/choice/stability.h"
#include "physics/choice/step_choice.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::physics {
namespace {

constexpr double tick_s = 1.0 / 60.0;

SoftBody stiff_ball(double damping_n_s_m, double nrt_j) {
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(2, 0.5);
  body.springs = {.stiffness_n_m = 1e4, .damping_n_s_m = damping_n_s_m};
  body.gas = Gas{.moles = nrt_j / (gas_constant_j_mol_k * 293.15)};
  body.collision.soft = SoftCollision::none;
  return body;
}

double step_s(const SoftBody& body) {
  return longest_step_s(Integrator::symplectic_euler, estimate_frequencies(body, {}), 0.01, tick_s);
}

TEST(Frequencies, OfStretchedSpringsAreThoseOfTheMeshsGraph) {
  // The largest eigenvalue of the icosahedron's graph Laplacian is 5 + sqrt(5).
  SoftBody body = stiff_ball(0.0, 1.0);
  body.mesh = *make_icosphere(0, 0.5);
  const double vertex_kg = body.mass_kg / 12.0;
  const double exact_rad_s = std::sqrt((5.0 + std::sqrt(5.0)) * body.springs.stiffness_n_m / vertex_kg);
  const double estimate_rad_s = estimate_frequencies(body, {}).stretched_rad_s;
  EXPECT_GE(estimate_rad_s, exact_rad_s);
  EXPECT_LE(estimate_rad_s, 1.03 * exact_rad_s);  // the estimate's own margin
  EXPECT_GE(bound_frequencies(body, {}).stretched_rad_s, estimate_rad_s);
}

TEST(Frequencies, OfSpringsAreFastestWhereTheyAreStretchedFarthest) {
  SoftBody body = stiff_ball(0.0, 1.0);
  const double stretched_rad_s = estimate_frequencies(body, {}).stretched_rad_s;
  for (const double rest_scale : {1.0, 0.5, 0.1, 1e-3}) {
    body.springs.rest_scale = rest_scale;
    const Frequencies frequencies = estimate_frequencies(body, {});
    EXPECT_NEAR(frequencies.stretched_rad_s, stretched_rad_s, 1e-9 * stretched_rad_s);
    // Of the gas it has a little more.
    EXPECT_LE(frequencies.fastest_rad_s, std::hypot(stretched_rad_s, frequencies.gas_rad_s)) << rest_scale;
  }
}

TEST(DampedSteps, AreCloserToTheLimitThanUndampedOnes) {
  const SoftBody undamped = stiff_ball(0.0, 100.0);
  EXPECT_LT(step_s(undamped) * estimate_frequencies(undamped, {}).fastest_rad_s, 1.0);
  const SoftBody damped = stiff_ball(0.2, 100.0);
  const Frequencies frequencies = estimate_frequencies(damped, {});
  EXPECT_GT(step_s(damped), 1.4 * step_s(undamped));
  EXPECT_LT(step_s(damped), 0.9 * stability_limit_s(Integrator::symplectic_euler, frequencies));
}

TEST(DampedSteps, KeepTheMarginOfAGasAndOfHinges) {
  SoftBody gas = stiff_ball(1.0, 1e7);
  EXPECT_LE(step_s(gas) * estimate_frequencies(gas, {}).gas_rad_s, 1.01);
  SoftBody hinges = stiff_ball(1.0, 100.0);
  hinges.springs.bend_stiffness_n_m = 1e4;
  EXPECT_LE(step_s(hinges) * estimate_frequencies(hinges, {}).bending_rad_s, 1.01);
}

// A breathing of less than two ticks is not resolved where springs are damped; one that is seen is.
TEST(DampedSteps, ResolveTheBreathingThatIsSeenTwiceAsFinely) {
  const SoftBody body = stiff_ball(1.0, 100.0);
  const Frequencies frequencies = estimate_frequencies(body, {});
  const auto asked_s = [&](double tick_period_s) {
    return longest_step_s(Integrator::symplectic_euler, frequencies, 1e-4, tick_period_s);
  };
  const double seen_s = 0.99 * std::numbers::pi / frequencies.breathing_rad_s;
  // A period's error goes with the square of the step, and may be four times as large where it is not seen.
  EXPECT_DOUBLE_EQ(2.0 * asked_s(seen_s), asked_s(1.02 * seen_s));
}

/// The gas blows the ball up to some times its volume, and it beats.
class BeatingBall : public testing::TestWithParam<double> {};

TEST_P(BeatingBall, GainsNoEnergyAndStaysWhole) {
  for (const double damping_n_s_m : {0.0, 0.1, 1.0}) {
    Scene scene;
    scene.gravity = Vec3d::Zero();
    scene.stepping.integrator = Integrator::symplectic_euler;
    scene.soft_bodies.push_back(stiff_ball(damping_n_s_m, GetParam()));
    auto world = World::create(scene);
    ASSERT_TRUE(world.ok()) << world.status().message();
    const auto energy_j = [&] {
      const BodyMeasures now = world->measure(0);
      return now.kinetic_j + now.elastic_j + now.gas_j;
    };
    const double at_start_j = energy_j();
    double most_elastic_j = 0.0;
    double most_gained_j = 0.0;
    Workers workers(1);
    for (int tick = 0; tick < 180; ++tick) {
      world->step_tick(workers);
      most_elastic_j = std::max(most_elastic_j, world->measure(0).elastic_j);
      most_gained_j = std::max(most_gained_j, energy_j() - at_start_j);
    }
    EXPECT_FALSE(world->is_frozen(0)) << damping_n_s_m << " N s/m";
    // Undamped, symplectic Euler's energy swings, by no more than what the springs hold.
    EXPECT_LE(most_gained_j, (damping_n_s_m > 0.0 ? 0.02 : 1.0) * most_elastic_j) << damping_n_s_m << " N s/m";
  }
}

INSTANTIATE_TEST_SUITE_P(Pressures, BeatingBall, testing::Values(200.0, 2e3, 2e4));

}  // namespace
}  // namespace pneuma::physics
