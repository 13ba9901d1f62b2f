// Shows that rows by bodies (body_rows.h) answer as the dense matrix does that they stand for: velocities, diagonals,
// parts spanned by directions of rows that stick, slide, or only press, and whole programs. And that a rigid body's
// response is what body_rows.h takes it for: a number times the identity, and its columns.
#include "physics/contact/body_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "physics/contact/disc_program.h"
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
  Eigen::Matrix3d axes() {
    const Vec3d normal = vector().normalized();
    const Vec3d across = normal.cross(vector()).normalized();
    Eigen::Matrix3d axes;
    axes << normal, across, normal.cross(across);
    return axes;
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
    Eigen::MatrixXd all_axes = Eigen::MatrixXd::Zero(3 * size, 3 * size);
    w = Eigen::MatrixXd::Zero(3 * size, 3 * size);
    for (Eigen::Index i = 0; i < size; ++i) {
      const auto row = static_cast<std::size_t>(i);
      const Eigen::Matrix3d axes = drawn.axes();
      all_axes.block<3, 3>(3 * i, 3 * i) = axes;
      by_bodies.set_axes(row, axes);
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
    w = (all_axes.transpose() * w * all_axes).eval();
    for (Eigen::Index i = 0; i < size; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        dense.set_block(static_cast<std::size_t>(i), static_cast<std::size_t>(j), w.block<3, 3>(3 * i, 3 * j));
      }
    }
  }

  BodyRows by_bodies;
  DenseRows dense;
  Eigen::MatrixXd w;  // along the rows' axes
};

template <class Rows>
Eigen::VectorXd velocities_of(const Rows& rows, const Eigen::VectorXd& impulses) {
  auto velocities = rows.at_rest();
  std::vector<double> padded(dense_stride(static_cast<std::size_t>(impulses.size())), 0.0);
  std::ranges::copy(impulses, padded.begin());
  rows.push_all(padded, velocities);
  Eigen::VectorXd all(impulses.size());
  for (std::size_t row = 0; row < rows.count(); ++row) {
    all.segment<3>(3 * static_cast<Eigen::Index>(row)) = rows.velocity_m_s(row, velocities);
  }
  return all;
}

TEST(BodyRows, AnswerAsTheirMatrixDoes) {
  for (const std::size_t rows : {1U, 5U, 8U, 23U}) {
    const RowsOfTwoBodies both(rows, static_cast<unsigned>(rows));
    RowDraw drawn(7);
    const Eigen::VectorXd impulses = Eigen::VectorXd::NullaryExpr(both.w.rows(), [&] { return drawn.number(); });
    EXPECT_LT((velocities_of(both.by_bodies, impulses) - both.w * impulses).norm(), 1e-12);
    EXPECT_LT((velocities_of(both.dense, impulses) - both.w * impulses).norm(), 1e-12);
    for (std::size_t at = 0; at < 3 * rows; ++at) {
      const auto k = static_cast<Eigen::Index>(at);
      EXPECT_NEAR(both.by_bodies.diagonal_1_kg(at), both.w(k, k), 1e-13);
    }
  }
}

// Rows that stick, that press alone, that slide along a tangent, and that are free across alone, in turns.
std::vector<RowDirection> directions_of(std::size_t rows, std::size_t kinds) {
  std::vector<RowDirection> directions;
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t n = 3 * row;
    switch (row % kinds) {
      case 0:
        for (std::size_t axis = 0; axis < 3; ++axis) directions.push_back({.at = n + axis});
        break;
      case 1:
        directions.push_back({.at = n});
        directions.push_back({.at = n + 1, .share = -0.6, .next_share = 0.8, .bend_1_kg = 0.1});
        break;
      case 2:
        directions.push_back({.at = n});
        break;
      case 3:
        for (std::size_t axis = 1; axis < 3; ++axis) directions.push_back({.at = n + axis});
        break;
      default:
        break;  // not free at all
    }
  }
  return directions;
}

template <class Rows>
void expect_solves(Rows& rows, const Eigen::MatrixXd& w, std::span<const RowDirection> directions) {
  const auto count = static_cast<Eigen::Index>(directions.size());
  Eigen::MatrixXd spanned = Eigen::MatrixXd::Zero(w.rows(), count);
  Eigen::MatrixXd bends = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index a = 0; a < count; ++a) {
    const RowDirection& of = directions[static_cast<std::size_t>(a)];
    const auto at = static_cast<Eigen::Index>(of.at);
    spanned(at, a) = of.share;
    if (of.next_share != 0.0) spanned(at + 1, a) = of.next_share;
    bends(a, a) = of.bend_1_kg;
  }
  RowDraw drawn(11);
  std::vector<double> b(directions.size());
  for (double& value : b) value = drawn.number();
  const Eigen::VectorXd wanted = Eigen::Map<const Eigen::VectorXd>(b.data(), count);
  const Eigen::VectorXd expected = support::inverse(spanned.transpose() * w * spanned + bends) * wanted;
  ASSERT_TRUE(rows.factor(directions));
  rows.solve(b);
  EXPECT_LT((Eigen::Map<const Eigen::VectorXd>(b.data(), count) - expected).norm(), 1e-6 * expected.norm())
      << directions.size();
}

TEST(BodyRows, SolveForWhatDirectionsSpan) {
  for (const std::size_t rows : {1U, 4U, 9U, 26U}) {
    RowsOfTwoBodies both(rows, 20 + static_cast<unsigned>(rows));
    for (const std::size_t kinds : {1U, 2U, 5U}) {
      const std::vector<RowDirection> directions = directions_of(rows, kinds);
      expect_solves(both.by_bodies, both.w, directions);
      expect_solves(both.dense, both.w, directions);
    }
    std::vector<RowDirection> sliding = directions_of(rows, 2);
    std::erase_if(sliding, [](const RowDirection& direction) { return direction.row() % 2 == 0; });
    if (!sliding.empty()) expect_solves(both.by_bodies, both.w, sliding);
  }
}

template <class Rows>
Eigen::VectorXd solution_of(Rows& rows, const Eigen::MatrixXd& w) {
  RowDraw drawn(31);
  DiscProgram<Rows> program(rows);
  for (std::size_t row = 0; row < rows.count(); ++row) {
    const auto at = 3 * static_cast<Eigen::Index>(row) + 1;
    const double across = support::eigenvalues(w.block<2, 2>(at, at)).maxCoeff();
    program.set_row(row, drawn.vector() - Vec3d(0.5, 0.0, 0.0), Vec3d::Zero(), across);
    program.set_friction(row, 0.4);
  }
  std::uint32_t factorisations = 0;
  EXPECT_TRUE(program.solve_with_friction(1e-10, factorisations));
  EXPECT_GT(factorisations, 0U);
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

// Rows that say the same twice are told apart by nothing: any share of the two will do, and what they do together is
// what one of them would.
TEST(BodyRows, SolveForRowsThatSayTheSameTwice) {
  RowDraw drawn(9);
  const LowRankColumns columns = drawn.columns(0.7);
  BodyRows rows(2, 1);
  for (const std::size_t row : {0U, 1U}) {
    rows.add_part(row, 0, 1.0, columns);
    for (const std::size_t by : {0U, 1U}) rows.set_number(row, by, 0.5);
  }
  const std::vector<RowDirection> directions = directions_of(2, 1);
  ASSERT_TRUE(rows.factor(directions));
  std::vector<double> b{1.0, -2.0, 0.5, 1.0, -2.0, 0.5};
  const std::vector<double> wanted = b;
  rows.solve(b);
  EXPECT_LT((velocities_of(rows, Eigen::Map<const Eigen::VectorXd>(b.data(), 6)) -
             Eigen::Map<const Eigen::VectorXd>(wanted.data(), 6))
                .norm(),
            1e-5);
}

TEST(BodyRows, WithoutColumnsOrDirectionsAreTheirNumbersAlone) {
  BodyRows rows(9, 1);
  for (std::size_t row = 0; row < 9; ++row) rows.set_number(row, row, 2.0);
  EXPECT_TRUE(rows.factor({}));
  const std::vector<RowDirection> directions = directions_of(9, 2);
  ASSERT_TRUE(rows.factor(directions));
  std::vector<double> b(directions.size(), 1.0);
  rows.solve(b);
  for (std::size_t a = 0; a < b.size(); ++a) EXPECT_NEAR(b[a], 1.0 / (2.0 + directions[a].bend_1_kg), 1e-8);
  BodyRows negative(1, 1);
  negative.set_number(0, 0, -1.0);
  EXPECT_FALSE(negative.factor(directions_of(1, 1)));
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
