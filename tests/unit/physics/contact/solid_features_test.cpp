// Shows that an edge touches a solid between its ends where samples of it say so, and a face a knob where the foot is.
#include "physics/contact/solid_features.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

class Draw {
 public:
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 8U) / static_cast<double>(1U << 24U);
  }
  Vec3d point(double reach_m) {
    Vec3d at;
    for (double& part : at) part = between(-reach_m, reach_m);
    return at;
  }

 private:
  std::mt19937 random_{7};
};

TEST(SolidFeatures, AnEdgeTouchesWhereItIsDeepest) {
  const std::vector<Shape> shapes{BoxShape{{0.5, 0.2, 0.3}}, SphereShape{0.4}, CapsuleShape{0.2, 0.3},
                                  EllipsoidShape{{0.5, 0.2, 0.3}}};
  Draw draw;
  int touches = 0;
  for (int i = 0; i < 4'000; ++i) {
    const Shape& shape = shapes[static_cast<std::size_t>(i) % shapes.size()];
    const Vec3d first = draw.point(0.9);
    const Vec3d second = first + draw.point(0.6);
    constexpr double offset_m = 0.0;  // with one, the deepest is told by the shape without
    const SurfacePoint of_first = nearest_surface(shape, first, offset_m);
    const SurfacePoint of_second = nearest_surface(shape, second, offset_m);
    const double ends_m = std::min(of_first.distance_m, of_second.distance_m);
    double deepest_m = ends_m;
    for (int k = 1; k < 200; ++k) {
      const Vec3d at = first + k / 200.0 * (second - first);
      deepest_m = std::min(deepest_m, nearest_surface(shape, at, offset_m).distance_m);
    }
    constexpr double slack_m = 0.003;
    const auto touch = touch_of_edge(shape, offset_m, first, of_first, second, of_second, slack_m, 10.0);
    if (touch) {
      ++touches;
      EXPECT_NEAR(touch->of_solid.distance_m, deepest_m, 0.003);
      EXPECT_LT(touch->of_solid.distance_m, ends_m - slack_m);
      EXPECT_GT(touch->share, 0.0);
      EXPECT_LT(touch->share, 1.0);
    } else if (ends_m > 0.0 && of_first.normal.dot(of_second.normal) > -0.99) {
      EXPECT_GT(deepest_m, ends_m - slack_m - 1e-4);
    }
  }
  EXPECT_GT(touches, 200);
}

TEST(SolidFeatures, AnEdgeFarAwayOrWithAnEndInsideDoesNot) {
  const Shape box = BoxShape{{0.5, 0.5, 0.5}};
  const auto touch = [&](const Vec3d& first, const Vec3d& second, double near_m) {
    return touch_of_edge(box, 0.0, first, nearest_surface(box, first, 0.0), second, nearest_surface(box, second, 0.0),
                         0.003, near_m);
  };
  const Vec3d over{0.2, 0.7, 0.0};
  const Vec3d beside{0.7, 0.2, 0.0};
  ASSERT_TRUE(touch(over, beside, 0.1).has_value());  // it cuts the rim off
  EXPECT_NEAR(touch(over, beside, 0.1)->share, 0.5, 1e-3);
  EXPECT_FALSE(touch(over + Vec3d(0.4, 0.4, 0.0), beside + Vec3d(0.4, 0.4, 0.0), 0.1).has_value());
  EXPECT_FALSE(touch({0.3, 0.4, 0.0}, beside, 0.1).has_value());
}

TEST(SolidFeatures, AFaceKeepsOffAKnobAlongItsNormal) {
  Draw draw;
  int touches = 0;
  for (int i = 0; i < 2'000; ++i) {
    const Vec3d a = draw.point(1.0);
    const Vec3d b = draw.point(1.0);
    const Vec3d c = draw.point(1.0);
    const Vec3d knob = (a + b + c) / 3.0 + draw.point(0.3);
    const bool along_normal = i % 2 == 0;
    const auto touch = touch_of_face(knob, a, b, c, along_normal, 0.1);
    if (!touch) continue;
    ++touches;
    // The foot is on the line through the knob along the normal, and shares its side.
    const Vec3d foot = touch->foot.weights[0] * a + touch->foot.weights[1] * b + touch->foot.weights[2] * c;
    EXPECT_NEAR((foot - knob).cross(touch->normal).norm(), 0.0, 1e-9);
    EXPECT_GT((foot - knob).dot(touch->normal), -0.1 - 1e-12);
    EXPECT_EQ(touch->normal.dot((b - a).cross(c - a)) > 0.0, along_normal);
  }
  EXPECT_GT(touches, 300);
}

}  // namespace
}  // namespace pneuma::physics
