// Shows that the program of rows that are solved together obeys Signorini's and Coulomb's laws, of soft metrics and of
// stiff ones, whose rows all pull at nearly one number; that joints hold; that a block on a slope does what it should;
// and that impulses stay within their cones where no solution is found.
#include "physics/contact/friction_program.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "support/eigen_solvers.h"

namespace pneuma::physics {
namespace {

using Program = FrictionProgram<DenseRows>;

/// A metric of all rows: like that of a soft body, or of a stiff one.
Eigen::MatrixXd draw_metric(Eigen::Index rows, double stiff_share, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto draw = [&] { return unit(random); };
  const Eigen::MatrixXd of_own = Eigen::MatrixXd::NullaryExpr(3 * rows, 3 * rows, draw);
  const Eigen::MatrixXd of_whole = Eigen::MatrixXd::NullaryExpr(3 * rows, 6, draw);
  const Eigen::MatrixXd soft = of_own * of_own.transpose() / static_cast<double>(rows);
  return (1.0 - stiff_share) * (soft + 0.1 * Eigen::MatrixXd::Identity(3 * rows, 3 * rows)) +
         stiff_share * of_whole * of_whole.transpose();
}

/// How a row with this normal answers to itself.
Program::Own own_of(const Eigen::Matrix3d& block_1_kg, const Vec3d& normal) {
  const Vec3d u = normal.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> across;
  across << u, normal.cross(u);
  const Eigen::Matrix2d of_across = across.transpose() * block_1_kg * across;
  return {normal.dot(block_1_kg * normal), support::eigenvalues(of_across).maxCoeff(), block_1_kg.trace() / 3.0};
}

struct DrawnProgram {
  DrawnProgram(Eigen::Index rows, double stiff_share, unsigned seed)
      : random(seed), w(draw_metric(rows, stiff_share, random)), matrix(static_cast<std::size_t>(rows)) {
    q = Eigen::VectorXd::NullaryExpr(3 * rows, [&] { return number(); });
    for (Eigen::Index i = 0; i < rows; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        matrix.set_block(static_cast<std::size_t>(i), static_cast<std::size_t>(j), w.block<3, 3>(3 * i, 3 * j));
      }
      normals.push_back(vector().normalized());
    }
  }
  double number() { return std::uniform_real_distribution<double>(-1.0, 1.0)(random); }
  Vec3d vector() {
    return Vec3d::NullaryExpr([this] { return number(); });
  }
  [[nodiscard]] std::size_t count() const { return normals.size(); }
  [[nodiscard]] Vec3d free_m_s(std::size_t row) const { return q.segment<3>(3 * static_cast<Eigen::Index>(row)); }
  [[nodiscard]] Program::Own own(std::size_t row) const {
    const auto at = 3 * static_cast<Eigen::Index>(row);
    return own_of(w.block<3, 3>(at, at), normals[row]);
  }
  Program of_contacts(double friction) {
    Program program(matrix);
    for (std::size_t i = 0; i < count(); ++i) {
      program.set_contact(i, normals[i], friction, own(i), free_m_s(i), vector());
    }
    return program;
  }
  [[nodiscard]] Vec3d velocity_m_s(const Program& program, std::size_t row) const {
    Eigen::VectorXd impulses_n_s(q.size());
    for (std::size_t i = 0; i < count(); ++i) {
      impulses_n_s.segment<3>(3 * static_cast<Eigen::Index>(i)) = program.impulse(i);
    }
    return (w * impulses_n_s + q).segment<3>(3 * static_cast<Eigen::Index>(row));
  }
  // What touches keeps its place along the normal, what rubs less than it may keeps its place across it, and what slips
  // is rubbed by all that the law allows, against its slip.
  void expect_laws(const Program& program, double friction, double off) const {
    for (std::size_t i = 0; i < count(); ++i) {
      const Vec3d impulse_n_s = program.impulse(i);
      const Vec3d velocity = velocity_m_s(program, i);
      const double pressed = impulse_n_s.dot(normals[i]);
      const double opens = velocity.dot(normals[i]);
      const Vec3d rubbed = impulse_n_s - pressed * normals[i];
      const Vec3d slip = velocity - opens * normals[i];
      EXPECT_GE(pressed, 0.0) << i;
      EXPECT_GE(opens, -off) << i;
      EXPECT_NEAR(pressed * opens, 0.0, off) << i;
      EXPECT_LE(rubbed.norm(), friction * pressed * (1.0 + 1e-9) + 1e-12) << i;
      if (pressed == 0.0) continue;
      const bool sticks = rubbed.norm() < friction * pressed - off;
      EXPECT_NEAR(sticks ? slip.norm() : (slip.norm() * rubbed + rubbed.norm() * slip).norm(), 0.0, off) << i;
    }
  }

  std::mt19937 random;
  Eigen::MatrixXd w;
  Eigen::VectorXd q;
  DenseRows matrix;
  std::vector<Vec3d> normals;
};

TEST(FrictionProgram, ObeysBothLawsAtOnce) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    DrawnProgram drawn(12, 0.0, 100 + seed);
    Program program = drawn.of_contacts(0.5);
    ASSERT_TRUE(program.solve(1e-9));
    EXPECT_LE(program.off_m_s(), 1e-9);
    drawn.expect_laws(program, 0.5, 1e-6);
  }
}

TEST(FrictionProgram, OfAStiffBodyObeysThemToo) {
  for (const double stiff_share : {0.5, 0.9, 0.95}) {
    for (unsigned seed = 0; seed < 10; ++seed) {
      SCOPED_TRACE(stiff_share);
      SCOPED_TRACE(seed);
      DrawnProgram drawn(30, stiff_share, 50 + seed);
      Program program = drawn.of_contacts(0.2);
      ASSERT_TRUE(program.solve(1e-7)) << program.off_m_s();
      drawn.expect_laws(program, 0.2, 1e-4);
    }
  }
}

// Without friction the program is convex: no step down its gradient leads anywhere inside, at the optimum and nowhere
// else.
TEST(FrictionProgram, WithoutFrictionEndsWhereNothingGoesDown) {
  for (const double stiff_share : {0.0, 0.5, 0.95}) {
    for (unsigned seed = 0; seed < 10; ++seed) {
      DrawnProgram drawn(30, stiff_share, 200 + seed);
      Program program = drawn.of_contacts(0.0);
      ASSERT_TRUE(program.solve(1e-8)) << stiff_share << ", " << seed;
      for (std::size_t i = 0; i < drawn.count(); ++i) {
        const double pressed = program.impulse(i).dot(drawn.normals[i]);
        const double lower = std::max(0.0, pressed - drawn.velocity_m_s(program, i).dot(drawn.normals[i]));
        EXPECT_NEAR(lower, pressed, 1e-6) << stiff_share << ", " << seed;
        EXPECT_LT((program.impulse(i) - pressed * drawn.normals[i]).norm(), 1e-12);
      }
    }
  }
}

TEST(FrictionProgram, OfJointsHoldsThem) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    DrawnProgram drawn(9, 0.3, 400 + seed);
    Program program(drawn.matrix);
    for (std::size_t i = 0; i < drawn.count(); ++i) {
      const Vec3d start = drawn.vector();
      if (i % 3 == 0) program.set_contact(i, drawn.normals[i], 0.4, drawn.own(i), drawn.free_m_s(i), start);
      if (i % 3 == 1) program.set_tie(i, drawn.own(i), drawn.free_m_s(i), start);
      if (i % 3 == 2) program.set_guide(i, drawn.normals[i], drawn.own(i), drawn.free_m_s(i), start);
    }
    ASSERT_TRUE(program.solve(1e-10)) << seed;
    for (std::size_t i = 0; i < drawn.count(); ++i) {
      const Vec3d velocity = drawn.velocity_m_s(program, i);
      if (i % 3 == 1) {
        EXPECT_LT(velocity.norm(), 1e-9);
      }
      if (i % 3 != 2) continue;
      EXPECT_LT(velocity.cross(drawn.normals[i]).norm(), 1e-9);
      EXPECT_LT(std::abs(program.impulse(i).dot(drawn.normals[i])), 1e-12);
    }
  }
}

// A block of 2 kg on a slope: it stays where the slope's tangent is no more than its friction, and else goes down by
// what friction leaves.
TEST(FrictionProgram, OfABlockOnASlopeIsItsClosedForm) {
  constexpr double mass_kg = 2.0;
  constexpr double friction = 0.5;
  constexpr double gained_m_s = 9.81 / 60.0;
  for (const double slope : {0.1, 0.3, 0.49, 0.51, 0.8, 2.0}) {
    const double angle = std::atan(slope);
    const Vec3d normal(std::sin(angle), std::cos(angle), 0.0);
    const Eigen::Matrix3d block = Eigen::Matrix3d::Identity() / mass_kg;
    DenseRows matrix(1);
    matrix.set_block(0, 0, block);
    Program program(matrix);
    program.set_contact(0, normal, friction, own_of(block, normal), {0.0, -gained_m_s, 0.0}, Vec3d::Zero());
    ASSERT_TRUE(program.solve(1e-12)) << slope;
    const Vec3d velocity = program.impulse(0) / mass_kg - Vec3d(0.0, gained_m_s, 0.0);
    const double slides_m_s = gained_m_s * std::max(0.0, std::sin(angle) - friction * std::cos(angle));
    EXPECT_NEAR(velocity.norm(), slides_m_s, 1e-10) << slope;
    EXPECT_NEAR(velocity.dot(normal), 0.0, 1e-10) << slope;
  }
}

TEST(FrictionProgram, OfARowThatNothingMovesHasNoImpulse) {
  DenseRows matrix(2);
  matrix.set_block(0, 0, Eigen::Matrix3d::Identity());
  Program program(matrix);
  program.set_contact(0, Vec3d::UnitY(), 0.5, {1.0, 1.0, 1.0}, {0.0, -1.0, 0.0}, Vec3d::Zero());
  program.set_tie(1, {}, {1.0, 0.0, 0.0}, {1.0, 2.0, 3.0});
  EXPECT_TRUE(program.solve(1e-9));
  EXPECT_NEAR(program.impulse(0).y(), 1.0, 1e-8);
  EXPECT_TRUE(program.impulse(1).isZero(0.0));
}

// Rows of a stiff body with more friction than a solution must exist for: whatever becomes of it, the impulses stay
// within their cones, and the program says how far off they are.
TEST(FrictionProgram, ThatComesToNothingStaysWithinItsCones) {
  constexpr double friction = 5.0;
  std::uint32_t unsolved = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    DrawnProgram drawn(10, 0.999, 300 + seed);
    Program program = drawn.of_contacts(friction);
    const bool solved = program.solve(1e-12);
    unsolved += solved ? 0U : 1U;
    EXPECT_EQ(solved, program.off_m_s() <= 1e-12) << seed;
    for (std::size_t i = 0; i < drawn.count(); ++i) {
      const Vec3d impulse = program.impulse(i);
      const double pressed = impulse.dot(drawn.normals[i]);
      EXPECT_GE(pressed, 0.0);
      EXPECT_LE((impulse - pressed * drawn.normals[i]).norm(), friction * pressed * (1.0 + 1e-9) + 1e-12);
    }
  }
  EXPECT_GT(unsolved, 0U) << "draw harder ones";
}

}  // namespace
}  // namespace pneuma::physics
