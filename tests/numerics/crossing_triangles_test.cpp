// Shows that two triangles cross exactly when support/crossings.h says so. The predicate under it is held against
// 128-bit integers, and triangles on a grid are held against the separating-axis theorem in integers. Cases of touching
// are named one by one, and one unit in the last place decides.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "support/crossings.h"
#include "support/exact_orientation.h"

namespace pneuma::support {
namespace {

using Eigen::Vector3d;
using GridPoint = Eigen::Matrix<std::int64_t, 3, 1>;
using GridTriangle = std::array<GridPoint, 3>;
__extension__ using Wide = __int128;

GridPoint random_point(std::mt19937_64& random, std::int64_t reach) {
  std::uniform_int_distribution<std::int64_t> coordinate(-reach, reach);
  const std::int64_t x = coordinate(random);
  const std::int64_t y = coordinate(random);
  return {x, y, coordinate(random)};
}
GridTriangle random_triangle(std::mt19937_64& random, std::int64_t reach) {
  const GridPoint a = random_point(random, reach);
  const GridPoint b = random_point(random, reach);
  return {a, b, random_point(random, reach)};
}
Triangle to_double(const GridTriangle& t, double unit_m = 1.0) {
  return {t[0].cast<double>() * unit_m, t[1].cast<double>() * unit_m, t[2].cast<double>() * unit_m};
}

int orientation_in_128_bits(const GridPoint& a, const GridPoint& b, const GridPoint& c, const GridPoint& d) {
  const auto difference = [&](const GridPoint& to, int axis) { return Wide{to[axis]} - a[axis]; };
  Wide volume = 0;
  for (int x = 0; x < 3; ++x) {
    const int y = (x + 1) % 3;
    const int z = (x + 2) % 3;
    volume += difference(d, x) * (difference(b, y) * difference(c, z) - difference(b, z) * difference(c, y));
  }
  return (volume > 0) - (volume < 0);
}

/// Whether all of one triangle is at or before all of the other along the axis, one way or the other.
bool separates(const GridPoint& axis, const GridTriangle& a, const GridTriangle& b) {
  const auto [a_low, a_high] = std::minmax({axis.dot(a[0]), axis.dot(a[1]), axis.dot(a[2])});
  const auto [b_low, b_high] = std::minmax({axis.dot(b[0]), axis.dot(b[1]), axis.dot(b[2])});
  return a_high <= b_low || b_high <= a_low;
}

/// Inner points meet, out of one plane: then 0 is an inner point of the polyhedron a - b, whose sides have these
/// normals.
bool cross_by_separating_axes(const GridTriangle& a, const GridTriangle& b) {
  const GridPoint normal_a = (a[1] - a[0]).cross(a[2] - a[0]);
  const GridPoint normal_b = (b[1] - b[0]).cross(b[2] - b[0]);
  if (normal_a.isZero() || normal_b.isZero()) return false;
  if (separates(normal_a, a, b) || separates(normal_b, a, b)) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const GridPoint axis = (a[(i + 1) % 3] - a[i]).cross(b[(j + 1) % 3] - b[j]);
      if (!axis.isZero() && separates(axis, a, b)) return false;
    }
  }
  return true;
}

double up(double value) {
  return std::nextafter(value, std::numeric_limits<double>::infinity());
}
double down(double value) {
  return std::nextafter(value, -std::numeric_limits<double>::infinity());
}

TEST(ExactOrientation, AgreesWithIntegersForPointsInAPlaneAndOneUnitOffIt) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> weight(-3, 3);
  std::array<int, 3> seen{};
  for (int trial = 0; trial < 20'000; ++trial) {
    const auto [a, b, c] = random_triangle(random, std::int64_t{1} << 35);
    const std::int64_t s = weight(random);
    const GridPoint d = a + s * (b - a) + weight(random) * (c - a) + random_point(random, trial % 2);
    const int expected = orientation_in_128_bits(a, b, c, d);
    const int side = expected + 1;
    ++seen[static_cast<std::size_t>(side)];
    // With the second unit the volume loses bits to underflow, with the third it is lost.
    for (const double unit_m : {1.0, 0x1p-388, 0x1p-600, 0x1p+250}) {
      const auto at = [&](const GridPoint& point) -> Vector3d { return point.cast<double>() * unit_m; };
      ASSERT_EQ(orientation(at(a), at(b), at(c), at(d)), expected) << trial << " " << unit_m;
    }
  }
  for (const int count : seen) EXPECT_GT(count, 1'000);
}

TEST(ExactOrientation, SeesCoordinatesOfVeryUnlikeSizes) {
  const Vector3d a(0, 0, 0);
  const Vector3d b(1, 0, 0);
  const Vector3d c(0, 1, 0);
  const double smallest = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(orientation(a, b, c, {1e15, -1e15, smallest}), 1);
  EXPECT_EQ(orientation(a, b, c, {1e15, -1e15, -smallest}), -1);
  EXPECT_EQ(orientation(a, b, c, {1e15, -1e15, 0.0}), 0);
  EXPECT_EQ(orientation(a, b, b, {0.3, 0.1, 7.0}), 0);  // no plane
}

TEST(CrossingTriangles, TrianglesOnAGridAgreeWithSeparatingAxes) {
  std::mt19937_64 random(2);
  for (const std::int64_t reach : {1, 2, 4, 1'000}) {
    int crossing = 0;
    for (int trial = 0; trial < 20'000; ++trial) {
      const GridTriangle a = random_triangle(random, reach);
      const GridTriangle b = random_triangle(random, reach);
      const bool expected = cross_by_separating_axes(a, b);
      ASSERT_EQ(crosses(to_double(a), to_double(b)), expected) << reach << " " << trial;
      ASSERT_EQ(crosses(to_double(a, 0x1p-600), to_double(b, 0x1p-600)), expected) << reach << " " << trial;
      crossing += expected ? 1 : 0;
    }
    EXPECT_GT(crossing, 200) << reach;
  }
}

TEST(CrossingTriangles, TouchingTrianglesDoNotCross) {
  const Triangle floor{Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0)};
  const auto crosses_floor = [&](const Triangle& t) { return crosses(t, floor) || crosses(floor, t); };
  EXPECT_TRUE(crosses_floor({Vector3d(1, 1, -1), Vector3d(1, 1, 2), Vector3d(9, 9, 9)})) << "an edge through the face";
  EXPECT_TRUE(crosses_floor({Vector3d(1, -1, 1), Vector3d(1, -1, -1), Vector3d(1, 1, 0)})) << "a corner past the edge";
  EXPECT_TRUE(crosses_floor({Vector3d(1, 1, 0), Vector3d(1, 2, 1), Vector3d(2, 1, -1)})) << "in, from a corner in it";
  EXPECT_FALSE(crosses_floor({Vector3d(1, 1, 0), Vector3d(1, 1, 2), Vector3d(2, 1, 2)})) << "a corner on the face";
  EXPECT_FALSE(crosses_floor({Vector3d(0, 0, 0), Vector3d(-1, -1, 2), Vector3d(-1, -1, -2)})) << "corner on corner";
  EXPECT_FALSE(crosses_floor({Vector3d(1, 0, -1), Vector3d(1, 0, 1), Vector3d(1, -2, 0)})) << "edge on edge";
  EXPECT_FALSE(crosses_floor({Vector3d(1, 1, 0), Vector3d(2, 1, 0), Vector3d(1, 1, 2)})) << "an edge in the face";
  EXPECT_FALSE(crosses_floor({Vector3d(1, 1, 0), Vector3d(9, 1, 0), Vector3d(1, 9, 0)})) << "in one plane";
  EXPECT_FALSE(crosses_floor(floor));
}

TEST(CrossingTriangles, TrianglesOfZeroAreaCrossNothing) {
  const Triangle floor{Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0)};
  const Triangle needle{Vector3d(1, 1, -1), Vector3d(1, 1, 2), Vector3d(1, 1, 1)};
  const Triangle dot{Vector3d(1, 1, 0), Vector3d(1, 1, 0), Vector3d(1, 1, 0)};
  for (const Triangle& flat : {needle, dot}) {
    EXPECT_FALSE(crosses(flat, floor));
    EXPECT_FALSE(crosses(floor, flat));
    EXPECT_FALSE(crosses(flat, flat));
  }
}

TEST(CrossingTriangles, OneUnitInTheLastPlaceDecides) {
  // A tip that comes down on a face, whose height binary fractions cannot say.
  const Triangle level{Vector3d(-1, -1, 0.1), Vector3d(1, -1, 0.1), Vector3d(0, 1, 0.1)};
  const auto tip_at = [](double height_m) -> Triangle {
    return {Vector3d(0.07, 0.03, height_m), Vector3d(0, 0, 1), Vector3d(0.1, 0, 1)};
  };
  EXPECT_FALSE(crosses(level, tip_at(up(0.1))));
  EXPECT_FALSE(crosses(level, tip_at(0.1)));
  EXPECT_TRUE(crosses(level, tip_at(down(0.1))));

  // A tip in the plane x + y + z = 1.
  const Triangle slope{Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1)};
  const auto tip_on_slope = [](double z_m) -> Triangle {
    return {Vector3d(0.25, 0.25, z_m), Vector3d(3, 3, 3), Vector3d(3, 3, 2)};
  };
  EXPECT_FALSE(crosses(slope, tip_on_slope(up(0.5))));
  EXPECT_FALSE(crosses(slope, tip_on_slope(0.5)));
  EXPECT_TRUE(crosses(slope, tip_on_slope(down(0.5))));

  // A blade that comes from the side to the edge at y = -1.
  const auto blade_to = [](double y_m) -> Triangle {
    return {Vector3d(0, y_m, -1), Vector3d(0, y_m, 1), Vector3d(0, -3, 0)};
  };
  EXPECT_FALSE(crosses(level, blade_to(down(-1.0))));
  EXPECT_FALSE(crosses(level, blade_to(-1.0)));
  EXPECT_TRUE(crosses(level, blade_to(up(-1.0))));
}

}  // namespace
}  // namespace pneuma::support
