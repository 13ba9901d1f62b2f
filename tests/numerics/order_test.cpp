// Shows that each integrator is of its order (halving the step divides the error by 2^order) and grows or stays as its
// amplification factor says: explicit Euler 1 + (wh)^2 in energy a step, midpoint 1 + (wh)^4 / 4, symplectic Euler
// bounded up to wh = 2.
#include <array>

#include "numerics/worlds.h"

namespace pneuma::physics {
namespace {

struct OrderCase {
  std::string name;
  Integrator integrator;
  double order;
  std::uint32_t substeps;  // the coarsest of three
};

class Order : public testing::TestWithParam<OrderCase> {};

TEST_P(Order, IsObservedOnABreathingIcosahedron) {
  const BreathingBall ball;
  const auto end_of = [&](Integrator integrator, std::uint32_t substeps) {
    Scene scene = ball.scene(1.0, integrator, 30, substeps);  // a third of a breath
    scene.stepping.error_target = 1e-9;                       // what a linear solve leaves is not to be seen
    World world = make_world(std::move(scene));
    run_ticks(world, 1);
    return positions_of(world);
  };
  const std::vector<Vec3d> exact = end_of(Integrator::rk4, 4096);
  std::array<double, 3> error_m{};
  for (std::size_t i = 0; i < 3; ++i) {
    error_m[i] = distance_m(end_of(GetParam().integrator, GetParam().substeps << i), exact);
  }
  EXPECT_NEAR(std::log2(error_m[0] / error_m[1]), GetParam().order, 0.1);
  EXPECT_NEAR(std::log2(error_m[1] / error_m[2]), GetParam().order, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Integrators, Order,
                         testing::Values(OrderCase{"ExplicitEuler", Integrator::explicit_euler, 1.0, 512},
                                         OrderCase{"Midpoint", Integrator::midpoint, 2.0, 256},
                                         OrderCase{"Rk4", Integrator::rk4, 4.0, 64},
                                         OrderCase{"SymplecticEuler", Integrator::symplectic_euler, 1.0, 256},
                                         OrderCase{"ImplicitEuler", Integrator::implicit_euler, 1.0, 512},
                                         OrderCase{"TrBdf2", Integrator::tr_bdf2, 2.0, 64}),
                         [](const auto& param) { return param.param.name; });

struct GrowthCase {
  std::string name;
  Integrator integrator;
  double (*growth)(double wh);  // of the energy, a step
};

class Growth : public testing::TestWithParam<GrowthCase> {};

TEST_P(Growth, OfAnUndampedOscillatorIsThatOfTheAmplificationFactor) {
  const HungVertex hung;
  const double frequency_rad_s = std::sqrt(2.0 * hung.stiffness_n_m / hung.vertex_mass_kg) * hung.slope();
  const int steps = 400;
  for (const double wh : {0.05, 0.1, 0.2}) {
    const double rate_hz = frequency_rad_s / wh;
    Scene scene = hung.scene(GetParam().integrator, rate_hz, 1);
    scene.soft_bodies[0].velocity = {0, 1e-6, 0};  // stays linear when it has grown, and well above round-off
    World world = make_world(std::move(scene));
    // The factor holds for |v|^2 + (w x)^2; the springs' energy measured in full loses all digits at this size.
    const auto energy = [&](double speed_squared) {
      const double offset_m = positions_of(world)[2].y() + hung.height_m;
      return speed_squared + std::pow(frequency_rad_s * offset_m, 2);
    };
    const double before = energy(1e-12);
    run_ticks(world, steps);
    const double after = energy(2.0 * world.measure(0).kinetic_j / hung.vertex_mass_kg);
    EXPECT_NEAR(std::log(after / before) / (steps * std::log(GetParam().growth(wh))), 1.0, 1e-3) << "wh = " << wh;
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, Growth,
                         testing::Values(GrowthCase{"ExplicitEuler", Integrator::explicit_euler,
                                                    [](double wh) { return 1.0 + wh * wh; }},
                                         GrowthCase{"Midpoint", Integrator::midpoint,
                                                    [](double wh) { return 1.0 + std::pow(wh, 4) / 4.0; }}),
                         [](const auto& param) { return param.param.name; });

TEST(Stability, SymplecticEulerIsBoundedExactlyBelowTwoOverTheFrequency) {
  const HungVertex hung;
  const double frequency_rad_s = std::sqrt(2.0 * hung.stiffness_n_m / hung.vertex_mass_kg) * hung.slope();
  const auto furthest_m = [&](double wh) {
    Scene scene = hung.scene(Integrator::symplectic_euler, frequency_rad_s / wh, 1);
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
  EXPECT_LT(furthest_m(1.95), 1e-6);
  EXPECT_GT(furthest_m(2.05), 1e-3);
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
