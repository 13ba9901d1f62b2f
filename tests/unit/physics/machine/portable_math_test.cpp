// Shows that the portable functions are the functions: within round-off of the C library's, over their whole range, and
// by their own identities where those are exact. That they have the same bits everywhere is in the golden values.
#include "physics/machine/portable_math.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

TEST(PortablePow, IsThePowerWithinRoundOff) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> decade(-12.0, 12.0);
  std::uniform_real_distribution<double> exponent(-3.0, 3.0);
  for (int i = 0; i < 100'000; ++i) {
    const double x = std::pow(10.0, decade(random));
    const double y = exponent(random);
    const double expected = std::pow(x, y);
    const double tolerance = (4.0 + 2.0 * std::abs(std::log(expected))) * epsilon * expected;
    ASSERT_NEAR(portable_pow(x, y), expected, tolerance) << x << "^" << y;
  }
}

TEST(PortablePow, HoldsItsEnds) {
  EXPECT_EQ(portable_pow(1.0, 0.4), 1.0);
  EXPECT_EQ(portable_pow(7.0, 0.0), 1.0);
  EXPECT_EQ(portable_pow(1e300, 2.0), HUGE_VAL);
  EXPECT_EQ(portable_pow(1e-300, 2.0), 0.0);
  EXPECT_TRUE(std::isnan(portable_pow(std::nan(""), 0.4)));
}

TEST(PortableAtan2, IsTheAngleWithinRoundOff) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
  for (int i = 0; i < 100'000; ++i) {
    const double y = coordinate(random);
    const double x = coordinate(random) * std::pow(2.0, i % 40 - 20);
    const double expected = std::atan2(y, x);
    ASSERT_NEAR(portable_atan2(y, x), expected, 8.0 * epsilon * std::max(std::abs(expected), epsilon)) << y << " " << x;
  }
  EXPECT_EQ(portable_atan2(0.0, 1.0), 0.0);
  EXPECT_EQ(portable_atan2(0.0, -1.0), std::numbers::pi);
  EXPECT_EQ(portable_atan2(-1.0, 0.0), -std::numbers::pi / 2.0);
  EXPECT_EQ(portable_atan2(0.0, 0.0), 0.0);
}

TEST(PortableSincos, AreSineAndCosine) {
  std::mt19937_64 random(3);
  for (const double range : {1e-8, 1.0, 10.0, 1e5}) {
    std::uniform_real_distribution<double> angle(-range, range);
    for (int i = 0; i < 20'000; ++i) {
      const double x = angle(random);
      const auto [sine, cosine] = portable_sincos(x);
      ASSERT_NEAR(sine, std::sin(x), 1e-15 * std::min(1.0, range)) << x;
      ASSERT_NEAR(cosine, std::cos(x), 1e-15) << x;
    }
  }
}

// The same numbers on every machine: mixed so that a bit anywhere shows.
TEST(PortableMath, HasItsGoldenBits) {
  std::uint64_t hash = 14'695'981'039'346'656'037U;
  const auto add = [&hash](double value) { hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1'099'511'628'211U; };
  for (int i = 1; i <= 1000; ++i) {
    const double x = i / 64.0;
    add(portable_pow(x, 0.4));
    add(portable_atan2(x, 7.0 - x));
    add(portable_sincos(x).sine);
    add(portable_sincos(x).cosine);
  }
  EXPECT_EQ(hash, 6121527612339479697U);
}

}  // namespace
}  // namespace pneuma::physics
