// Shows that rows under a load on which sweeps stall, of a stack and of a stiff body, are solved together: the ground
// carries the weight, and friction holds what it can by statics.
#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "physics/contact/solver.h"
#include "unit/physics/contact/contact_laws.h"
#include "unit/physics/contact/factored_rig.h"

namespace pneuma::physics {
namespace {

/// Blocks on each other, each on its four corners, with a load on the topmost, after gravity's pull of one step. Their
/// corners say the same more than once, which no solver may stumble over.
struct Stack {
  static constexpr std::uint32_t blocks = 10;
  static constexpr double load_kg = 100.0;
  static constexpr double fall_m_s = 0.1;
  static constexpr double weight_n_s = (load_kg + blocks - 1.0) * fall_m_s;

  explicit Stack(double half_width_m, double across_m_s) {
    responses.emplace_back(FixedResponse{});
    for (std::uint32_t i = 1; i <= blocks; ++i) {
      const double inverse_mass = 1.0 / (i == blocks ? load_kg : 1.0);
      const double inverse_inertia = 1.5 * inverse_mass / (half_width_m * half_width_m);
      responses.emplace_back(RigidResponse(inverse_mass, inverse_inertia * Eigen::Matrix3d::Identity()));
      for (const double x : {-half_width_m, half_width_m}) {
        for (const double z : {-half_width_m, half_width_m}) {
          ContactRow& row = rows.emplace_back();
          row.first = {.body = i, .arm = Vec3d(x, -0.5, z)};
          row.second = {.body = i - 1, .arm = Vec3d(x, 0.5, z)};
          row.friction = 0.5;
          if (i == 1) row.free_m_s = Vec3d(across_m_s, -fall_m_s, 0.0);
        }
      }
    }
  }
  [[nodiscard]] Vec3d on_ground_n_s() const {
    Vec3d sum = Vec3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) sum += rows[i].impulse_n_s;
    return sum;
  }

  std::vector<Response> responses;
  std::vector<ContactRow> rows;
};

constexpr double stack_enough_m_s = 1e-5;
constexpr SolveLimits swept_only{.sweeps_max = 30, .enough_m_s = stack_enough_m_s};
constexpr SolveLimits swept_then_solved{.sweeps_max = 30, .enough_m_s = stack_enough_m_s, .direct_rows_max = 100};

TEST(LoadedRows, CarriesAStackThatSweepsAloneDoNot) {
  Stack swept(0.5, 0.0);
  EXPECT_FALSE(solve_rows(swept.rows, swept.responses, swept_only).converged);
  EXPECT_LT(swept.on_ground_n_s().y(), 0.9 * Stack::weight_n_s);

  Stack solved(0.5, 0.0);
  const SolveOutcome outcome = solve_rows(solved.rows, solved.responses, swept_then_solved);
  EXPECT_TRUE(outcome.converged);
  EXPECT_GT(outcome.factorisations, 0U);
  EXPECT_NEAR(solved.on_ground_n_s().y(), Stack::weight_n_s, 1e-3 * Stack::weight_n_s);
  expect_laws(solved.rows, solved.responses, 10.0 * stack_enough_m_s, 1e-3 * Stack::weight_n_s);
}

// Slower across than friction times the fall, the ground holds the stack; faster, it takes off what it can. The blocks
// are wide enough that the stack does not tip: their half width is more than friction times its height.
TEST(LoadedRows, HoldsAStackOnTheGroundByAsMuchFrictionAsThereIs) {
  for (const double half_width_m : {6.0, 20.0}) {
    for (const double across_m_s : {0.02, 0.2}) {
      Stack stack(half_width_m, across_m_s);
      (void)solve_rows(stack.rows, stack.responses, swept_then_solved);
      const double most_n_s = 0.5 * Stack::weight_n_s;
      const double held_n_s = std::min(across_m_s * Stack::weight_n_s / Stack::fall_m_s, most_n_s);
      EXPECT_NEAR(stack.on_ground_n_s().x(), -held_n_s, 0.01 * most_n_s) << half_width_m << " m, " << across_m_s;
    }
  }
}

/// A stiff ball of 1 kg between the ground and a guided load of 1,000 kg, which meet the vertices near its poles.
struct LoadedBall {
  LoadedBall() {
    responses.emplace_back(FactoredResponse(ball.metric()));
    responses.emplace_back(RigidResponse(1e-3, Eigen::Matrix3d::Zero()));
    responses.emplace_back(FixedResponse{});
    auto& of_ball = std::get<FactoredResponse>(responses[0]);
    const double fall_m_s = 9.81 * FactoredBall::step_s;
    double pole_m = 0.0;
    for (const Vec3d& x : ball.state().x) pole_m = std::max(pole_m, x.y());
    for (std::uint32_t i = 0; i < ball.state().x.size(); ++i) {
      const Vec3d& x = ball.state().x[i];
      const double gap_m = pole_m - std::abs(x.y());
      if (gap_m > 0.2 * FactoredBall::radius_m) continue;
      Support at = support_at(0, std::array{i}, std::array{1.0});
      of_ball.add(at);
      ContactRow& row = rows.emplace_back();
      row.first = x.y() > 0.0 ? Support{.body = 1, .arm = x} : at;
      row.second = x.y() > 0.0 ? at : Support{.body = 2};
      row.friction = 0.5;
      row.least_m_s = -gap_m / FactoredBall::step_s;
      row.free_m_s = x.y() > 0.0 ? Vec3d(0.2, -100.0 * fall_m_s, 0.0) : Vec3d(0.0, -fall_m_s, 0.0);
    }
    of_ball.finish();
  }

  FactoredBall ball{{.subdivisions = 2, .stiffness_n_m = 1e6}};
  std::vector<Response> responses;
  std::vector<ContactRow> rows;
};

TEST(LoadedRows, CarriesALoadOnAStiffBallThatSweepsAloneDoNot) {
  LoadedBall swept;
  EXPECT_FALSE(solve_rows(swept.rows, swept.responses, swept_only).converged);
  LoadedBall solved;
  ASSERT_LE(solved.rows.size(), swept_then_solved.direct_rows_max);
  EXPECT_TRUE(solve_rows(solved.rows, solved.responses, swept_then_solved).converged);
  double largest_n_s = 0.0;
  for (const ContactRow& row : solved.rows) largest_n_s = std::max(largest_n_s, row.impulse_n_s.norm());
  expect_laws(solved.rows, solved.responses, 10.0 * stack_enough_m_s, 1e-3 * largest_n_s);
}

}  // namespace
}  // namespace pneuma::physics
