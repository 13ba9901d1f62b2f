// Shows that steps that are mixed end where plain ones do, and sooner; that a linear method of few unknowns ends in
// hardly more steps; and that what has no end grows no faster than twofold.
#include "physics/contact/step_mix.h"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "physics/contact/row_matrix.h"

namespace pneuma::physics {
namespace {

using Point = std::vector<double>;
constexpr std::size_t size = dense_block;

// One step of a method whose change at `point` is change_of(point).
template <class ChangeOf>
double take_step(StepMix& mix, Point& point, const ChangeOf& change_of) {
  const Point change = change_of(point);
  Point next = point;
  for (std::size_t i = 0; i < size; ++i) next[i] += change[i];
  mix.go_on(change, next);
  point = next;
  return std::sqrt(dot(change, change));
}

// Each unknown comes nearer its end by its own share.
Point towards(const Point& point) {
  Point change(size);
  for (std::size_t i = 0; i < size; ++i) {
    const auto k = static_cast<double>(i);
    change[i] = (0.02 + 0.1 * k) * (1.0 + k - point[i]);
  }
  return change;
}

TEST(StepMix, OfALinearMethodEndsInFewMoreStepsThanItHasUnknowns) {
  constexpr std::size_t steps = size + 6;
  StepMix mix;
  Point point(size, 0.0);
  double change = 0.0;
  for (std::size_t step = 0; step < steps; ++step) change = take_step(mix, point, towards);
  EXPECT_LT(change, 1e-6);
  for (std::size_t i = 0; i < size; ++i) EXPECT_NEAR(point[i], 1.0 + static_cast<double>(i), 1e-4) << i;
  Point plain(size, 0.0);
  for (std::size_t step = 0; step < steps; ++step) {
    const Point by = towards(plain);
    for (std::size_t i = 0; i < size; ++i) plain[i] += by[i];
  }
  EXPECT_GT(std::abs(plain[0] - 1.0), 0.5) << "plain steps are as fast";
}

TEST(StepMix, OfACurvedMethodEndsWhereItDoes) {
  StepMix mix;
  Point point(size, 0.0);
  const auto change_of = [](const Point& at) {
    Point change(size);
    for (std::size_t i = 0; i < size; ++i)
      change[i] = 0.9 * std::cos(at[i] + 0.1 * static_cast<double>(i)) - 0.5 * at[i];
    return change;
  };
  for (int step = 0; step < 60; ++step) take_step(mix, point, change_of);
  for (const double left : change_of(point)) EXPECT_NEAR(left, 0.0, 1e-10);
}

TEST(StepMix, OfWhatHasNoEndGrowsTwofoldAtMost) {
  StepMix mix;
  Point point(size, 1.0);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1e-9, 1e-9);
  for (int step = 0; step < 50; ++step) {
    const double before = std::sqrt(dot(point, point));
    take_step(mix, point, [&](const Point&) {
      Point change(size, 0.01);
      for (double& value : change) value += unit(random);
      return change;
    });
    EXPECT_LE(std::sqrt(dot(point, point)), 2.0 * before + 0.1);
  }
}

TEST(StepMix, ForgetsWhatItIsToldTo) {
  StepMix mix;
  Point point(size, 0.0);
  for (int step = 0; step < 4; ++step) take_step(mix, point, towards);
  mix.forget();
  Point next(size, 3.0);
  mix.go_on(Point(size, 1.0), next);
  EXPECT_EQ(next, Point(size, 3.0));
}

}  // namespace
}  // namespace pneuma::physics
