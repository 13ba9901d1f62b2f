// Shows that the error bound holds for every vertex, out to the largest coordinate and down to the least bound, where
// the rounding of doubles counts; measured in long double, whose own rounding is 2,000 times smaller.
#include "codec/grid.h"

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "base/limits.h"

namespace pneuma::codec {
namespace {

long double distance_max_m(const std::vector<double>& positions_m, const Lattice& lattice, double step_m) {
  std::vector<double> back_m(positions_m.size());
  dequantise(lattice, step_m, back_m);
  long double largest = 0.0L;
  for (std::size_t i = 0; i < positions_m.size(); i += 3) {
    long double squares = 0.0L;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const long double off =
          static_cast<long double>(positions_m[i + axis]) - static_cast<long double>(back_m[i + axis]);
      squares += off * off;
    }
    largest = std::max(largest, std::sqrt(squares));
  }
  return largest;
}

long double largest_error_m(const std::vector<double>& positions_m, double step_m) {
  Lattice lattice(positions_m.size());
  quantise(positions_m, step_m, lattice);
  return distance_max_m(positions_m, lattice, step_m);
}

class ErrorBound : public testing::TestWithParam<double> {};

TEST_P(ErrorBound, HoldsOnRandomPositionsOfEverySize) {
  const double max_error_m = GetParam();
  const double step_m = grid_step_m(max_error_m);
  std::mt19937_64 random(11);
  for (double extent_m = 1e-7; extent_m <= base::coordinate_max_m; extent_m *= 10.0) {
    std::uniform_real_distribution<double> coordinate(-extent_m, extent_m);
    std::vector<double> positions_m(30'000);
    for (double& value : positions_m) value = coordinate(random);
    EXPECT_LE(largest_error_m(positions_m, step_m), max_error_m) << "within " << extent_m << " m";
  }
}

TEST_P(ErrorBound, HoldsWithAlternatives) {
  const double max_error_m = GetParam();
  const double step_m = grid_step_m(max_error_m);
  std::mt19937_64 random(12);
  for (double extent_m = 100.0 * max_error_m; extent_m <= base::coordinate_max_m; extent_m *= 10.0) {
    std::uniform_real_distribution<double> coordinate(-extent_m, extent_m);
    std::vector<double> positions_m(30'000);
    for (double& value : positions_m) value = coordinate(random);
    Lattice lattice(positions_m.size());
    quantise(positions_m, step_m, lattice);
    std::vector<Lanes> alternatives(positions_m.size() / 3);
    find_alternatives(positions_m, lattice, step_m, surely_within_m(max_error_m), alternatives);
    std::size_t others = 0;
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      const auto more = static_cast<std::int32_t>(alternatives[i / 3].v[i % 3]);
      lattice[i] += more;
      others += more != 0 ? 1 : 0;
    }
    EXPECT_LE(distance_max_m(positions_m, lattice, step_m), max_error_m) << "within " << extent_m << " m";
    EXPECT_GT(others, lattice.size() / 4) << "a ball of the bound holds 1.46 points in the mean";
  }
}

TEST_P(ErrorBound, HoldsAtCellCornersWhereTheErrorIsLargest) {
  const double max_error_m = GetParam();
  const double step_m = grid_step_m(max_error_m);
  std::vector<double> positions_m;
  // (1, 1/2, 0) from an even point, and what the lattice's symmetries make of it.
  for (double cell = 0.0; (cell + 2.0) * step_m < base::coordinate_max_m; cell = 2.0 * cell + 2.0) {
    for (std::size_t whole = 0; whole < 3; ++whole) {
      for (int signs = 0; signs < 4; ++signs) {
        std::array<double, 3> corner{cell, cell, cell};
        corner[whole] += (signs & 1) == 0 ? 1.0 : -1.0;
        corner[(whole + 1) % 3] += (signs & 2) == 0 ? 0.5 : -0.5;
        for (const double coordinate : corner) positions_m.push_back(coordinate * step_m);
      }
    }
  }
  const long double error_m = largest_error_m(positions_m, step_m);
  EXPECT_LE(error_m, max_error_m);
  EXPECT_GE(error_m, 0.99L * static_cast<long double>(max_error_m));  // the bound is used, not only kept
}

INSTANTIATE_TEST_SUITE_P(Bounds, ErrorBound,
                         testing::Values(base::max_error_min_m, 1e-5, base::max_error_default_m, 0.1,
                                         base::max_error_max_m));

TEST(Quantise, GivesPointsOfOneParity) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> coordinate(-3.0, 3.0);
  std::vector<double> positions_m(3'000);
  for (double& value : positions_m) value = coordinate(random);
  Lattice points(positions_m.size());
  quantise(positions_m, 0.01, points);
  for (std::size_t i = 0; i < points.size(); i += 3) {
    EXPECT_EQ(points[i] & 1, points[i + 1] & 1);
    EXPECT_EQ(points[i] & 1, points[i + 2] & 1);
  }
}

TEST(Quantise, LargestCoordinateIsKept) {
  const double step_m = grid_step_m(base::max_error_min_m);
  const std::vector<double> positions_m{base::coordinate_max_m, -base::coordinate_max_m, 0.0};
  Lattice lattice(3);
  quantise(positions_m, step_m, lattice);
  EXPECT_NEAR(static_cast<double>(lattice[0]), base::coordinate_max_m / step_m, 1.5);
  EXPECT_LE(std::abs(lattice[2]), 1);
}

}  // namespace
}  // namespace pneuma::codec
