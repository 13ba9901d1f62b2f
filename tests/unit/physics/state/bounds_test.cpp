// Shows that the bounding volumes are what they say, by clouds whose boxes, balls and ellipsoids are known beforehand.
#include "physics/state/bounds.h"

#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "physics/mesh/mesh.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

using std::numbers::pi;

// The six points where an ellipsoid of these radii meets its axes.
std::vector<Vec3d> axis_points(const Vec3d& centre, const Vec3d& radii) {
  std::vector<Vec3d> points;
  for (int k = 0; k < 3; ++k) {
    points.emplace_back(centre + radii[k] * Vec3d::Unit(k));
    points.emplace_back(centre - radii[k] * Vec3d::Unit(k));
  }
  return points;
}

TEST(Bounds, BoxOfAxisPoints) {
  const std::vector<Vec3d> points = axis_points({1, 2, 3}, {2, 3, 4});
  const Aabb<double> box = fit_aabb<double>(points);
  EXPECT_EQ(box.min, Vec3d(-1, -1, -1));
  EXPECT_EQ(box.max, Vec3d(3, 5, 7));
  EXPECT_DOUBLE_EQ(volume_m3(box), 4.0 * 6.0 * 8.0);
}

TEST(Bounds, BallReachesFromTheMeanToTheFurthest) {
  const Ball<double> ball = fit_ball<double>(axis_points({1, 2, 3}, {2, 3, 4}));
  EXPECT_LT((ball.centre - Vec3d(1, 2, 3)).norm(), 1e-14);
  EXPECT_DOUBLE_EQ(ball.radius_m, 4.0);
  EXPECT_DOUBLE_EQ(volume_m3(ball), 4.0 / 3.0 * pi * 64.0);
}

TEST(Bounds, EllipsoidOfAxisPoints) {
  const Ellipsoid<double> ellipsoid = fit_ellipsoid<double>(axis_points({1, 2, 3}, {2, 3, 4}));
  EXPECT_EQ(ellipsoid.centre, Vec3d(1, 2, 3));
  EXPECT_EQ(ellipsoid.radii_m, Vec3d(2, 3, 4));
  EXPECT_DOUBLE_EQ(volume_m3(ellipsoid), 4.0 / 3.0 * pi * 24.0);
}

TEST(Bounds, SinglePrecisionAgrees) {
  std::vector<Vec3<float>> points;
  for (const Vec3d& p : axis_points({1, 2, 3}, {2, 3, 4})) points.push_back(p.cast<float>());
  EXPECT_FLOAT_EQ(volume_m3(fit_aabb<float>(points)), 192.0F);
  EXPECT_FLOAT_EQ(volume_m3(fit_ball<float>(points)), static_cast<float>(4.0 / 3.0 * pi * 64.0));
  EXPECT_FLOAT_EQ(volume_m3(fit_ellipsoid<float>(points)), static_cast<float>(32.0 * pi));
}

// The paper's claim (section 3.1): of the three, the ellipsoid has the best properties.
TEST(Bounds, EllipsoidIsNearestToTheVolumeOfASqueezedBall) {
  const auto mesh = make_icosphere(3, 1.0);
  ASSERT_TRUE(mesh.ok());
  std::vector<Vec3d> points = (*mesh)->positions_m;
  for (Vec3d& p : points) p.y() *= 0.5;
  const double exact = signed_volume_m3(points, (*mesh)->faces);
  const double ellipsoid = volume_m3(fit_ellipsoid<double>(points));
  EXPECT_LT(std::abs(ellipsoid - exact), 0.03 * exact);
  EXPECT_LT(std::abs(ellipsoid - exact), std::abs(volume_m3(fit_ball<double>(points)) - exact));
  EXPECT_LT(std::abs(ellipsoid - exact), std::abs(volume_m3(fit_aabb<double>(points)) - exact));
}

}  // namespace
}  // namespace pneuma::physics
