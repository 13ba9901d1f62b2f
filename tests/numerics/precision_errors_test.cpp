// Shows that the report's measures of error are what they say, on motions whose errors are known.
#include "numerics/report/precision_errors.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace pneuma::report::precision {
namespace {

TEST(FittedPeriod, OfASinusoidIsItsOwn) {
  constexpr double period_s = 0.0931;
  std::vector<double> signal;
  for (int i = 0; i <= 60; ++i)
    signal.push_back(3.0 + 0.2 * std::sin(2.0 * std::numbers::pi * i / 60.0 / period_s + 0.4));
  for (const double guess_s : {0.08, 0.0931, 0.11}) {
    EXPECT_NEAR(fitted_period_s(signal, 1.0 / 60.0, guess_s) / period_s, 1.0, 1e-6);
  }
}

TEST(FittedPeriod, OfADyingOscillationIsStillItsOwn) {
  constexpr double period_s = 0.12;
  std::vector<double> signal;
  for (int i = 0; i <= 60; ++i) {
    signal.push_back(1.0 + std::exp(-i / 40.0) * std::cos(2.0 * std::numbers::pi * i / 60.0 / period_s));
  }
  EXPECT_NEAR(fitted_period_s(signal, 1.0 / 60.0, 0.1) / period_s, 1.0, 2e-3);
}

// Two particles of half a kilogram that fly apart along x, from one metre, each at 1 m/s.
Trajectory flight(double shift_m, double scale) {
  Trajectory trajectory;
  for (int tick = 0; tick <= 4; ++tick) {
    const double half_m = scale * (0.5 + 0.25 * tick);
    Sample& sample = trajectory.samples.emplace_back();
    sample.positions_m = {{{shift_m - half_m, 0, 0}, {shift_m + half_m, 0, 0}}};
    sample.kinetic_j = 0.5;
    sample.energy_j = 0.5;
    physics::BodyMeasures& body = sample.soft.emplace_back();
    body.volume_m3 = half_m * half_m * half_m;
    body.centre_of_mass = {shift_m, 0, 0};
    body.max_speed_m_s = 1.0;
  }
  return trajectory;
}

constexpr std::uint64_t always = 100;

TEST(Errors, OfARunAgainstItselfAreNone) {
  const Trajectory run = flight(0.0, 1.0);
  const Errors errors = errors_of(run, run, {.sizes_m = {1.0}, .mass_kg = 1.0, .free_ticks = always, .rest_ticks = 0});
  for (const double error : {errors.position, errors.centre, errors.volume, errors.energy, errors.momentum}) {
    EXPECT_EQ(error, 0.0);
  }
}

TEST(Errors, OfAShiftAreItsShareOfTheBodysSize) {
  const Errors errors = errors_of(flight(0.3, 1.0), flight(0.0, 1.0),
                                  {.sizes_m = {2.0}, .mass_kg = 1.0, .free_ticks = always, .rest_ticks = 0});
  EXPECT_NEAR(errors.position, 0.15, 1e-12);
  EXPECT_NEAR(errors.centre, 0.15, 1e-12);
  EXPECT_NEAR(errors.volume, 0.0, 1e-12);
}

TEST(Errors, OfVolumeAtRestCompareTheLastTicks) {
  Trajectory run = flight(0.0, 1.0);
  run.samples[4].soft[0].volume_m3 *= 1.331;
  const Errors errors =
      errors_of(run, flight(0.0, 1.0), {.sizes_m = {1.0}, .mass_kg = 1.0, .free_ticks = always, .rest_ticks = 1});
  EXPECT_NEAR(errors.volume_at_rest, 0.331, 1e-12);
  EXPECT_NEAR(errors.radius_at_rest, 0.1, 1e-12);
}

TEST(Errors, OfPositionsEndWithTheFreeTicks) {
  Trajectory run = flight(0.0, 1.0);
  run.samples[4].positions_m[0][0].x() += 5.0;  // after something was touched
  const Measuring before{.sizes_m = {1.0}, .mass_kg = 1.0, .free_ticks = 3, .rest_ticks = 0};
  EXPECT_EQ(errors_of(run, flight(0.0, 1.0), before).position, 0.0);
}

}  // namespace
}  // namespace pneuma::report::precision
