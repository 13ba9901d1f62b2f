// Shows that the bounds of every instruction set are bounds, on features of all sizes, shapes and distances: never
// above the distance that double precision finds, never negative, always finite. That all instruction sets give the
// same bits, and that on features of good shape the bound is nearly the distance.
#include "physics/contact/bound_kernels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "physics/contact/closest.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {
namespace {

constexpr std::size_t bounded_pairs = 40'000;

/// Features, their sizes and their distances, at random.
class FeatureDraw {
 public:
  explicit FeatureDraw(unsigned seed) : random_(seed) {}

  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  /// Evenly by the exponent.
  double power_of_ten(double low, double high) { return std::pow(10.0, between(low, high)); }
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(random_() % count); }
  Vec3d point(double size_m) {
    const double x = between(-size_m, size_m);
    const double y = between(-size_m, size_m);
    return {x, y, between(-size_m, size_m)};
  }
  Vec3d direction() {
    Vec3d at = point(1.0);
    while (at.norm() < 0.1 || at.norm() > 1.0) at = point(1.0);
    return at.normalized();
  }
  /// 1 to 1e-12, or 0.
  double thinness() {
    const double share = power_of_ten(-13.0, 0.0);
    return share < 1e-12 ? 0.0 : share;
  }

  /// A point and a face of any shape.
  FourPoints vertex_face() {
    const double size_m = power_of_ten(-4.0, 3.0);
    FourPoints points{Vec3d::Zero(), point(size_m), point(size_m), point(size_m)};
    auto& [p, a, b, c] = points;
    const auto shape = below(6);
    if (shape == 1) c = a + between(-1.0, 2.0) * (b - a) + thinness() * point(size_m);  // a sliver, or a line
    if (shape == 2) c = b + thinness() * point(size_m);                                 // a needle
    if (shape == 3) b = a + thinness() * point(size_m);                                 // a needle at the first corner
    if (shape == 4 && below(4) == 0) b = c = a;                                         // a point
    const double u = between(-0.2, 1.2);
    const double v = between(-0.2, 1.2);
    p = a + u * (b - a + v * (c - b)) + gap(size_m);
    if (below(20) == 0) p = points[1 + below(3)];
    shuffle_corners(points);
    return points;
  }

  /// Two edges of any lengths and at any angle.
  FourPoints edge_edge() {
    const double size_m = power_of_ten(-4.0, 3.0);
    const double other_m = below(2) == 0 ? size_m : power_of_ten(-4.0, 3.0);
    FourPoints points{point(size_m), point(size_m), point(other_m), point(other_m)};
    auto& [a0, a1, b0, b1] = points;
    const auto shape = below(6);
    if (shape == 1) b1 = b0 + between(-2.0, 2.0) * (a1 - a0) + thinness() * point(size_m);  // parallel, or nearly
    if (shape == 2) b1 = b0 + thinness() * point(other_m);                                  // hardly an edge
    if (shape == 3 && below(4) == 0) a1 = a0;                                               // none
    const Vec3d shift = a0 + between(-0.2, 1.2) * (a1 - a0) + gap(size_m) - b0 - between(-0.2, 1.2) * (b1 - b0);
    b0 += shift;
    b1 += shift;
    if (below(20) == 0) b0 = a0;
    if (below(50) == 0) b1 = a1;
    return points;
  }

  FourPoints features(FeaturePair pair) { return pair == FeaturePair::vertex_face ? vertex_face() : edge_edge(); }

  /// Of edges of like lengths that meet at no small angle, up to ten of their lengths apart.
  FourPoints well_shaped(FeaturePair pair) {
    const double size_m = power_of_ten(-4.0, 3.0);
    const Vec3d first = direction();
    Vec3d second = direction();
    while (first.cross(second).norm() < 0.5) second = direction();
    const Vec3d apart = power_of_ten(-1.0, 1.0) * direction();
    const double u = between(0.0, 1.0);
    FourPoints points{apart, -u * first, (1.0 - u) * first, second - u * first};
    if (pair == FeaturePair::edge_edge) points = {apart, apart + second, -u * first, (1.0 - u) * first};
    for (Vec3d& at : points) at *= size_m;
    return points;
  }

 private:
  /// None, or one of any size.
  Vec3d gap(double size_m) {
    if (below(10) == 0) return Vec3d::Zero();
    return size_m * (below(4) == 0 ? power_of_ten(0.0, 9.0) : power_of_ten(-9.0, 1.0)) * direction();
  }
  void shuffle_corners(FourPoints& points) {
    std::rotate(points.begin() + 1, points.begin() + 1 + below(3), points.end());
    if (below(2) == 0) std::swap(points[2], points[3]);
  }

  std::mt19937 random_;
};

std::vector<float> bounds_of(Isa isa, FeaturePair pair, std::span<const FourPoints> features) {
  constexpr std::size_t width = FeatureBlock::width;
  std::vector<FeatureBlock> blocks((features.size() + width - 1) / width);
  for (std::size_t i = 0; i < blocks.size() * width; ++i) {
    const FourPoints& at = features[std::min(i, features.size() - 1)];
    for (std::size_t point = 0; point < 3; ++point) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        blocks[i / width].points[3 * point + axis][i % width] = static_cast<float>(at[point + 1][a] - at[0][a]);
      }
    }
  }
  std::vector<float> bounds_m(blocks.size() * width, -1.0F);
  const BoundKernels& kernels = bound_kernels(isa);
  (pair == FeaturePair::vertex_face ? kernels.vertex_face : kernels.edge_edge)(blocks.data(), blocks.size(),
                                                                               bounds_m.data());
  bounds_m.resize(features.size());
  return bounds_m;
}

std::vector<FourPoints> draw_all(std::size_t count, const std::function<FourPoints()>& draw) {
  std::vector<FourPoints> features(count);
  std::ranges::generate(features, draw);
  return features;
}

struct BoundCase {
  Isa isa = Isa::baseline;
  FeaturePair pair = FeaturePair::vertex_face;
};

class LaneBounds : public testing::TestWithParam<BoundCase> {
 protected:
  void SetUp() override {
    if (!has_isa(GetParam().isa)) GTEST_SKIP() << "not on this processor";
  }
};

TEST_P(LaneBounds, AreNeverAboveTheDistance) {
  const auto [isa, pair] = GetParam();
  FeatureDraw draw(1);
  const std::vector<FourPoints> features = draw_all(bounded_pairs, [&, of = pair] { return draw.features(of); });
  const std::vector<float> bounds_m = bounds_of(isa, pair, features);
  std::size_t told = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    ASSERT_TRUE(std::isfinite(bounds_m[i])) << i;
    ASSERT_GE(bounds_m[i], 0.0F) << i;
    ASSERT_LE(static_cast<double>(bounds_m[i]), distance_m(pair, features[i])) << i;
    told += bounds_m[i] > 0.0F ? 1 : 0;
  }
  EXPECT_GT(told, bounded_pairs / 3);  // else the zeros show nothing
}

TEST_P(LaneBounds, HaveTheBitsOfTheBaseline) {
  const auto [isa, pair] = GetParam();
  FeatureDraw draw(2);
  const std::vector<FourPoints> features = draw_all(bounded_pairs, [&, of = pair] { return draw.features(of); });
  const std::vector<float> bounds_m = bounds_of(isa, pair, features);
  const std::vector<float> baseline_m = bounds_of(Isa::baseline, pair, features);
  for (std::size_t i = 0; i < features.size(); ++i) {
    ASSERT_EQ(std::bit_cast<std::uint32_t>(bounds_m[i]), std::bit_cast<std::uint32_t>(baseline_m[i])) << i;
  }
}

TEST_P(LaneBounds, OfFeaturesOfGoodShapeAreNearlyTheDistance) {
  const auto [isa, pair] = GetParam();
  FeatureDraw draw(3);
  const std::vector<FourPoints> features = draw_all(bounded_pairs, [&, of = pair] { return draw.well_shaped(of); });
  const std::vector<float> bounds_m = bounds_of(isa, pair, features);
  std::vector<double> shares;
  for (std::size_t i = 0; i < features.size(); ++i) {
    shares.push_back(static_cast<double>(bounds_m[i]) / distance_m(pair, features[i]));
  }
  const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
  std::ranges::nth_element(shares, middle);
  EXPECT_GE(*middle, 0.9);
}

INSTANTIATE_TEST_SUITE_P(
    OfAllInstructionSets, LaneBounds,
    testing::Values(BoundCase{Isa::baseline, FeaturePair::vertex_face},
                    BoundCase{Isa::baseline, FeaturePair::edge_edge}, BoundCase{Isa::v3, FeaturePair::vertex_face},
                    BoundCase{Isa::v3, FeaturePair::edge_edge}, BoundCase{Isa::v4, FeaturePair::vertex_face},
                    BoundCase{Isa::v4, FeaturePair::edge_edge}),
    [](const auto& info) {
      const bool of_faces = info.param.pair == FeaturePair::vertex_face;
      return std::string(isa_names[static_cast<std::size_t>(info.param.isa)]) + (of_faces ? "VertexFace" : "EdgeEdge");
    });

}  // namespace
}  // namespace pneuma::physics
