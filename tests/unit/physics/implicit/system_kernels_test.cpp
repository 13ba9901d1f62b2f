// Shows that the loops of conjugate gradients do what their words say, on any number of rows and edges, and with the
// same bits on every instruction set.
#include "physics/implicit/system_kernels.h"

#include <array>
#include <bit>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "physics/lanes/isa.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {
namespace {

Eigen::Map<const Vec3d> vector_of(const MotionRow& row) {
  return Eigen::Map<const Vec3d>(row.columns);
}

/// Rows, and edges between them that share vertices.
struct Drawn {
  Drawn(std::size_t row_count, std::size_t edge_count, unsigned seed) : rows(row_count), others(row_count) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (auto* of : {&rows, &others}) {
      for (MotionRow& row : *of) row = {{unit(random), unit(random), unit(random), 0.0}};
    }
    for (std::size_t i = 0; i < row_count; ++i) diagonal.push_back(unit(random));
    for (std::size_t i = 0; i < edge_count; ++i) {
      const Vec3d direction = Vec3d(unit(random), unit(random), 1.5).normalized();
      tangents.push_back({{direction.x(), direction.y(), direction.z()},
                          10.0 * unit(random),
                          {unit(random), unit(random), unit(random)},
                          unit(random)});
      edges.push_back(
          {static_cast<std::uint32_t>(random() % row_count), static_cast<std::uint32_t>(random() % row_count)});
    }
  }
  std::vector<MotionRow> rows, others;
  std::vector<double> diagonal;
  std::vector<EdgeTangent> tangents;
  std::vector<EdgePlaces> edges;
};

constexpr std::array<std::pair<std::size_t, std::size_t>, 5> sizes{{{1, 0}, {2, 1}, {5, 3}, {7, 9}, {40, 122}}};

class SystemKernelsOf : public testing::TestWithParam<Isa> {
 protected:
  void SetUp() override {
    if (!has_isa(GetParam())) GTEST_SKIP() << "not on this processor";
  }
};

TEST_P(SystemKernelsOf, MultiplyByTheTangentsOfEdges) {
  for (const auto& [row_count, edge_count] : sizes) {
    const Drawn drawn(row_count, edge_count, 3);
    std::vector<MotionRow> product = drawn.others;
    system_kernels(GetParam())
        .add_edge_products(drawn.tangents.data(), drawn.edges.data(), edge_count, drawn.rows.data(), product.data());
    std::vector<Vec3d> expected;
    for (const MotionRow& row : drawn.others) expected.emplace_back(vector_of(row));
    for (std::size_t e = 0; e < edge_count; ++e) {
      const EdgeTangent& tangent = drawn.tangents[e];
      const Vec3d n = Eigen::Map<const Vec3d>(tangent.direction);
      const Vec3d du = vector_of(drawn.rows[drawn.edges[e].second]) - vector_of(drawn.rows[drawn.edges[e].first]);
      const Vec3d pull = (tangent.along - tangent.across) * n.dot(du) * n + tangent.across * du;
      const Vec3d turned = du.cross(Eigen::Map<const Vec3d>(tangent.turn));
      expected[drawn.edges[e].first] -= pull + turned;
      expected[drawn.edges[e].second] += pull - turned;
    }
    for (std::size_t i = 0; i < row_count; ++i) {
      EXPECT_LT((vector_of(product[i]) - expected[i]).norm(), 1e-12) << row_count << ", " << i;
      EXPECT_EQ(product[i].columns[3], 0.0);
    }
  }
}

TEST_P(SystemKernelsOf, AddScaleAndMultiplyRows) {
  const SystemKernels& kernels = system_kernels(GetParam());
  for (const auto& [count, edges] : sizes) {
    const Drawn drawn(count, edges, 4);
    double dot = 0.0;
    for (std::size_t i = 0; i < count; ++i) dot += vector_of(drawn.rows[i]).dot(vector_of(drawn.others[i]));
    EXPECT_NEAR(kernels.dot(drawn.rows.data(), drawn.others.data(), count), dot, 1e-12);
    std::vector<MotionRow> scaled(count);
    kernels.scale_each(drawn.diagonal.data(), drawn.rows.data(), count, scaled.data());
    std::vector<MotionRow> added = drawn.others;
    kernels.add(0.7, drawn.rows.data(), count, added.data());
    std::vector<MotionRow> added_to = drawn.others;
    kernels.add_to(drawn.rows.data(), 0.7, count, added_to.data());
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d row = vector_of(drawn.rows[i]);
      const Vec3d other = vector_of(drawn.others[i]);
      EXPECT_EQ(Vec3d(vector_of(scaled[i])), drawn.diagonal[i] * row);
      EXPECT_EQ(Vec3d(vector_of(added[i])), other + 0.7 * row);
      EXPECT_EQ(Vec3d(vector_of(added_to[i])), row + 0.7 * other);
    }
  }
}

TEST_P(SystemKernelsOf, HaveTheBitsOfTheBaseline) {
  if (GetParam() == Isa::baseline) GTEST_SKIP() << "it is the baseline";
  for (const auto& [row_count, edge_count] : sizes) {
    const Drawn drawn(row_count, edge_count, 5);
    const auto bits_by = [&](const SystemKernels& kernels) {
      std::vector<MotionRow> product = drawn.others;
      kernels.add_edge_products(drawn.tangents.data(), drawn.edges.data(), edge_count, drawn.rows.data(),
                                product.data());
      std::vector<std::uint64_t> bits{
          std::bit_cast<std::uint64_t>(kernels.dot(product.data(), drawn.rows.data(), row_count))};
      for (const MotionRow& row : product) {
        for (const double number : row.columns) bits.push_back(std::bit_cast<std::uint64_t>(number));
      }
      return bits;
    };
    EXPECT_EQ(bits_by(system_kernels(GetParam())), bits_by(system_kernels(Isa::baseline))) << row_count;
  }
}

INSTANTIATE_TEST_SUITE_P(OfAllInstructionSets, SystemKernelsOf, testing::Values(Isa::baseline, Isa::v3, Isa::v4),
                         [](const auto& info) { return std::string(isa_names[static_cast<std::size_t>(info.param)]); });

}  // namespace
}  // namespace pneuma::physics
