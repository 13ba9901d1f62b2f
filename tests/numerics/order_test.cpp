// Shows that each integrator is of its order (halving the step divides the error by 2^order) and grows or stays as its
// amplification factor says: explicit Euler 1 + (wh)^2 in energy a step, midpoint 1 + (wh)^4 / 4, symplectic Euler
// bounded up to wh = 2, implicit Euler 1 / (1 + (wh)^2).
#include <array>
#include <numbers>

#include "numerics/amplification.h"
#include "numerics/worlds.h"

namespace pneuma::physics {
namespace {

class Order : public testing::TestWithParam<Integrator> {
 protected:
  // Observed twice: from three runs of 1/30 s, each with half the step of the one before.
  static void expect_order(const Scene& scene, std::uint32_t coarsest) {
    const std::vector<Vec3d> exact = after_a_thirtieth(scene, Integrator::rk4, 4096);
    std::array<double, 3> error_m{};
    for (std::size_t i = 0; i < 3; ++i) {
      error_m[i] = distance_m(after_a_thirtieth(scene, GetParam(), coarsest << i), exact);
    }
    EXPECT_NEAR(std::log2(error_m[0] / error_m[1]), order_of(GetParam()), 0.1);
    EXPECT_NEAR(std::log2(error_m[1] / error_m[2]), order_of(GetParam()), 0.1);
  }
  // The coarsest of three whose errors are near their leading term, and far from round-off.
  [[nodiscard]] static std::uint32_t coarsest() {
    if (order_of(GetParam()) == 1.0) return 512;
    return GetParam() == Integrator::midpoint ? 256 : 64;
  }
};

TEST_P(Order, IsObservedOnABreathingIcosahedron) {
  expect_order(BreathingBall{}.scene(1.0, GetParam(), 30, 1), coarsest());  // a third of a breath
}

TEST_P(Order, IsObservedWithAllForcesAtOnce) {
  expect_order(all_forces_scene(), coarsest());
}

INSTANTIATE_TEST_SUITE_P(Integrators, Order, testing::ValuesIn(every_integrator), test_name_of);

struct GrowthCase {
  std::string name;
  Integrator integrator;
  double speed_m_s = 1e-6;  // small enough to stay linear when it has grown, and well above round-off
};

class Growth : public testing::TestWithParam<GrowthCase> {};

TEST_P(Growth, OfAnUndampedOscillatorIsThatOfTheAmplificationFactor) {
  const HungVertex hung;
  const double frequency_rad_s = std::sqrt(2.0 * hung.stiffness_n_m / hung.vertex_mass_kg) * hung.slope();
  const int steps = 400;
  for (const double wh : {0.05, 0.1, 0.2}) {
    const double rate_hz = frequency_rad_s / wh;
    Scene scene = hung.scene(GetParam().integrator, rate_hz, 1);
    scene.stepping.error_target = 1e-12;
    scene.soft_bodies[0].velocity = {0, GetParam().speed_m_s, 0};
    World world = make_world(std::move(scene));
    // The factor holds for |v|^2 + (w x)^2; the springs' energy measured in full loses all digits at this size.
    const auto energy = [&](double speed_squared) {
      const double offset_m = positions_of(world)[2].y() + hung.height_m;
      return speed_squared + std::pow(frequency_rad_s * offset_m, 2);
    };
    const double before = energy(std::pow(GetParam().speed_m_s, 2));
    run_ticks(world, steps);
    const double after = energy(2.0 * world.measure(0).kinetic_j / hung.vertex_mass_kg);
    EXPECT_NEAR(std::log(after / before) / (steps * std::log(energy_growth(GetParam().integrator, wh))), 1.0, 5e-3)
        << "wh = " << wh;
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, Growth,
                         testing::Values(GrowthCase{"ExplicitEuler", Integrator::explicit_euler},
                                         GrowthCase{"Midpoint", Integrator::midpoint},
                                         GrowthCase{"ImplicitEuler", Integrator::implicit_euler, 1e-4},
                                         GrowthCase{"TrBdf2", Integrator::tr_bdf2, 1e-7}),
                         [](const auto& param) { return param.param.name; });

TEST(Stability, AnOscillatorIsBoundedExactlyBelowTheMethodsLimit) {
  const HungVertex hung;
  const double frequency_rad_s = std::sqrt(2.0 * hung.stiffness_n_m / hung.vertex_mass_kg) * hung.slope();
  const auto furthest_m = [&](Integrator integrator, double wh) {
    Scene scene = hung.scene(integrator, frequency_rad_s / wh, 1);
    scene.soft_bodies[0].velocity = {0, 1e-6, 0};
    World world = make_world(std::move(scene));
    Workers workers(1);
    double furthest = 0.0;
    for (int i = 0; i < 400; ++i) {
      world.step_tick(workers);
      furthest = std::max(furthest, std::abs(positions_of(world)[2].y() + hung.height_m));
    }
    return furthest;
  };
  for (const auto& [integrator, limit] :
       {std::pair(Integrator::symplectic_euler, 2.0), std::pair(Integrator::rk4, 2.0 * std::numbers::sqrt2)}) {
    EXPECT_LT(furthest_m(integrator, 0.975 * limit), 1e-6) << name_of(integrator);
    EXPECT_GT(furthest_m(integrator, 1.025 * limit), 1e-3) << name_of(integrator);
  }
}

TEST(Stability, SymplecticEulersEnergyErrorIsOfTheStepsOrderAndDoesNotDrift) {
  const BreathingBall ball;
  const auto worst_energy_errors_j = [&](std::uint32_t substeps) {
    World world = make_world(ball.scene(1.0, Integrator::symplectic_euler, 1000, substeps));
    const auto energy_j = [&] {
      const BodyMeasures sums = world.measure(0);
      return sums.kinetic_j + sums.elastic_j + sums.gas_j;
    };
    const double start_j = energy_j();
    Workers workers(1);
    std::array<double, 2> worst_j{};  // of the first and the second half
    const int ticks = 10'000;
    for (int i = 0; i < ticks; ++i) {
      world.step_tick(workers);
      double& worst = worst_j[i < ticks / 2 ? 0 : 1];
      worst = std::max(worst, std::abs(energy_j() - start_j));
    }
    return worst_j;
  };
  const std::array<double, 2> coarse_j = worst_energy_errors_j(1);
  const std::array<double, 2> fine_j = worst_energy_errors_j(2);
  EXPECT_NEAR(std::log2(coarse_j[0] / fine_j[0]), 1.0, 0.1);
  EXPECT_NEAR(coarse_j[1] / coarse_j[0], 1.0, 0.02);
  EXPECT_NEAR(fine_j[1] / fine_j[0], 1.0, 0.02);
}

}  // namespace
}  // namespace pneuma::physics
