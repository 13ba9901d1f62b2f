// Shows that the kernels of every instruction set find the nearest points of features of all sizes, shapes and
// distances as closest.cpp does, and the boxes that overlap as a plain comparison does. That all instruction sets give
// the same bits.
#include "physics/contact/feature_kernels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "physics/contact/closest.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {
namespace {

constexpr std::size_t measured_pairs = 40'000;

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

/// Of one pair, out of its block.
struct Nearest {
  double distance_m = 0.0;
  Vec3d apart_m = Vec3d::Zero();
  std::array<double, 3> shares{};

  [[nodiscard]] std::array<std::uint64_t, 7> bits() const {
    const auto bits_of = [](double number) { return std::bit_cast<std::uint64_t>(number); };
    return {bits_of(distance_m), bits_of(apart_m.x()), bits_of(apart_m.y()), bits_of(apart_m.z()),
            bits_of(shares[0]),  bits_of(shares[1]),   bits_of(shares[2])};
  }
};

std::vector<Nearest> nearest_of(Isa isa, FeaturePair pair, std::span<const FourPoints> features) {
  constexpr std::size_t width = FeatureBlock::width;
  std::vector<FeatureBlock> blocks((features.size() + width - 1) / width);
  for (std::size_t i = 0; i < blocks.size() * width; ++i) {
    const FourPoints& at = features[std::min(i, features.size() - 1)];
    for (std::size_t point = 0; point < 3; ++point) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        blocks[i / width].points[3 * point + axis][i % width] = at[point + 1][a] - at[0][a];
      }
    }
  }
  std::vector<NearestBlock> found(blocks.size());
  const FeatureKernels& kernels = feature_kernels(isa);
  (pair == FeaturePair::vertex_face ? kernels.vertex_face : kernels.edge_edge)(blocks.data(), blocks.size(),
                                                                               found.data());
  std::vector<Nearest> nearest(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    const NearestBlock& block = found[i / width];
    nearest[i].distance_m = block.distances_m[i % width];
    for (std::size_t k = 0; k < 3; ++k) {
      nearest[i].apart_m[static_cast<Eigen::Index>(k)] = block.apart_m[k][i % width];
      nearest[i].shares[k] = block.shares[k][i % width];
    }
  }
  return nearest;
}

std::vector<FourPoints> draw_all(std::size_t count, const std::function<FourPoints()>& draw) {
  std::vector<FourPoints> features(count);
  std::ranges::generate(features, draw);
  return features;
}

double size_of(const FourPoints& at) {
  double size_m = 0.0;
  for (const Vec3d& point : at) size_m = std::max(size_m, (point - at[0]).norm());
  return size_m;
}

struct KernelCase {
  Isa isa = Isa::baseline;
  FeaturePair pair = FeaturePair::vertex_face;
};

class LaneNearest : public testing::TestWithParam<KernelCase> {
 protected:
  void SetUp() override {
    if (!has_isa(GetParam().isa)) GTEST_SKIP() << "not on this processor";
  }
};

// Where slivers and edges that are all but parallel are nearest, round-off decides; that hardly changes how near.
TEST_P(LaneNearest, AreAsFarApartAsClosestSays) {
  const auto [isa, pair] = GetParam();
  FeatureDraw draw(1);
  const std::vector<FourPoints> features = draw_all(measured_pairs, [&, of = pair] { return draw.features(of); });
  const std::vector<Nearest> nearest = nearest_of(isa, pair, features);
  for (std::size_t i = 0; i < features.size(); ++i) {
    ASSERT_NEAR(nearest[i].distance_m, distance_m(pair, features[i]), 1e-6 * size_of(features[i])) << i;
    ASSERT_NEAR(nearest[i].apart_m.norm(), nearest[i].distance_m, 1e-12 * size_of(features[i])) << i;
  }
}

TEST_P(LaneNearest, OfGoodShapeAreSoToTheLastDigits) {
  const auto [isa, pair] = GetParam();
  FeatureDraw draw(6);
  const std::vector<FourPoints> features = draw_all(measured_pairs, [&, of = pair] { return draw.well_shaped(of); });
  const std::vector<Nearest> nearest = nearest_of(isa, pair, features);
  for (std::size_t i = 0; i < features.size(); ++i) {
    ASSERT_NEAR(nearest[i].distance_m, distance_m(pair, features[i]), 1e-12 * size_of(features[i])) << i;
  }
}

TEST_P(LaneNearest, HaveSharesThatMakeUpTheWayApart) {
  const auto [isa, pair] = GetParam();
  FeatureDraw draw(2);
  const std::vector<FourPoints> features = draw_all(measured_pairs, [&, of = pair] { return draw.features(of); });
  const std::vector<Nearest> nearest = nearest_of(isa, pair, features);
  for (std::size_t i = 0; i < features.size(); ++i) {
    const auto& [p, a, b, c] = features[i];
    const auto& [s, t, u] = nearest[i].shares;
    const bool of_face = pair == FeaturePair::vertex_face;
    const Vec3d apart_m = of_face ? Vec3d(p - s * a - t * b - u * c) : Vec3d(p + s * (a - p) - b - t * (c - b));
    ASSERT_LE((apart_m - nearest[i].apart_m).norm(), 1e-12 * size_of(features[i])) << i;
    for (const double share : nearest[i].shares) {
      ASSERT_GE(share, 0.0) << i;
      ASSERT_LE(share, 1.0) << i;
    }
    ASSERT_NEAR(of_face ? s + t + u : 1.0, 1.0, 1e-12) << i;
  }
}

TEST_P(LaneNearest, KnowWhereNoEndIsNearest) {
  const auto [isa, pair] = GetParam();
  if (pair != FeaturePair::edge_edge) GTEST_SKIP() << "faces say it by their shares";
  FeatureDraw draw(3);
  const std::vector<FourPoints> features = draw_all(measured_pairs, [&, of = pair] { return draw.well_shaped(of); });
  const std::vector<Nearest> nearest = nearest_of(isa, pair, features);
  std::size_t within = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const auto& [a0, a1, b0, b1] = features[i];
    const EdgePoints known = nearest_of_edges(a0, a1, b0, b1);
    const double end =
        std::min({known.along_first, 1.0 - known.along_first, known.along_second, 1.0 - known.along_second});
    if (known.within_both && end < 1e-6) continue;  // round-off decides
    ASSERT_EQ(nearest[i].shares[2], known.within_both ? 1.0 : 0.0) << i;
    within += known.within_both ? 1 : 0;
  }
  EXPECT_GT(within, measured_pairs / 10);
}

TEST_P(LaneNearest, HaveTheBitsOfTheBaseline) {
  const auto [isa, pair] = GetParam();
  if (isa == Isa::baseline) GTEST_SKIP() << "it is the baseline";
  FeatureDraw draw(4);
  const std::vector<FourPoints> features = draw_all(measured_pairs, [&, of = pair] { return draw.features(of); });
  const std::vector<Nearest> nearest = nearest_of(isa, pair, features);
  const std::vector<Nearest> baseline = nearest_of(Isa::baseline, pair, features);
  for (std::size_t i = 0; i < features.size(); ++i) ASSERT_EQ(nearest[i].bits(), baseline[i].bits()) << i;
}

INSTANTIATE_TEST_SUITE_P(
    OfAllInstructionSets, LaneNearest,
    testing::Values(KernelCase{Isa::baseline, FeaturePair::vertex_face},
                    KernelCase{Isa::baseline, FeaturePair::edge_edge}, KernelCase{Isa::v3, FeaturePair::vertex_face},
                    KernelCase{Isa::v3, FeaturePair::edge_edge}, KernelCase{Isa::v4, FeaturePair::vertex_face},
                    KernelCase{Isa::v4, FeaturePair::edge_edge}),
    [](const auto& info) {
      const bool of_faces = info.param.pair == FeaturePair::vertex_face;
      return std::string(isa_names[static_cast<std::size_t>(info.param.isa)]) + (of_faces ? "VertexFace" : "EdgeEdge");
    });

class LaneBoxes : public testing::TestWithParam<Isa> {
 protected:
  void SetUp() override {
    if (!has_isa(GetParam())) GTEST_SKIP() << "not on this processor";
  }
};

// Sides on a coarse grid, so that many touch; the last boxes hold nothing, as those that fill a row up.
TEST_P(LaneBoxes, ThatOverlapAreFoundInOrder) {
  constexpr std::size_t count = 8 * FeatureBlock::width;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  FeatureDraw draw(5);
  std::array<std::vector<double>, 6> sides;
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_empty = i + 3 >= count;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = draw.below(10);
      sides[axis].push_back(is_empty ? infinity : low);
      sides[axis + 3].push_back(is_empty ? -infinity : low + draw.below(4));
    }
  }
  BoxRows rows{.count = count};
  for (std::size_t side = 0; side < 6; ++side) rows.sides[side] = sides[side].data();
  std::size_t all = 0;
  for (std::size_t i = 0; i + 3 < count; ++i) {
    std::array<double, 6> box{};
    for (std::size_t side = 0; side < 6; ++side) box[side] = sides[side][i];
    std::vector<std::uint32_t> wanted;
    for (std::uint32_t k = 0; k < count; ++k) {
      bool overlaps = true;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        overlaps = overlaps && sides[axis][k] <= box[axis + 3] && box[axis] <= sides[axis + 3][k];
      }
      if (overlaps) wanted.push_back(k);
    }
    std::vector<std::uint32_t> which(count);
    which.resize(feature_kernels(GetParam()).overlapping(box, rows, which.data()));
    ASSERT_EQ(which, wanted) << i;
    all += which.size();
  }
  EXPECT_GT(all, 2 * count);
}

INSTANTIATE_TEST_SUITE_P(OfAllInstructionSets, LaneBoxes, testing::Values(Isa::baseline, Isa::v3, Isa::v4),
                         [](const auto& info) { return std::string(isa_names[static_cast<std::size_t>(info.param)]); });

}  // namespace
}  // namespace pneuma::physics
