// Shows that surfaces are where they should be: distances against closed forms, the nearest point of an ellipsoid by
// its definition (on the surface, and the way to it along the normal), and moving points stopped where they must be.
#include "physics/scene/shape.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "physics/scene/shape_entry.h"

namespace pneuma::physics {
namespace {

constexpr double skin_m = 1e-10;

void expect_near(const Vec3d& a, const Vec3d& b, double bound) {
  EXPECT_LT((a - b).norm(), bound) << a.transpose() << " is not " << b.transpose();
}

TEST(Shape, PlaneDistance) {
  const PlaneShape plane{Vec3d(3, 4, 0) / 5.0};
  EXPECT_DOUBLE_EQ(surface_distance(plane, {3, 4, 7}), 5.0);
  EXPECT_DOUBLE_EQ(surface_distance(plane, {-3, -4, 7}), -5.0);
  EXPECT_DOUBLE_EQ(surface_distance(plane, {3, 4, 7}, 0.5), 4.5);
}

TEST(Shape, SphereDistance) {
  const SurfacePoint outside = nearest_surface(SphereShape{2.0}, {0, 3, 4});
  EXPECT_DOUBLE_EQ(outside.distance_m, 3.0);
  expect_near(outside.normal, {0, 0.6, 0.8}, 1e-15);
  expect_near(outside.point, {0, 1.2, 1.6}, 1e-15);
  EXPECT_DOUBLE_EQ(surface_distance(SphereShape{2.0}, {0.5, 0, 0}), -1.5);
}

TEST(Shape, BoxDistance) {
  const BoxShape box{{1, 2, 3}};
  EXPECT_DOUBLE_EQ(surface_distance(box, {4, 6, 0}), 5.0);  // from an edge
  EXPECT_DOUBLE_EQ(surface_distance(box, {0, 0, 5}), 2.0);
  const SurfacePoint inside = nearest_surface(box, {0.9, 0, 0});
  EXPECT_NEAR(inside.distance_m, -0.1, 1e-15);
  expect_near(inside.normal, Vec3d::UnitX(), 1e-15);
  expect_near(inside.point, {1, 0, 0}, 1e-15);
}

TEST(Shape, RoomIsABoxSeenFromInside) {
  const RoomShape room{{1, 2, 3}};
  const SurfacePoint inside = nearest_surface(room, {0, -1.75, 0});
  EXPECT_NEAR(inside.distance_m, 0.25, 1e-15);
  expect_near(inside.normal, Vec3d::UnitY(), 1e-15);
  expect_near(inside.point, {0, -2, 0}, 1e-15);
  EXPECT_DOUBLE_EQ(surface_distance(room, {0, 0, 5}), -2.0);
  EXPECT_DOUBLE_EQ(surface_distance(room, Vec3d::Zero(), 0.25), 0.75);
}

TEST(Shape, CapsuleDistance) {
  const CapsuleShape capsule{0.5, 2.0};
  EXPECT_DOUBLE_EQ(surface_distance(capsule, {2, 1, 0}), 1.5);
  EXPECT_DOUBLE_EQ(surface_distance(capsule, {3, 6, 0}), 4.5);
  EXPECT_DOUBLE_EQ(surface_distance(capsule, {0, 1, 0}), -0.5);
}

// For p off the surface by d along its normal at q, the nearest point is q as long as d stays within the curvature.
TEST(Shape, EllipsoidNearestPointIsFoundAlongTheNormal) {
  for (const Vec3d& radii : {Vec3d(1, 1, 1), Vec3d(3, 2, 1), Vec3d(10, 1, 0.1)}) {
    for (const double latitude : {-1.4, -0.6, 0.0, 0.3, 1.2}) {
      for (const double longitude : {0.1, 1.0, 2.5, 4.0}) {
        const Vec3d unit(std::cos(latitude) * std::cos(longitude), std::sin(latitude),
                         std::cos(latitude) * std::sin(longitude));
        const Vec3d q = radii.cwiseProduct(unit);
        const Vec3d normal = q.cwiseQuotient(radii.cwiseProduct(radii)).normalized();
        const double least_curvature_radius = radii.minCoeff() * radii.minCoeff() / radii.maxCoeff();
        for (const double distance : {2.0, 0.01, -0.5 * least_curvature_radius}) {
          const SurfacePoint nearest = nearest_surface(EllipsoidShape{radii}, q + distance * normal);
          EXPECT_NEAR(nearest.distance_m, distance, 1e-9) << radii.transpose();
          expect_near(nearest.point, q, 1e-8);
          expect_near(nearest.normal, normal, 1e-6);
        }
      }
    }
  }
}

TEST(Shape, EllipsoidCentreIsAsDeepAsTheLeastRadius) {
  EXPECT_NEAR(surface_distance(EllipsoidShape{{3, 2, 1}}, Vec3d::Zero()), -1.0, 1e-9);
}

TEST(Shape, HalfExtentsHoldTheShape) {
  expect_near(half_extents_m(CapsuleShape{0.5, 2.0}), {0.5, 2.5, 0.5}, 1e-15);
  expect_near(half_extents_m(EllipsoidShape{{3, 2, 1}}), {3, 2, 1}, 1e-15);
  EXPECT_TRUE(std::isinf(half_extents_m(RoomShape{{1, 1, 1}}).x()));
}

// A point shot through each thin solid is stopped at the near side.
TEST(Shape, FastPointIsStoppedAtTheNearSide) {
  const Vec3d start(0.001, 5, 0.002);
  const Vec3d end(0.001, -95, 0.002);
  const std::array<Shape, 5> shapes{PlaneShape{}, SphereShape{0.01}, BoxShape{{1, 0.001, 1}},
                                    EllipsoidShape{{1, 0.001, 1}}, CapsuleShape{0.01, 0.02}};
  for (const Shape& shape : shapes) {
    const auto hit = first_hit(shape, start, end, 0.0, skin_m);
    ASSERT_TRUE(hit.has_value()) << shape.index();
    EXPECT_NEAR(surface_distance(shape, hit->point), 0.0, 1e-9) << shape.index();
    EXPECT_NEAR(hit->fraction, (5.0 - hit->point.y()) / 100.0, 1e-9) << shape.index();
    EXPECT_GT(hit->normal.y(), 0.9) << shape.index();
  }
}

TEST(Shape, PointThatPassesByIsNotStopped) {
  EXPECT_FALSE(first_hit(SphereShape{1.0}, {-5, 1.001, 0}, {5, 1.001, 0}, 0.0, skin_m).has_value());
  EXPECT_TRUE(first_hit(SphereShape{1.0}, {-5, 1.001, 0}, {5, 1.001, 0}, 0.01, skin_m).has_value());
  EXPECT_FALSE(first_hit(BoxShape{{1, 1, 1}}, {-5, 1.001, 0}, {5, 1.001, 0}, 0.0, skin_m).has_value());
  EXPECT_FALSE(first_hit(CapsuleShape{1.0, 1.0}, {-5, 2.001, 0}, {5, 2.001, 0}, 0.0, skin_m).has_value());
}

TEST(Shape, PointOnItsWayOutIsLetGo) {
  EXPECT_FALSE(first_hit(BoxShape{{1, 1, 1}}, {0, 0.99, 0}, {0, 1.5, 0}, 0.0, skin_m).has_value());
  const auto stopped = first_hit(BoxShape{{1, 1, 1}}, {0, 0.99, 0}, {0, -9.0, 0}, 0.0, skin_m);
  ASSERT_TRUE(stopped.has_value());
  expect_near(stopped->point, {0, 1, 0}, 1e-12);
}

TEST(Shape, RoomStopsAtTheFirstWall) {
  const auto hit = first_hit(RoomShape{{1, 1, 1}}, Vec3d::Zero(), {4, 2, 0}, 0.0, skin_m);
  ASSERT_TRUE(hit.has_value());
  EXPECT_DOUBLE_EQ(hit->fraction, 0.25);
  expect_near(hit->normal, -Vec3d::UnitX(), 1e-15);
  expect_near(hit->point, {1, 0.5, 0}, 1e-15);
}

TEST(Shape, FrameGoesThereAndBack) {
  const Frame frame({1, 2, 3}, Quatd(Eigen::AngleAxisd(0.7, Vec3d(1, 2, 2).normalized())));
  expect_near(frame.to_world(frame.to_local({4, 5, 6})), {4, 5, 6}, 1e-14);
}

TEST(Shape, VelocityOfATurningSurface) {
  expect_near(velocity_at({1, 0, 0}, {0, 0, 2}, {0, 3, 0}), {-5, 0, 0}, 1e-15);
}

}  // namespace
}  // namespace pneuma::physics
