// Shows that the nearest points of features are those that a search finds which knows nothing of regions and normals,
// on features of all kinds: large, thin, parallel, without length or area, touching. That the bound of the distance is
// one; and that moves cut at their safe share never bring two features nearer than the margin, sampled along the way.
#include "physics/contact/closest.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace pneuma::physics {
namespace {

constexpr int feature_pairs = 1500;

Vec3d draw_point(std::mt19937& random, double size_m = 1.0) {
  std::uniform_real_distribution<double> coordinate(-size_m, size_m);
  const double x = coordinate(random);
  const double y = coordinate(random);
  return {x, y, coordinate(random)};
}

double draw_share(std::mt19937& random) {
  return std::uniform_real_distribution<double>(0.0, 1.0)(random);
}

/// 1 to 1e-14, evenly by its exponent; or 0.
double draw_thinness(std::mt19937& random) {
  const double exponent = 15.0 * draw_share(random);
  return exponent > 14.0 ? 0.0 : std::pow(10.0, -exponent);
}

/// A point and a face: at large, or a face about one line, with its point wherever or close to it.
FourPoints draw_vertex_face(std::mt19937& random) {
  FourPoints points{draw_point(random), draw_point(random), draw_point(random), draw_point(random)};
  auto& [p, a, b, c] = points;
  const auto kind = random() % 4;
  if (kind == 1) c = a + (3.0 * draw_share(random) - 1.0) * (b - a) + draw_thinness(random) * draw_point(random);
  if (kind == 2) c = b + draw_thinness(random) * draw_point(random);
  if (kind == 3) b = c = a;
  const double u = draw_share(random);
  const double v = draw_share(random);
  if (random() % 2 == 0) p = a + u * (b - a + v * (c - b)) + draw_thinness(random) * draw_point(random);
  return points;
}

/// Two edges: at large, near to parallel, on one line, of no length, or with their first ends in one place.
FourPoints draw_edge_edge(std::mt19937& random) {
  FourPoints points{draw_point(random), draw_point(random), draw_point(random), draw_point(random)};
  auto& [a0, a1, b0, b1] = points;
  const auto kind = random() % 6;
  const double scale = 4.0 * draw_share(random) - 2.0;
  if (kind == 1 || kind == 2) b1 = b0 + scale * (a1 - a0) + draw_thinness(random) * draw_point(random);
  if (kind == 2) {
    const Vec3d shift = draw_share(random) * (a1 - a0) + draw_thinness(random) * draw_point(random) - (b0 - a0);
    b0 += shift;
    b1 += shift;
  }
  if (kind == 3) b1 = b0 + draw_thinness(random) * draw_point(random);
  if (kind == 4) b0 = a0;
  if (kind == 5) b0 = a0 + draw_share(random) * (a1 - a0) + draw_thinness(random) * draw_point(random);
  return points;
}

FourPoints draw_features(FeaturePair pair, std::mt19937& random) {
  return pair == FeaturePair::vertex_face ? draw_vertex_face(random) : draw_edge_edge(random);
}

/// The least value of a convex function on [0, 1], by thirds.
template <class Function>
double least_on_unit(const Function& value_at) {
  double low = 0.0;
  double high = 1.0;
  for (int round = 0; round < 60; ++round) {
    const double first = low + (high - low) / 3.0;
    const double second = high - (high - low) / 3.0;
    if (value_at(first) < value_at(second)) {
      high = second;
    } else {
      low = first;
    }
  }
  return std::min({value_at(0.0), value_at(0.5 * (low + high)), value_at(1.0)});
}

double searched_distance_m(FeaturePair pair, const FourPoints& points) {
  const double squared_m2 = least_on_unit([&](double u) {
    return least_on_unit([&](double v) {
      const auto& [p, a, b, c] = points;
      if (pair == FeaturePair::vertex_face) return (a + u * (b - a + v * (c - b)) - p).squaredNorm();
      return (p + u * (a - p) - b - v * (c - b)).squaredNorm();
    });
  });
  return std::sqrt(squared_m2);
}

FourPoints moved(const FourPoints& start, const FourPoints& moves, double share) {
  FourPoints points = start;
  for (std::size_t i = 0; i < 4; ++i) points[i] += share * moves[i];
  return points;
}

// Edges nearer to parallel than 1e-6 are measured from their ends: up to so much of their length too far.
constexpr double parallel_error_m = 4e-6;

class Features : public testing::TestWithParam<FeaturePair> {};
INSTANTIATE_TEST_SUITE_P(OfBothKinds, Features, testing::Values(FeaturePair::vertex_face, FeaturePair::edge_edge));

TEST_P(Features, AreAsFarApartAsASearchFinds) {
  std::mt19937 random(1);
  for (int i = 0; i < feature_pairs; ++i) {
    const FourPoints points = draw_features(GetParam(), random);
    ASSERT_NEAR(distance_m(GetParam(), points), searched_distance_m(GetParam(), points), parallel_error_m) << i;
  }
}

TEST_P(Features, AreNoNearerThanTheBound) {
  std::mt19937 random(2);
  for (int i = 0; i < 100 * feature_pairs; ++i) {
    const FourPoints points = draw_features(GetParam(), random);
    ASSERT_LE(distance_bound_m(GetParam(), points), distance_m(GetParam(), points) + 1e-9) << i;
  }
}

TEST_P(Features, HaveABoundThatIsMostlyTheDistance) {
  std::mt19937 random(3);
  int close = 0;
  for (int i = 0; i < feature_pairs; ++i) {
    FourPoints points;
    for (Vec3d& point : points) point = draw_point(random);
    close += distance_bound_m(GetParam(), points) > 0.5 * distance_m(GetParam(), points) ? 1 : 0;
  }
  EXPECT_GT(close, feature_pairs * 9 / 10);
}

TEST_P(Features, StayAtLeastTheMarginApartUpToTheSafeShare) {
  std::mt19937 random(4);
  int cut = 0;
  for (int i = 0; i < feature_pairs; ++i) {
    const FourPoints start = draw_features(GetParam(), random);
    const double size_m = std::pow(10.0, 2.0 - 4.0 * draw_share(random));
    FourPoints moves;
    for (Vec3d& move : moves) move = draw_point(random, size_m);
    const double margin_m = (0.01 + 0.98 * draw_share(random)) * distance_m(GetParam(), start);
    if (margin_m < 1e-6) continue;
    const double share = safe_share(GetParam(), start, moves, margin_m);
    ASSERT_GE(share, 0.0);
    ASSERT_LE(share, 1.0);
    cut += share < 1.0 ? 1 : 0;
    constexpr int samples = 200;
    for (int k = 0; k <= samples; ++k) {
      const double at_m = distance_m(GetParam(), moved(start, moves, share * k / samples));
      ASSERT_GE(at_m, margin_m - 1e-8) << i << ", sample " << k;
    }
  }
  EXPECT_GT(cut, feature_pairs / 8);  // else the samples show nothing
}

// Sixty-four advances of a tenth of the way each are more than enough.
TEST_P(Features, MoveAllTheWayWhereTheyNeverComeNear) {
  std::mt19937 random(5);
  int clear = 0;
  for (int i = 0; i < feature_pairs; ++i) {
    const FourPoints start = draw_features(GetParam(), random);
    FourPoints moves;
    for (Vec3d& move : moves) move = draw_point(random, 2.0 * draw_share(random));
    const double margin_m = 0.01;
    double least_m = distance_m(GetParam(), start);
    for (int k = 0; k <= 100; ++k) least_m = std::min(least_m, distance_m(GetParam(), moved(start, moves, 0.01 * k)));
    if (least_m < margin_m + 0.1 * largest_relative_move_m(GetParam(), moves)) continue;
    ++clear;
    ASSERT_EQ(safe_share(GetParam(), start, moves, margin_m), 1.0) << i;
  }
  EXPECT_GT(clear, feature_pairs / 20);
}

TEST_P(Features, ThatMoveAsOneMoveAllTheWay) {
  std::mt19937 random(6);
  for (int i = 0; i < feature_pairs; ++i) {
    const FourPoints start = draw_features(GetParam(), random);
    const Vec3d move = draw_point(random, 1e3);
    ASSERT_EQ(safe_share(GetParam(), start, {move, move, move, move}, 0.9 * distance_m(GetParam(), start)), 1.0);
  }
}

TEST(NearestOfFace, SharesSumToOneAndMakeUpThePointAtTheDistance) {
  std::mt19937 random(7);
  for (int i = 0; i < feature_pairs; ++i) {
    const auto [p, a, b, c] = draw_vertex_face(random);
    const FacePoint nearest = nearest_of_face(p, a, b, c);
    for (const double weight : nearest.weights) ASSERT_GE(weight, 0.0);
    ASSERT_NEAR(nearest.weights[0] + nearest.weights[1] + nearest.weights[2], 1.0, 1e-12);
    const Vec3d point = nearest.weights[0] * a + nearest.weights[1] * b + nearest.weights[2] * c;
    ASSERT_NEAR((p - point).norm(), nearest.distance_m, 1e-6) << i;
  }
}

TEST(NearestOfFace, NamesTheCornersThatItLiesBetween) {
  const Vec3d a(0, 0, 0);
  const Vec3d b(1, 0, 0);
  const Vec3d c(0, 1, 0);
  EXPECT_EQ(nearest_of_face({0.2, 0.3, 5}, a, b, c).corners(), 7U);
  EXPECT_EQ(nearest_of_face({0.5, -1, 5}, a, b, c).corners(), 3U);
  EXPECT_EQ(nearest_of_face({1, 1, 5}, a, b, c).corners(), 6U);
  EXPECT_EQ(nearest_of_face({-1, 0.5, 5}, a, b, c).corners(), 5U);
  EXPECT_EQ(nearest_of_face({-1, -1, 5}, a, b, c).corners(), 1U);
  EXPECT_EQ(nearest_of_face({2, 0, 5}, a, b, c).corners(), 2U);
  EXPECT_EQ(nearest_of_face({0, 2, 5}, a, b, c).corners(), 4U);
}

TEST(NearestOfEdges, IsTheSameForTheTwoSwapped) {
  std::mt19937 random(8);
  for (int i = 0; i < feature_pairs; ++i) {
    const auto [a0, a1, b0, b1] = draw_edge_edge(random);
    const EdgePoints one = nearest_of_edges(a0, a1, b0, b1);
    const EdgePoints other = nearest_of_edges(b0, b1, a0, a1);
    ASSERT_NEAR(one.distance_m, other.distance_m, 1e-9) << i;
    const Vec3d apart = a0 + one.along_first * (a1 - a0) - b0 - one.along_second * (b1 - b0);
    ASSERT_NEAR(apart.norm(), one.distance_m, 1e-9) << i;
    const bool is_clear_cut = (a1 - a0).cross(b1 - b0).norm() > 1e-3 * (a1 - a0).norm() * (b1 - b0).norm();
    if (!is_clear_cut || !one.within_both) continue;
    ASSERT_TRUE(other.within_both) << i;
    ASSERT_NEAR(one.along_first, other.along_second, 1e-7) << i;
    ASSERT_NEAR(one.along_second, other.along_first, 1e-7) << i;
  }
}

// At height h above, coming down by more: all but the margin, and of that no more than its twentieth.
TEST(SafeShare, OfAFallOnAFaceEndsAtTheMargin) {
  const double height_m = 0.7;
  const double move_m = 3.0;
  const double margin_m = 0.01;
  const Vec3d down(0, 0, -move_m);
  const Vec3d still = Vec3d::Zero();
  const FourPoints start{Vec3d(0.2, 0.3, height_m), Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0, 1, 0)};
  const double share = safe_share(FeaturePair::vertex_face, start, {down, still, still, still}, margin_m);
  EXPECT_LE(share, (height_m - margin_m) / move_m);
  EXPECT_GE(share, (height_m - 1.05 * margin_m) / move_m - 1e-12);
}

}  // namespace
}  // namespace pneuma::physics
