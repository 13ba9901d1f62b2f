// Shows that a body's extents are those of its numbers, whatever their count and the instruction set, and that a number
// that is none is told.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "physics/lanes/isa.h"
#include "physics/lanes/lane_kernels.h"

namespace pneuma::physics {
namespace {

template <class Real>
struct DrawnBody {
  std::vector<Real> x, move, v;

  DrawnBody(std::size_t vertices, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<Real> number(-10, 10);
    for (auto* list : {&x, &move, &v}) {
      for (std::size_t i = 0; i < 3 * vertices; ++i) list->push_back(number(random));
    }
  }
  [[nodiscard]] Extents<Real> extents(Isa isa) const {
    Extents<Real> extents;
    lane_kernels<Real>(isa).extents({x.data(), move.data(), v.data(), x.size(), &extents});
    return extents;
  }
};

template <class Real>
void expect_extents(Isa isa) {
  for (std::size_t vertices = 1; vertices <= 100; ++vertices) {
    const DrawnBody<Real> body(vertices, static_cast<unsigned>(vertices));
    const Extents<Real> extents = body.extents(isa);
    std::array<Span<Real>, 3> x, end, move;
    Real v_max_m_s = 0;
    for (std::size_t i = 0; i < body.x.size(); ++i) {
      x[i % 3].take(body.x[i]);
      end[i % 3].take(body.x[i] + body.move[i]);
      move[i % 3].take(body.move[i]);
      v_max_m_s = std::max(v_max_m_s, std::abs(body.v[i]));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ASSERT_EQ(extents.x[axis].low, x[axis].low) << vertices;
      ASSERT_EQ(extents.x[axis].high, x[axis].high) << vertices;
      ASSERT_EQ(extents.end[axis].low, end[axis].low) << vertices;
      ASSERT_EQ(extents.end[axis].high, end[axis].high) << vertices;
      ASSERT_EQ(extents.move[axis].low, move[axis].low) << vertices;
      ASSERT_EQ(extents.move[axis].high, move[axis].high) << vertices;
    }
    ASSERT_EQ(extents.v_max_m_s, v_max_m_s) << vertices;
    ASSERT_TRUE(extents.finite) << vertices;
  }
}

template <class Real>
void expect_lost_numbers_told(Isa isa) {
  constexpr std::size_t vertices = 35;
  for (std::size_t i = 0; i < 3 * vertices; ++i) {
    for (const Real lost : {std::numeric_limits<Real>::quiet_NaN(), std::numeric_limits<Real>::infinity()}) {
      for (std::size_t list = 0; list < 3; ++list) {
        DrawnBody<Real> body(vertices, 7);
        (list == 0 ? body.x : list == 1 ? body.move : body.v)[i] = lost;
        ASSERT_FALSE(body.extents(isa).finite) << i << ' ' << list;
      }
    }
  }
}

class BodyExtents : public testing::TestWithParam<Isa> {
 protected:
  void SetUp() override {
    if (!has_isa(GetParam())) GTEST_SKIP() << "not on this processor";
  }
};

TEST_P(BodyExtents, AreThoseOfItsNumbers) {
  expect_extents<float>(GetParam());
  expect_extents<double>(GetParam());
}

TEST_P(BodyExtents, TellOfNumbersThatAreNone) {
  expect_lost_numbers_told<float>(GetParam());
  expect_lost_numbers_told<double>(GetParam());
}

INSTANTIATE_TEST_SUITE_P(OfAllInstructionSets, BodyExtents, testing::Values(Isa::baseline, Isa::v3, Isa::v4),
                         [](const auto& info) { return std::string(isa_names[static_cast<std::size_t>(info.param)]); });

}  // namespace
}  // namespace pneuma::physics
