// Shows what a check tells apart: that any one coordinate that is off, however far, changes a body's digest; that
// vertices which change places do; and that of two different states one in 2^14 has the same check.
#include "codec/points_check.h"

#include <array>
#include <cstdint>
#include <random>
#include <utility>

#include <gtest/gtest.h>

namespace pneuma::codec {
namespace {

Lattice some_points(std::mt19937_64& random, std::size_t vertices) {
  Lattice points(3 * vertices);
  for (std::int64_t& coordinate : points) coordinate = static_cast<std::int64_t>(random() % 4'001) - 2'000;
  return points;
}

// Worked out by hand: the sums of the axes are 1, 0 and w, and 16,777,619^2 = 637,696,617 modulo 2^32.
TEST(PointsCheck, IsAsDescribed) {
  EXPECT_EQ(points_digest({}), 0U);
  EXPECT_EQ(points_digest({0, 0, 7}), 7U);
  EXPECT_EQ(points_digest({0, 1, 0}), 16'777'619U);
  EXPECT_EQ(points_digest({1, 0, 0}), 637'696'617U);
  EXPECT_EQ(points_digest({0, 0, -1}), 0xffffffffU);
  EXPECT_EQ(points_digest({0, 0, (std::int64_t{1} << 31) - 1}), 0x7fffffffU);
  EXPECT_EQ(points_digest({0, 0, std::int64_t{1} << 31}), 0x80000003U);
  EXPECT_EQ(points_digest({0, 0, std::int64_t{5} << 32}), 15U);
  EXPECT_EQ(points_check({}), 0U);
  EXPECT_EQ(points_check(std::array{1U}), 2'654'435'761U >> 18U);
}

TEST(PointsCheck, AnyOneCoordinateThatIsOffChangesTheDigest) {
  std::mt19937_64 random(1);
  const Lattice points = some_points(random, 60);
  const std::uint32_t digest = points_digest(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int bit = 0; bit < 46; ++bit) {
      for (const std::int64_t sign : {-1, 1}) {
        Lattice wrong = points;
        wrong[i] += sign * (std::int64_t{1} << bit);
        EXPECT_NE(points_digest(wrong), digest) << i << ", 2^" << bit;
      }
    }
  }
}

TEST(PointsCheck, VerticesThatChangePlacesShow) {
  std::mt19937_64 random(2);
  const Lattice points = some_points(random, 60);
  const std::uint32_t digest = points_digest(points);
  for (std::size_t a = 0; a < 60; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      Lattice wrong = points;
      for (std::size_t axis = 0; axis < 3; ++axis) std::swap(wrong[3 * a + axis], wrong[3 * b + axis]);
      EXPECT_NE(points_digest(wrong), digest) << a << " and " << b;
    }
  }
}

TEST(PointsCheck, OneInSixteenThousandStatesPassesForAnother) {
  std::mt19937_64 random(3);
  const Lattice points = some_points(random, 20);
  const std::uint32_t check = points_check(std::array{points_digest(points), 5U});
  constexpr int states = 200'000;
  int passed = 0;
  for (int i = 0; i < states; ++i) {
    Lattice wrong = points;
    for (int steps = 0; steps < 3; ++steps) wrong[random() % wrong.size()] += 1;
    passed += points_check(std::array{points_digest(wrong), 5U}) == check ? 1 : 0;
  }
  EXPECT_LE(passed, 3 * states / 16'384) << "12 are to be expected";
}

}  // namespace
}  // namespace pneuma::codec
