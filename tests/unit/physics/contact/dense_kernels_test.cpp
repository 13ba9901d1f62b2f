// Shows that the dense kernels of every instruction set solve what they factor to round-off, for matrices of any number
// of rows and of all conditions, refuse what is not positive definite, leave zeros beyond the matrix, and give the same
// bits.
#include "physics/contact/dense_kernels.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "physics/lanes/isa.h"

namespace pneuma::physics {
namespace {

using Numbers = std::vector<double>;

/// A symmetric matrix in the layout of the kernels. It is positive definite where no share is below 0.
struct DenseMatrix {
  DenseMatrix(std::size_t size, const Numbers& shares, unsigned seed) : count(size), stride(dense_stride(size)) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Numbers columns(size * size);  // of G: the matrix is G diag(shares) G^T
    for (double& value : columns) value = normal(random) / std::sqrt(static_cast<double>(size));
    numbers.assign(stride * stride, 0.0);
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < size; ++j) {
        double sum = 0.0;
        for (std::size_t k = 0; k < size; ++k) sum += columns[i * size + k] * shares[k] * columns[j * size + k];
        at(i, j) += 0.5 * sum;
        at(j, i) += 0.5 * sum;
      }
    }
  }
  [[nodiscard]] double& at(std::size_t row, std::size_t column) { return numbers[column * stride + row]; }
  [[nodiscard]] double largest() const {
    double most = 0.0;
    for (const double value : numbers) most = std::max(most, std::abs(value));
    return most;
  }

  std::size_t count;
  std::size_t stride;
  Numbers numbers;
};

/// From 1 down to that share, evenly by the exponent.
Numbers falling(std::size_t count, double least) {
  Numbers shares(count);
  for (std::size_t k = 0; k < count; ++k) {
    shares[k] = std::pow(least, static_cast<double>(k) / static_cast<double>(std::max<std::size_t>(count - 1, 1)));
  }
  return shares;
}

Numbers drawn(std::size_t count, std::size_t stride, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Numbers values(stride, 0.0);
  for (std::size_t i = 0; i < count; ++i) values[i] = normal(random);
  return values;
}

class DenseKernelsOf : public testing::TestWithParam<Isa> {
 protected:
  void SetUp() override {
    if (!has_isa(GetParam())) GTEST_SKIP() << "not on this processor";
    kernels = &dense_kernels(GetParam());
  }
  const DenseKernels* kernels = nullptr;
};

// The residual is measured against the matrix and the answer, so it is of the rounding alone whatever the condition.
TEST_P(DenseKernelsOf, SolveWhatTheyFactor) {
  for (const std::size_t count : {1U, 2U, 7U, 8U, 9U, 15U, 16U, 17U, 24U, 61U, 150U}) {
    for (const double least : {1.0, 1e-4, 1e-10}) {
      DenseMatrix matrix(count, falling(count, least), static_cast<unsigned>(count));
      const Numbers b = drawn(count, matrix.stride, 3);
      Numbers factor = matrix.numbers;
      ASSERT_TRUE(kernels->factor(factor.data(), count, matrix.stride)) << count << " " << least;
      Numbers x = b;
      kernels->solve(factor.data(), count, matrix.stride, x.data());
      Numbers left(matrix.stride, 0.0);
      kernels->add_product(matrix.numbers.data(), count, matrix.stride, x.data(), left.data());
      double longest = 0.0;
      for (const double value : x) longest = std::max(longest, std::abs(value));
      const double rounding = 1e-15 * static_cast<double>(count * count) * (1.0 + matrix.largest() * longest);
      for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(left[i], b[i], rounding) << count << " " << least << " " << i;
      for (std::size_t i = count; i < matrix.stride; ++i) {
        EXPECT_EQ(x[i], 0.0);
        EXPECT_EQ(left[i], 0.0);
        for (std::size_t k = 0; k < count; ++k) EXPECT_EQ(factor[k * matrix.stride + i], 0.0);
      }
    }
  }
}

TEST_P(DenseKernelsOf, RefuseWhatIsNotPositiveDefinite) {
  for (const std::size_t count : {1U, 8U, 9U, 40U}) {
    for (const std::size_t bad : {std::size_t{0}, count / 2, count - 1}) {
      Numbers shares(count, 1.0);
      shares[bad] = -1.0;
      DenseMatrix matrix(count, shares, 5);
      EXPECT_FALSE(kernels->factor(matrix.numbers.data(), count, matrix.stride)) << count << " " << bad;
    }
    DenseMatrix unknown(count, Numbers(count, 1.0), 6);
    unknown.at(count - 1, count - 1) = std::nan("");
    EXPECT_FALSE(kernels->factor(unknown.numbers.data(), count, unknown.stride)) << count;
  }
}

TEST_P(DenseKernelsOf, AddProducts) {
  const std::size_t count = 37;
  DenseMatrix matrix(count, Numbers(count, 1.0), 7);
  const Numbers x = drawn(count, matrix.stride, 8);
  const Numbers start = drawn(count, matrix.stride, 9);
  Numbers sum = start;
  kernels->add_product(matrix.numbers.data(), count, matrix.stride, x.data(), sum.data());
  for (std::size_t i = 0; i < matrix.stride; ++i) {
    double expected = start[i];
    for (std::size_t j = 0; j < count; ++j) expected += matrix.at(i, j) * x[j];
    EXPECT_NEAR(sum[i], expected, 1e-13) << i;
  }
}

TEST_P(DenseKernelsOf, SolveForManyAsForOne) {
  for (const std::size_t count : {1U, 8U, 13U, 37U}) {
    DenseMatrix matrix(count, falling(count, 1e-3), static_cast<unsigned>(count));
    Numbers factor = matrix.numbers;
    ASSERT_TRUE(kernels->factor(factor.data(), count, matrix.stride));
    for (const std::size_t width : {8U, 40U}) {
      const Numbers b = drawn(count * width, count * width, 3);
      Numbers rows = b;
      kernels->solve_many(factor.data(), count, matrix.stride, rows.data(), width);
      for (std::size_t j = 0; j < width; ++j) {
        Numbers one(matrix.stride, 0.0);
        for (std::size_t i = 0; i < count; ++i) one[i] = b[i * width + j];
        kernels->solve(factor.data(), count, matrix.stride, one.data());
        for (std::size_t i = 0; i < count; ++i) {
          EXPECT_NEAR(rows[i * width + j], one[i], 1e-10 * (1.0 + std::abs(one[i]))) << count << " " << i << " " << j;
        }
      }
    }
  }
}

TEST_P(DenseKernelsOf, AddAColumnByThreeShares) {
  const std::size_t size = 24;
  const Numbers column = drawn(size, size, 4);
  const Numbers start = drawn(3 * size, 3 * size, 5);
  const double shares[3] = {2.0, -0.5, 3.0};
  Numbers sums = start;
  kernels->add_column(column.data(), shares, size, sums.data());
  for (std::size_t i = 0; i < 3 * size; ++i) {
    EXPECT_NEAR(sums[i], start[i] + shares[i / size] * column[i % size], 1e-15) << i;
  }
}

TEST_P(DenseKernelsOf, HaveTheBitsOfTheBaseline) {
  const DenseKernels& baseline = dense_kernels(Isa::baseline);
  for (const std::size_t count : {5U, 16U, 33U, 130U}) {
    DenseMatrix matrix(count, falling(count, 1e-6), 11);
    Numbers factors[2] = {matrix.numbers, matrix.numbers};
    Numbers answers[2] = {drawn(count, matrix.stride, 12), drawn(count, matrix.stride, 12)};
    Numbers products[2] = {answers[0], answers[0]};
    Numbers many[2] = {drawn(40 * count, 40 * count, 13), drawn(40 * count, 40 * count, 13)};
    const DenseKernels* both[2] = {kernels, &baseline};
    for (std::size_t k = 0; k < 2; ++k) {
      ASSERT_TRUE(both[k]->factor(factors[k].data(), count, matrix.stride));
      both[k]->solve(factors[k].data(), count, matrix.stride, answers[k].data());
      both[k]->add_product(matrix.numbers.data(), count, matrix.stride, answers[k].data(), products[k].data());
      both[k]->solve_many(factors[k].data(), count, matrix.stride, many[k].data(), 40);
    }
    const auto expect_same = [](double a, double b, std::size_t at) {
      EXPECT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b)) << at;
    };
    for (std::size_t i = 0; i < many[0].size(); ++i) expect_same(many[0][i], many[1][i], i);
    Numbers sums[2] = {drawn(3 * matrix.stride, 3 * matrix.stride, 14),
                       drawn(3 * matrix.stride, 3 * matrix.stride, 14)};
    const double shares[3] = {0.3, -1.7, 2.9};
    for (std::size_t k = 0; k < 2; ++k) {
      both[k]->add_column(matrix.numbers.data(), shares, matrix.stride, sums[k].data());
    }
    for (std::size_t i = 0; i < sums[0].size(); ++i) expect_same(sums[0][i], sums[1][i], i);
    for (std::size_t i = 0; i < matrix.stride; ++i) {
      expect_same(answers[0][i], answers[1][i], i);
      expect_same(products[0][i], products[1][i], i);
      for (std::size_t k = 0; k <= i; ++k)
        expect_same(factors[0][k * matrix.stride + i], factors[1][k * matrix.stride + i], i);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfAllInstructionSets, DenseKernelsOf, testing::Values(Isa::baseline, Isa::v3, Isa::v4),
                         [](const auto& info) { return std::string(isa_names[static_cast<std::size_t>(info.param)]); });

}  // namespace
}  // namespace pneuma::physics
