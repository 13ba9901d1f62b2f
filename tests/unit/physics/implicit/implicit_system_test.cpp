// Shows that the implicit solver's linear system is the derivative of the forces of forces/force_terms.h where nothing
// is clamped, that its solutions solve it, and that they keep the momentum of the right-hand side; that bodies share a
// matrix where they are alike, and that its solutions have the same bits on every instruction set.
#include "physics/implicit/implicit_system.h"

#include <cmath>
#include <tuple>

#include <gtest/gtest.h>

#include "physics/forces/soft_setup.h"
#include "physics/lanes/isa.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/solve_step.h"
#include "physics/state/vertex_masses.h"
#include "unit/physics/body_tables.h"

namespace pneuma::physics {
namespace {

constexpr double s = 0.01;

// A ball with something of everything, blown up so that no spring is compressed.
SoftState<double> stretched_ball(GasLaw law = GasLaw::isothermal) {
  SoftBody body;
  body.mesh = *make_icosphere(1, 1.0);
  body.springs = {.stiffness_n_m = 300.0, .damping_n_s_m = 2.0, .rest_scale = 0.7};
  body.gas = Gas{.moles = 0.1, .law = law};
  body.drag = {.normal = 0.8, .tangential = 0.3};
  SoftState<double> state = make_soft_state<double>(body);
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const auto phase = static_cast<double>(i);
    state.x[i] += 0.03 * Vec3d(std::sin(3.0 * phase), std::cos(5.0 * phase), std::sin(7.0 * phase));
    state.v[i] = {std::cos(phase), std::sin(2.0 * phase), 0.3};
  }
  return state;
}

std::vector<Vec3d> some_direction(std::size_t count) {
  std::vector<Vec3d> u;
  for (std::size_t i = 0; i < count; ++i) {
    const auto phase = static_cast<double>(i);
    u.emplace_back(std::sin(phase + 1.0), std::cos(4.0 * phase), std::sin(2.0 * phase));
  }
  return u;
}

// (f(x + s e u, v + e u) - f(x - s e u, v - e u)) / 2e is (-D - s K) u.
std::vector<Vec3d> system_times(SoftState<double>& state, const Surroundings& surroundings,
                                const std::vector<Vec3d>& u) {
  const double e = 1e-6;
  std::vector<Vec3d> x[2] = {state.x, state.x};
  std::vector<Vec3d> v[2] = {state.v, state.v};
  for (std::size_t i = 0; i < u.size(); ++i) {
    for (const int side : {0, 1}) {
      const double sign = side == 0 ? e : -e;
      x[side][i] += sign * s * u[i];
      v[side][i] += sign * u[i];
    }
  }
  const std::vector<Vec3d> ahead = forces_at(state, surroundings, x[0], v[0]);
  const std::vector<Vec3d> behind = forces_at(state, surroundings, x[1], v[1]);
  std::vector<Vec3d> product(u.size());
  for (std::size_t i = 0; i < u.size(); ++i) {
    product[i] = state.mass_kg(i) * u[i] - s * (ahead[i] - behind[i]) / (2.0 * e);
  }
  return product;
}

double norm(const std::vector<Vec3d>& points) {
  double sum = 0.0;
  for (const Vec3d& point : points) sum += point.squaredNorm();
  return std::sqrt(sum);
}

/// The system at the state's x and v, solved for b.
std::vector<Vec3d> solve(SoftState<double>& state, const std::vector<Vec3d>& b, double tolerance) {
  const Surroundings still{};
  BodyTables<double> body(state);
  body.tables.matrices->update(body.tables.held.steps, state, still, s);
  BodyForces<double> forces;
  forces.evaluate(state, body.tables.lanes, {.surroundings = still}, state.x, state.v);
  ImplicitSystem system;
  std::vector<Vec3d> step;
  system.solve(state, *body.tables.held.steps, still, {state.x, state.v, b, forces.volume_gradient_m2()},
               {.relative = tolerance}, step);
  return step;
}

/// One half of the ball a thousand times stiffer.
void stiffen_half(SoftState<double>& state) {
  for (const Vec3d& x : state.body.mesh->positions_m) {
    state.body.springs.vertex_stiffness_scale.push_back(x.y() > 0.0 ? 1000.0 : 1.0);
  }
}

class Solution : public testing::TestWithParam<std::tuple<GasLaw, bool>> {};

TEST_P(Solution, IsThatOfTheForcesOwnDerivative) {
  SoftState<double> state = stretched_ball(std::get<0>(GetParam()));
  if (std::get<1>(GetParam())) stiffen_half(state);
  // Damping's force turns with the edges too, and wind's with the faces: of velocities alone both are in full.
  state.body.springs.damping_n_s_m = 0.0;
  const std::vector<Vec3d> wanted = some_direction(state.x.size());
  const std::vector<Vec3d> b = system_times(state, {}, wanted);
  std::vector<Vec3d> found = solve(state, b, 1e-10);
  for (std::size_t i = 0; i < found.size(); ++i) found[i] -= wanted[i];
  EXPECT_LT(norm(found) / norm(wanted), 1e-5);
}

INSTANTIATE_TEST_SUITE_P(LawsAndUnlikeSprings, Solution,
                         testing::Combine(testing::Values(GasLaw::isothermal, GasLaw::adiabatic), testing::Bool()));

/// Masses in a ratio of up to 1e6, in no order.
void weigh(SoftState<double>& state) {
  SoftBody body = state.body;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    body.vertex_mass_scale.push_back(std::pow(10.0, 6.0 * static_cast<double>(7 * i % 11) / 10.0));
  }
  state.mass_shares = mass_shares(body);
}

TEST(ImplicitSystem, OfVerticesOfDifferentMassIsThatOfTheForcesOwnDerivative) {
  SoftState<double> state = stretched_ball();
  state.body.springs.damping_n_s_m = 0.0;
  weigh(state);
  const std::vector<Vec3d> wanted = some_direction(state.x.size());
  std::vector<Vec3d> found = solve(state, system_times(state, {}, wanted), 1e-12);
  for (std::size_t i = 0; i < found.size(); ++i) found[i] -= wanted[i];
  EXPECT_LT(norm(found) / norm(wanted), 1e-5);
}

TEST(ImplicitSystem, KeepsTheMomentumOfVerticesOfDifferentMass) {
  SoftState<double> state = stretched_ball();
  weigh(state);
  const std::vector<Vec3d> b = some_direction(state.x.size());
  Vec3d momentum = Vec3d::Zero();
  for (const Vec3d& part : b) momentum += part;
  for (const double tolerance : {1.0, 0.3, 1e-3, 1e-10}) {
    const std::vector<Vec3d> step = solve(state, b, tolerance);
    Vec3d found = Vec3d::Zero();
    for (std::size_t i = 0; i < step.size(); ++i) found += state.mass_kg(i) * step[i];
    EXPECT_LT((found - momentum).norm(), 1e-12 * norm(b)) << tolerance;
  }
}

TEST(ImplicitSystem, KeepsTheMomentumOfTheRightHandSideHoweverEarlyItStops) {
  SoftState<double> state = stretched_ball();
  const std::vector<Vec3d> b = some_direction(state.x.size());
  Vec3d momentum = Vec3d::Zero();
  for (const Vec3d& part : b) momentum += part;
  for (const double tolerance : {1.0, 0.3, 1e-3, 1e-10}) {
    Vec3d found = Vec3d::Zero();
    for (const Vec3d& part : solve(state, b, tolerance)) found += state.vertex_mass_kg * part;
    EXPECT_LT((found - momentum).norm(), 1e-12 * norm(b)) << tolerance;
  }
}

TEST(ImplicitSystem, LeavesPinnedVerticesAlone) {
  SoftState<double> state = stretched_ball();
  state.pinned.assign(state.x.size(), 0);
  state.pinned[3] = 1;
  std::vector<Vec3d> b = some_direction(state.x.size());
  b[3].setZero();
  const std::vector<Vec3d> step = solve(state, b, 1e-8);
  EXPECT_EQ(step[3].norm(), 0.0);
  EXPECT_GT(norm(step), 0.0);
}

TEST(ImplicitMatrices, RefuseAMatrixThatIsNone) {
  SoftState<double> state = stretched_ball();
  state.body.springs.stiffness_n_m = std::nan("");
  ImplicitMatrices matrices;
  ImplicitMatrixPtr matrix;
  matrices.update(matrix, state, Surroundings{}, s);
  EXPECT_EQ(matrix, nullptr);
}

TEST(ImplicitMatrices, AreSharedByBodiesThatAreAlikeAndByNoOthers) {
  ImplicitMatrices matrices;
  const auto matrix_of = [&](const SoftState<double>& state, double step_s) {
    ImplicitMatrixPtr matrix;
    matrices.update(matrix, state, Surroundings{}, step_s);
    return matrix;
  };
  const SoftState<double> ball = stretched_ball();
  SoftState<double> alike = stretched_ball();  // of a mesh of its own, with the same content
  alike.x[3].x() += 1.0;
  const ImplicitMatrixPtr first = matrix_of(ball, s);
  ASSERT_NE(first, nullptr);
  EXPECT_EQ(matrix_of(alike, s), first);
  EXPECT_EQ(matrices.bytes(), first->bytes());
  EXPECT_NE(matrix_of(ball, 2.0 * s), first);
  for (int change = 0; change < 6; ++change) {
    SoftState<double> other = stretched_ball();
    if (change == 0) other.vertex_mass_kg *= 2.0;
    if (change == 1) other.body.springs.stiffness_n_m *= 2.0;
    if (change == 2) other.pinned.assign(other.x.size(), 1);
    if (change == 3) other.grabs.push_back({.id = 1, .vertex = 2, .stiffness_n_m = 1.0});
    if (change == 4) stiffen_half(other);
    if (change == 5) weigh(other);
    EXPECT_NE(matrix_of(other, s), first) << change;
  }
}

TEST(ImplicitMatrices, AreTakenOverFromAnEarlierPlanByWhoWouldFactorTheSame) {
  const SoftState<double> ball = stretched_ball();
  std::vector<HeldMatrices> before(2);  // another body, which had no step yet, comes first
  ImplicitMatrices earlier;
  earlier.update(before[1].steps, ball, Surroundings{}, s);
  earlier.update(before[1].touching, ball, Surroundings{}, 2.0 * s);

  ImplicitMatrices matrices;
  HeldMatrices held;
  matrices.take_over(held, ball, Surroundings{}, before);
  EXPECT_EQ(held.steps, before[1].steps);
  EXPECT_EQ(held.touching, before[1].touching);
  EXPECT_EQ(matrices.bytes(), held.steps->bytes() + held.touching->bytes());
  ImplicitMatrixPtr of_alike;
  matrices.update(of_alike, ball, Surroundings{}, s);
  EXPECT_EQ(of_alike, held.steps);

  SoftState<double> other = ball;
  other.body.springs.stiffness_n_m *= 2.0;
  HeldMatrices none;
  matrices.take_over(none, other, Surroundings{}, before);
  EXPECT_EQ(none.steps, nullptr);
  EXPECT_EQ(none.touching, nullptr);
}

/// A symmetric matrix with a dominant diagonal and `per_row` entries a row.
Eigen::SparseMatrix<double> some_matrix(int count, int per_row) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < count; ++i) {
    entries.emplace_back(i, i, 3.0 * per_row + 1.0);
    for (int k = 0; k < per_row; ++k) {
      const int j = (7 * i + 13 * k * k + 1) % count;
      const double value = std::sin(static_cast<double>(i + 3 * k));
      entries.emplace_back(i, j, value);
      entries.emplace_back(j, i, value);
    }
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// Solves for some right-hand sides and shows that the solutions are; returns them, a row a row of the matrix.
template <std::size_t Columns>
std::vector<FactorRow<Columns>> expect_solved(const Eigen::SparseMatrix<double>& matrix) {
  SparseCholesky factor;
  EXPECT_TRUE(factor.factor(matrix));
  const auto count = static_cast<std::size_t>(matrix.rows());
  const auto wanted = [](std::size_t row, std::size_t column) {
    return std::cos(static_cast<double>(row * (column + 1)));
  };
  std::vector<FactorRow<Columns>> rows(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t c = 0; c < Columns; ++c) rows[factor.places()[i]].columns[c] = wanted(i, c);
  }
  factor.solve(rows);
  std::vector<FactorRow<Columns>> solution(count);
  for (std::size_t i = 0; i < count; ++i) solution[i] = rows[factor.places()[i]];
  for (std::size_t c = 0; c < Columns; ++c) {
    Eigen::VectorXd x(matrix.rows());
    for (std::size_t i = 0; i < count; ++i) x[static_cast<Eigen::Index>(i)] = solution[i].columns[c];
    const Eigen::VectorXd product = matrix * x;
    for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(product[static_cast<Eigen::Index>(i)], wanted(i, c), 1e-12);
  }
  return solution;
}

TEST(SparseCholesky, SolvesWithTheSameBitsOnEveryInstructionSet) {
  const Isa best = isa_in_use();
  for (const auto& [count, per_row] : {std::pair(50, 0), std::pair(50, 1), std::pair(50, 4), std::pair(600, 4)}) {
    const Eigen::SparseMatrix<double> matrix = some_matrix(count, per_row);  // the last has too many entries for rows
    const auto solve_both = [&] { return std::pair(expect_solved<4>(matrix), expect_solved<8>(matrix)); };
    const auto expected = solve_both();
    for (std::size_t i = 0; i < isa_names.size(); ++i) {
      if (!has_isa(static_cast<Isa>(i))) continue;
      ASSERT_TRUE(use_isa(isa_names[i]).ok());
      const auto found = solve_both();
      for (std::size_t row = 0; row < expected.first.size(); ++row) {
        for (std::size_t c = 0; c < 4; ++c) {
          EXPECT_EQ(found.first[row].columns[c], expected.first[row].columns[c]);
          EXPECT_EQ(found.second[row].columns[c], found.first[row].columns[c]) << "4 and 8 columns";
        }
        for (std::size_t c = 4; c < 8; ++c) EXPECT_EQ(found.second[row].columns[c], expected.second[row].columns[c]);
      }
    }
    ASSERT_TRUE(use_isa(isa_names[static_cast<std::size_t>(best)]).ok());
  }
}

TEST(SolveStep, SaysWhereASolveFindsNoFiniteAnswer) {
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2}) {
    SoftState<double> state = stretched_ball();
    state.x[0].x() = std::nan("");
    SolverScratch<double> scratch;
    BodyTables<double> body(state);
    solve_step<double>(state, body.tables, {}, {.integrator = integrator, .dt_s = s}, scratch);
    EXPECT_TRUE(state.solve_failed);
    EXPECT_EQ(state.dr[1].norm(), 0.0) << "nothing moved";
  }
}

}  // namespace
}  // namespace pneuma::physics
