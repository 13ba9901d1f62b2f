// Shows that the sweep kernels of every instruction set give the same bits, whatever rows press, rub or part.
#include "physics/contact/sweep_kernels.h"

#include <bit>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "physics/lanes/isa.h"
#include "physics/machine/line_allocator.h"

namespace pneuma::physics {
namespace {

using LineNumbers = std::vector<double, LineAllocator<double>>;

struct Swept {
  std::vector<LumpedRow> rows;
  std::vector<LumpedImpulse> impulses;
  LineNumbers values;

  explicit Swept(unsigned seed) : values(4 * slots, 0.0), random_(seed) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i % 4 < 3) values[i] = between(-2.0, 2.0);
    }
    rows.resize(60);
    impulses.resize(rows.size());
    for (std::size_t r = 0; r < rows.size(); ++r) fill(rows[r], impulses[r]);
  }

 private:
  static constexpr std::size_t slots = 40;

  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  void fill(LumpedRow& row, LumpedImpulse& impulse) {
    const double x = between(-1.0, 1.0);
    const double y = between(-1.0, 1.0);
    const double z = between(0.1, 1.0);
    const double length = std::sqrt(x * x + y * y + z * z);
    row.normal[0] = x / length;
    row.normal[1] = y / length;
    row.normal[2] = z / length;
    row.corner_count = random_() % 2 == 0 ? 2 : 4;
    row.pushed_count = static_cast<std::uint32_t>(1 + random_() % row.corner_count);
    double inverse_mass_1_kg = 0.0;
    for (std::uint32_t i = 0; i < row.corner_count; ++i) {
      row.corners[i] = static_cast<std::uint32_t>(random_() % slots);
      row.weights[i] = between(-1.0, 1.0);
      if (i < row.pushed_count) row.pushes_1_kg[i] = row.weights[i] * between(0.1, 10.0);
      inverse_mass_1_kg += row.weights[i] * row.pushes_1_kg[i];
    }
    row.mass_kg = random_() % 20 == 0 ? 0.0 : 1.0 / inverse_mass_1_kg;
    row.friction = random_() % 3 == 0 ? 0.0 : between(0.0, 1.0);
    impulse.least_m_s = between(-0.5, 0.5);
    impulse.pressed_n_s = random_() % 2 == 0 ? 0.0 : between(0.0, 1.0);
  }

  std::mt19937 random_;
};

class SweepKernelsOf : public testing::TestWithParam<Isa> {
 protected:
  void SetUp() override {
    if (!has_isa(GetParam())) GTEST_SKIP() << "this processor has it not";
  }
};

TEST_P(SweepKernelsOf, HaveTheBitsOfTheBaseline) {
  const SweepKernels& wanted_kernels = sweep_kernels(Isa::baseline);
  const SweepKernels& kernels = sweep_kernels(GetParam());
  for (unsigned seed = 0; seed < 50; ++seed) {
    for (const bool with_friction : {false, true}) {
      Swept wanted(seed);
      Swept found(seed);
      std::vector<std::uint32_t> which(wanted.rows.size() - seed % 7);
      std::iota(which.begin(), which.end(), 0U);
      const auto sweep = [&](const SweepKernels& by, Swept& world) {
        return by.sweep(
            {world.rows.data(), world.impulses.data(), which.data(), which.size(), world.values.data(), with_friction});
      };
      for (int k = 0; k < 3; ++k) {
        EXPECT_EQ(std::bit_cast<std::uint64_t>(sweep(kernels, found)),
                  std::bit_cast<std::uint64_t>(sweep(wanted_kernels, wanted)));
      }
      for (std::size_t i = 0; i < wanted.values.size(); ++i) {
        ASSERT_EQ(std::bit_cast<std::uint64_t>(found.values[i]), std::bit_cast<std::uint64_t>(wanted.values[i]));
      }
      std::vector<double> along(wanted.rows.size());
      std::vector<double> wanted_along(wanted.rows.size());
      kernels.project(found.rows.data(), found.rows.size(), found.values.data(), along.data());
      wanted_kernels.project(wanted.rows.data(), wanted.rows.size(), wanted.values.data(), wanted_along.data());
      for (std::size_t r = 0; r < along.size(); ++r) {
        ASSERT_EQ(std::bit_cast<std::uint64_t>(along[r]), std::bit_cast<std::uint64_t>(wanted_along[r]));
        ASSERT_EQ(std::bit_cast<std::uint64_t>(found.impulses[r].pressed_n_s),
                  std::bit_cast<std::uint64_t>(wanted.impulses[r].pressed_n_s));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfAllInstructionSets, SweepKernelsOf, testing::Values(Isa::baseline, Isa::v3, Isa::v4),
                         [](const auto& info) { return std::string(isa_names[static_cast<std::size_t>(info.param)]); });

}  // namespace
}  // namespace pneuma::physics
