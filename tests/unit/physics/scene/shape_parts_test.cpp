// Shows that a shape which lacks a part does not compile, and that what each shape that a rigid body may have says of
// its size agrees: its box, its radius, its knobs and where a ray meets it.
#include "physics/scene/shape_parts.h"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "unit/physics/mesh/convex_meshes.h"

namespace pneuma::physics {

// Spheres, each of which hides a part by something that is none.
struct LacksNearest {};
struct LacksFirstHit {};
struct LacksExtents {};
struct LacksHit {};
struct LacksSurface {};
struct LacksRigid {};
struct LacksKnobs {};
struct LacksNothing {};

struct AnyShapeParts {
  template <class S>
  static SurfacePoint nearest(const S&, const Vec3d&, double);
  template <class S>
  static std::optional<double> hit_m(const S&, const Ray&);
  static constexpr None first_hit{"not asked"};
  template <class S>
  static Vec3d half_extents_m(const S&);
  static constexpr bool is_surface = false;
  static constexpr None rigid{"not asked"};
};
template <>
struct ShapeParts<LacksNothing> : AnyShapeParts {};
template <>
struct ShapeParts<LacksNearest> : AnyShapeParts {
  static constexpr int nearest = 0;
};
template <>
struct ShapeParts<LacksFirstHit> : AnyShapeParts {
  static constexpr int first_hit = 0;
};
template <>
struct ShapeParts<LacksHit> : AnyShapeParts {
  static constexpr int hit_m = 0;
};
template <>
struct ShapeParts<LacksExtents> : AnyShapeParts {
  static constexpr int half_extents_m = 0;
};
template <>
struct ShapeParts<LacksSurface> : AnyShapeParts {
  static constexpr int is_surface = 0;
};
template <>
struct ShapeParts<LacksRigid> : AnyShapeParts {
  static constexpr int rigid = 0;
};
template <>
struct ShapeParts<LacksKnobs> : AnyShapeParts {
  struct Rigid : ShapeParts<SphereShape>::Rigid {
    static constexpr int knobs = 0;
  };
  static constexpr Rigid rigid{};
};

namespace {

struct UnknownShape {};
static_assert(SolidShape<LacksNothing>);
static_assert(!SolidShape<UnknownShape> && !SolidShape<LacksNearest> && !SolidShape<LacksFirstHit> &&
              !SolidShape<LacksExtents> && !SolidShape<LacksHit> && !SolidShape<LacksSurface> &&
              !SolidShape<LacksRigid> && !SolidShape<LacksKnobs>);

class RigidShape : public testing::TestWithParam<Shape> {};

TEST_P(RigidShape, SaysOneSizeInAllItsParts) {
  const Shape& shape = GetParam();
  ASSERT_TRUE(may_be_rigid(shape));
  std::visit(
      [&]<class S>(const S& one) {
        if constexpr (!shape_parts::NoRigid<S>) {
          const auto& rigid = ShapeParts<S>::rigid;
          const Vec3d half_m = half_extents_m(shape);
          const double radius_m = rigid.radius_m(one);
          EXPECT_TRUE(rigid.half_box_m(one, Eigen::Matrix3d::Identity()).isApprox(half_m, 1e-14));
          EXPECT_GE(radius_m, half_m.maxCoeff() - 1e-14);
          EXPECT_LE(radius_m, half_m.norm() + 1e-14);
          for (int axis = 0; axis < 3; ++axis) {
            const Vec3d direction = Vec3d::Unit(axis);
            const auto hit_m = surface_hit_m(shape, {10.0 * direction, -direction});
            ASSERT_TRUE(hit_m.has_value());
            EXPECT_NEAR(*hit_m, 10.0 - half_m[axis], 1e-12);
            EXPECT_NEAR(surface_distance(shape, 10.0 * direction), *hit_m, 1e-12);
            const auto entered = first_hit(shape, 10.0 * direction, Vec3d::Zero(), 0.0, 0.0);
            ASSERT_TRUE(entered.has_value());
            EXPECT_NEAR(entered->fraction, *hit_m / 10.0, 1e-12);
          }
          const Knobs knobs = rigid.knobs(one);
          ASSERT_GT(knobs.count, 0U);
          for (std::size_t i = 0; i < knobs.count; ++i) {
            EXPECT_NEAR(surface_distance(shape, knobs.centres[i]), -knobs.radius_m, 1e-12)
                << "each touches the surface";
            EXPECT_LE(knobs.centres[i].norm() + knobs.radius_m, radius_m + 1e-12);
          }
          const Vec3d inertia = rigid.principal_inertia_kg_m2(one, 2.0);
          EXPECT_GT(inertia.minCoeff(), 0.0);
          EXPECT_LT(inertia.maxCoeff(), 2.0 * radius_m * radius_m) << "no mass is further out than the radius";
        }
      },
      shape);
}

INSTANTIATE_TEST_SUITE_P(OfScenes, RigidShape,
                         testing::Values(Shape(SphereShape{0.7}), Shape(BoxShape{{0.5, 1.0, 2.0}}),
                                         Shape(CapsuleShape{.radius_m = 0.3, .half_height_m = 0.8}),
                                         Shape(convex(octahedron(0.9))),
                                         Shape(convex(built(make_box({0.5, 1.0, 2.0}, 2))))));

TEST(ShapeParts, OnlyBallsBoxesCapsulesAndConvexMeshesMayBeRigid) {
  EXPECT_FALSE(may_be_rigid(PlaneShape{}));
  EXPECT_FALSE(may_be_rigid(EllipsoidShape{}));
  EXPECT_FALSE(may_be_rigid(RoomShape{}));
  EXPECT_FALSE(may_be_rigid(MeshShape{}));
  EXPECT_TRUE(may_be_rigid(ConvexShape{}));
  EXPECT_TRUE(is_surface(MeshShape{}));
  EXPECT_FALSE(is_surface(RoomShape{}));
}

}  // namespace
}  // namespace pneuma::physics
