// Shows that rows by bodies (body_rows.h) answer as the dense matrix does that they stand for: velocities, what solves
// for penalties of every row, and whole programs. And that a rigid body's response is what body_rows.h takes it for: a
// number times the identity, and its columns.
#include "physics/contact/body_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "physics/contact/friction_program.h"
#include "support/eigen_solvers.h"

namespace pneuma::physics {
namespace {

class RowDraw {
 public:
  explicit RowDraw(unsigned seed) : random_(seed) {}
  double number() { return unit_(random_); }
  Vec3d vector() {
    return Vec3d::NullaryExpr([this] { return number(); });
  }
  LowRankColumns columns(double size) {
    LowRankColumns drawn;
    drawn.columns = size * LowRankColumns::Columns::NullaryExpr([this] { return number(); });
    // What is taken away leaves the whole positive.
    drawn.columns.rightCols<4>() *= 0.1;
    drawn.signs.tail<4>().setConstant(-1.0);
    return drawn;
  }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> unit_{-1.0, 1.0};
};

/// Rows of two bodies, each with one of them or with both; one body has no columns but one.
struct RowsOfTwoBodies {
  RowsOfTwoBodies(std::size_t rows, unsigned seed) : by_bodies(rows, 2), dense(rows) {
    RowDraw drawn(seed);
    const auto size = static_cast<Eigen::Index>(rows);
    const Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(size, size, [&] { return drawn.number(); });
    const Eigen::MatrixXd numbers =
        root * root.transpose() / static_cast<double>(rows) + 0.2 * Eigen::MatrixXd::Identity(size, size);
    Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(3 * size, 2 * LowRankColumns::count);
    Eigen::VectorXd signs = Eigen::VectorXd::Ones(2 * LowRankColumns::count);
    w = Eigen::MatrixXd::Zero(3 * size, 3 * size);
    for (Eigen::Index i = 0; i < size; ++i) {
      const auto row = static_cast<std::size_t>(i);
      for (Eigen::Index j = 0; j <= i; ++j) by_bodies.set_number(row, static_cast<std::size_t>(j), numbers(i, j));
      for (Eigen::Index j = 0; j < size; ++j) w.block<3, 3>(3 * i, 3 * j).diagonal().setConstant(numbers(i, j));
      for (const std::uint32_t body : {0U, 1U}) {
        if (row % 3 == body) continue;
        LowRankColumns of = drawn.columns(0.7);
        if (body == 1) of.columns.rightCols<6>().setZero();
        const double sign = body == 0 ? 1.0 : -1.0;
        by_bodies.add_part(row, body, sign, of);
        const Eigen::Index first = LowRankColumns::count * static_cast<Eigen::Index>(body);
        columns.block<3, LowRankColumns::count>(3 * i, first) += sign * of.columns;
        signs.segment<LowRankColumns::count>(first) = of.signs;
      }
    }
    by_bodies.add_softness(0, 0.3);
    w += columns * signs.asDiagonal() * columns.transpose();
    w.topLeftCorner<3, 3>().diagonal().array() += 0.3;
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        dense.set_block(static_cast<std::size_t>(i), static_cast<std::size_t>(j), w.block<3, 3>(3 * i, 3 * j));
      }
    }
  }

  BodyRows by_bodies;
  DenseRows dense;
  Eigen::MatrixXd w;
};

/// By rows, three numbers each, from and to what row_matrix.h has.
template <class Rows>
std::vector<double> spread(const Rows& rows, const Eigen::VectorXd& by_row) {
  std::vector<double> values(3 * rows.stride(), 0.0);
  for (std::size_t row = 0; row < rows.count(); ++row) {
    set_row(values, row, by_row.segment<3>(3 * static_cast<Eigen::Index>(row)));
  }
  return values;
}

Eigen::VectorXd by_row(std::span<const double> values, std::size_t rows) {
  Eigen::VectorXd gathered(3 * static_cast<Eigen::Index>(rows));
  for (std::size_t row = 0; row < rows; ++row) {
    gathered.segment<3>(3 * static_cast<Eigen::Index>(row)) = at_row(values, row);
  }
  return gathered;
}

template <class Rows>
Eigen::VectorXd velocities_of(const Rows& rows, const Eigen::VectorXd& impulses_n_s) {
  std::vector<double> velocities_m_s(3 * rows.stride());
  rows.multiply(spread(rows, impulses_n_s), velocities_m_s);
  return by_row(velocities_m_s, rows.count());
}

TEST(BodyRows, AnswerAsTheirMatrixDoes) {
  for (const std::size_t rows : {1U, 5U, 8U, 23U}) {
    const RowsOfTwoBodies both(rows, static_cast<unsigned>(rows));
    RowDraw drawn(7);
    const Eigen::VectorXd impulses = Eigen::VectorXd::NullaryExpr(both.w.rows(), [&] { return drawn.number(); });
    EXPECT_LT((velocities_of(both.by_bodies, impulses) - both.w * impulses).norm(), 1e-12);
    EXPECT_LT((velocities_of(both.dense, impulses) - both.w * impulses).norm(), 1e-12);
  }
}

template <class Rows>
void expect_solves(Rows& rows, const Eigen::MatrixXd& w, double penalty_1_kg) {
  RowDraw drawn(11);
  std::vector<double> penalties_1_kg;
  Eigen::MatrixXd with_penalties = w;
  for (std::size_t row = 0; row < rows.count(); ++row) {
    penalties_1_kg.push_back(penalty_1_kg * (1.5 + drawn.number()));
    const auto at = 3 * static_cast<Eigen::Index>(row);
    with_penalties.block<3, 3>(at, at).diagonal().array() += penalties_1_kg.back();
  }
  const Eigen::VectorXd right = Eigen::VectorXd::NullaryExpr(w.rows(), [&] { return drawn.number(); });
  const Eigen::VectorXd expected = support::inverse(with_penalties) * right;
  ASSERT_TRUE(rows.factor(penalties_1_kg));
  std::vector<double> found = spread(rows, right);
  rows.solve(found);
  EXPECT_LT((by_row(found, rows.count()) - expected).norm(), 1e-10 * expected.norm()) << rows.count();
}

TEST(BodyRows, SolveWithAPenaltyOfEveryRow) {
  for (const std::size_t rows : {1U, 4U, 9U, 26U}) {
    RowsOfTwoBodies both(rows, 20 + static_cast<unsigned>(rows));
    for (const double penalty_1_kg : {0.01, 0.3, 5.0}) {
      expect_solves(both.by_bodies, both.w, penalty_1_kg);
      expect_solves(both.dense, both.w, penalty_1_kg);
    }
  }
}

template <class Rows>
Eigen::VectorXd solution_of(Rows& rows, const Eigen::MatrixXd& w) {
  RowDraw drawn(31);
  FrictionProgram<Rows> program(rows);
  for (std::size_t row = 0; row < rows.count(); ++row) {
    const auto at = 3 * static_cast<Eigen::Index>(row);
    const double across = support::eigenvalues(w.block<2, 2>(at + 1, at + 1)).maxCoeff();
    program.set_contact(row, Vec3d::UnitX(), 0.4, {w(at, at), across, w.block<3, 3>(at, at).trace() / 3.0},
                        drawn.vector() - Vec3d(0.5, 0.0, 0.0), Vec3d::Zero());
  }
  EXPECT_TRUE(program.solve(1e-10));
  Eigen::VectorXd found(w.rows());
  for (std::size_t row = 0; row < rows.count(); ++row) {
    found.segment<3>(3 * static_cast<Eigen::Index>(row)) = program.impulse(row);
  }
  return found;
}

TEST(BodyRows, ProgramsEndWhereTheDenseOnesDo) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    RowsOfTwoBodies both(16, 40 + seed);
    EXPECT_LT((solution_of(both.by_bodies, both.w) - solution_of(both.dense, both.w)).norm(), 1e-7) << seed;
  }
}

// A body that meets itself has both supports of a row.
TEST(BodyRows, AddBothSidesOfABodyThatMeetsItself) {
  RowDraw drawn(3);
  const LowRankColumns first = drawn.columns(1.0);
  const LowRankColumns second = drawn.columns(1.0);
  BodyRows rows(1, 1);
  rows.add_part(0, 0, 1.0, first);
  rows.add_part(0, 0, -1.0, second);
  const LowRankColumns::Columns between = first.columns - second.columns;
  const Eigen::Matrix3d w = between * first.signs.asDiagonal() * between.transpose();
  const Vec3d impulse = drawn.vector();
  EXPECT_LT((velocities_of(rows, impulse) - w * impulse).norm(), 1e-13);
}

// Rows that say the same twice are told apart by their penalties alone, and share the impulse.
TEST(BodyRows, SolveForRowsThatSayTheSameTwice) {
  RowDraw drawn(9);
  const LowRankColumns columns = drawn.columns(0.7);
  BodyRows rows(2, 1);
  for (const std::size_t row : {0U, 1U}) {
    rows.add_part(row, 0, 1.0, columns);
    for (const std::size_t by : {0U, 1U}) rows.set_number(row, by, 0.5);
  }
  ASSERT_TRUE(rows.factor(std::vector<double>{1e-6, 1e-6}));
  Eigen::VectorXd right(6);
  right << 1.0, -2.0, 0.5, 1.0, -2.0, 0.5;
  std::vector<double> found = spread(rows, right);
  rows.solve(found);
  EXPECT_LT((at_row(found, 0) - at_row(found, 1)).norm(), 1e-6);
  EXPECT_LT((velocities_of(rows, by_row(found, 2)) - right).norm(), 1e-5);
}

TEST(BodyRows, WithoutColumnsAreTheirNumbersAlone) {
  BodyRows rows(9, 1);
  for (std::size_t row = 0; row < 9; ++row) rows.set_number(row, row, 2.0);
  ASSERT_TRUE(rows.factor(std::vector<double>(9, 0.5)));
  std::vector<double> found = spread(rows, Eigen::VectorXd::Ones(27));
  rows.solve(found);
  EXPECT_LT((by_row(found, 9) - Eigen::VectorXd::Constant(27, 0.4)).norm(), 1e-14);
  BodyRows negative(1, 1);
  negative.set_number(0, 0, -1.0);
  EXPECT_FALSE(negative.factor(std::vector<double>{0.5}));
}

// A locked one has rows of zeros in its inertia.
TEST(BodyRows, TakeEveryRigidBodyForItsColumns) {
  RowDraw drawn(5);
  for (const bool is_locked : {false, true}) {
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    if (is_locked) {
      inertia(1, 1) = 0.7;
    } else {
      const Eigen::Matrix3d root = Eigen::Matrix3d::NullaryExpr([&] { return drawn.number(); });
      inertia = root * root.transpose();
    }
    const Response body = RigidResponse(Vec3d(0.5, is_locked ? 0.0 : 0.5, 0.5), inertia);
    std::array<Support, 3> supports;
    supports[0].arm = drawn.vector();
    supports[1].arm = drawn.vector();
    supports[2].turns = true;
    for (const Support& at : supports) {
      for (const Support& by : supports) {
        const LowRankColumns of_at = columns(body, at);
        const Eigen::Matrix3d expected = inverse_mass_1_kg(body, at, by);
        const Eigen::Matrix3d found = number_1_kg(body, at, by) * Eigen::Matrix3d::Identity() +
                                      of_at.columns * of_at.signs.asDiagonal() * columns(body, by).columns.transpose();
        EXPECT_LT((found - expected).norm(), 1e-14) << is_locked;
      }
    }
  }
}

}  // namespace
}  // namespace pneuma::physics
