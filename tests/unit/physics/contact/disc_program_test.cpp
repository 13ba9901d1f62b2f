// Shows that the program of normal impulses and friction's discs ends at its optimum: where a plain projected descent
// gets to in many steps, and, for rows of stiff bodies where such a descent hardly moves, where nothing goes down.
#include "physics/contact/disc_program.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "support/eigen_solvers.h"

namespace pneuma::physics {
namespace {

/// A metric of all rows: like that of a soft body, or of a stiff one, whose rows all pull at nearly one number.
Eigen::MatrixXd draw_metric(Eigen::Index rows, double stiff_share, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto draw = [&] { return unit(random); };
  const Eigen::MatrixXd of_own = Eigen::MatrixXd::NullaryExpr(3 * rows, 3 * rows, draw);
  const Eigen::MatrixXd of_whole = Eigen::MatrixXd::NullaryExpr(3 * rows, 6, draw);
  const Eigen::MatrixXd soft = of_own * of_own.transpose() / static_cast<double>(rows);
  return (1.0 - stiff_share) * (soft + 0.1 * Eigen::MatrixXd::Identity(3 * rows, 3 * rows)) +
         stiff_share * of_whole * of_whole.transpose();
}

struct DrawnProgram {
  DrawnProgram(Eigen::Index rows, double stiff_share, unsigned seed)
      : matrix(static_cast<std::size_t>(rows)), program(matrix) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    w = draw_metric(rows, stiff_share, random);
    q = Eigen::VectorXd::NullaryExpr(3 * rows, [&] { return unit(random); });
    for (Eigen::Index i = 0; i < rows; ++i) {
      const auto row = static_cast<std::size_t>(i);
      program.set_row(row, q.segment<3>(3 * i), {unit(random), unit(random), unit(random)},
                      support::eigenvalues(w.block<2, 2>(3 * i + 1, 3 * i + 1)).maxCoeff());
      for (Eigen::Index j = 0; j <= i; ++j) {
        matrix.set_block(row, static_cast<std::size_t>(j), w.block<3, 3>(3 * i, 3 * j));
      }
      radii.push_back(random() % 4 == 0 ? 0.0 : 0.5 * std::abs(unit(random)));
      program.set_disc(row, radii.back());
    }
  }
  [[nodiscard]] Eigen::VectorXd solution() const {
    Eigen::VectorXd f(q.size());
    for (std::size_t i = 0; i < radii.size(); ++i) f.segment<3>(3 * static_cast<Eigen::Index>(i)) = program.impulse(i);
    return f;
  }
  void project(Eigen::VectorXd& f) const {
    for (Eigen::Index i = 0; i < q.size() / 3; ++i) {
      f[3 * i] = std::max(0.0, f[3 * i]);
      const double radius = radii[static_cast<std::size_t>(i)];
      const double length = f.segment<2>(3 * i + 1).norm();
      if (length > radius) f.segment<2>(3 * i + 1) *= radius / length;
    }
  }

  Eigen::MatrixXd w;
  Eigen::VectorXd q;
  std::vector<double> radii;
  DenseRows matrix;
  DiscProgram<DenseRows> program;
};

TEST(DiscProgram, FindsWhatAProjectedDescentFinds) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    DrawnProgram drawn(12, 0.0, seed);
    std::uint32_t factorisations = 0;
    EXPECT_TRUE(drawn.program.solve(1e-11, factorisations));
    const double step = 1.0 / support::eigenvalues(drawn.w).maxCoeff();
    Eigen::VectorXd f = Eigen::VectorXd::Zero(drawn.q.size());
    for (int i = 0; i < 5000; ++i) {
      f -= step * (drawn.w * f + drawn.q);
      drawn.project(f);
    }
    EXPECT_LT((drawn.solution() - f).norm(), 1e-8) << seed;
  }
}

// No step down its gradient leads anywhere inside: at the optimum and nowhere else.
TEST(DiscProgram, OfAStiffBodyEndsWhereNothingGoesDown) {
  for (const double stiff_share : {0.5, 0.9, 0.95}) {
    for (unsigned seed = 0; seed < 10; ++seed) {
      DrawnProgram drawn(30, stiff_share, 50 + seed);
      std::uint32_t factorisations = 0;
      EXPECT_TRUE(drawn.program.solve(1e-8, factorisations)) << stiff_share << ", " << seed;
      const Eigen::VectorXd found = drawn.solution();
      Eigen::VectorXd lower = found - (drawn.w * found + drawn.q);
      drawn.project(lower);
      EXPECT_LT((lower - found).cwiseAbs().maxCoeff(), 1e-6) << stiff_share << ", " << seed;
    }
  }
}

// Signorini's and Coulomb's laws, row by row: what touches keeps its place along the normal, what rubs less than it may
// keeps its place across it, and what slips is rubbed by all that the law allows, against its slip.
TEST(DiscProgram, WithFrictionObeysBothLawsAtOnce) {
  constexpr double friction = 0.5;
  constexpr double enough_m_s = 1e-9;
  for (unsigned seed = 0; seed < 20; ++seed) {
    DrawnProgram drawn(12, 0.0, 100 + seed);
    for (std::size_t i = 0; i < 12; ++i) drawn.program.set_friction(i, friction);
    std::uint32_t factorisations = 0;
    ASSERT_TRUE(drawn.program.solve_with_friction(enough_m_s, factorisations)) << seed;
    EXPECT_LE(drawn.program.off_m_s(), enough_m_s);
    const Eigen::VectorXd impulses = drawn.solution();
    const Eigen::VectorXd velocities = drawn.w * impulses + drawn.q;
    for (Eigen::Index i = 0; i < 12; ++i) {
      const double pressed = impulses[3 * i];
      const Eigen::Vector2d rubbed = impulses.segment<2>(3 * i + 1);
      const Eigen::Vector2d slip = velocities.segment<2>(3 * i + 1);
      EXPECT_GE(pressed, 0.0);
      EXPECT_GE(velocities[3 * i], -1e-6) << seed << ", " << i;
      EXPECT_NEAR(pressed * velocities[3 * i], 0.0, 1e-6) << seed << ", " << i;
      EXPECT_LE(rubbed.norm(), friction * pressed + 1e-9) << seed << ", " << i;
      if (pressed == 0.0) continue;
      const bool sticks = rubbed.norm() < friction * pressed - 1e-6;
      const double against = sticks ? slip.norm() : (slip.norm() * rubbed + rubbed.norm() * slip).norm();
      EXPECT_NEAR(against, 0.0, 1e-6) << seed << ", " << i;
    }
  }
}

// Rows of a stiff body with more friction than a solution must exist for: whatever becomes of it, the impulses stay
// within both laws' bounds, and the program says how far off they are.
TEST(DiscProgram, WithFrictionThatComesToNothingStaysWithinBounds) {
  constexpr double friction = 5.0;
  constexpr double enough_m_s = 1e-12;
  std::uint32_t unsolved = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    DrawnProgram drawn(10, 0.999, 300 + seed);
    for (std::size_t i = 0; i < 10; ++i) drawn.program.set_friction(i, friction);
    std::uint32_t factorisations = 0;
    const bool solved = drawn.program.solve_with_friction(enough_m_s, factorisations);
    unsolved += solved ? 0U : 1U;
    EXPECT_EQ(solved, drawn.program.off_m_s() <= enough_m_s) << seed;
    for (std::size_t i = 0; i < 10; ++i) {
      const Vec3d impulse = drawn.program.impulse(i);
      EXPECT_GE(impulse[0], 0.0);
      EXPECT_LE(impulse.tail<2>().norm(), friction * impulse[0] * (1.0 + 1e-9) + 1e-12);
    }
  }
  EXPECT_GT(unsolved, 0U) << "draw harder ones";
}

}  // namespace
}  // namespace pneuma::physics
