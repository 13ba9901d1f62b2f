// Shows that the implicit solver's linear system is the derivative of the forces of forces.h where nothing is clamped,
// that its solutions solve it, and that they keep the momentum of the right-hand side.
#include "physics/implicit_system.h"

#include <cmath>

#include <gtest/gtest.h>

#include "physics/soft_setup.h"
#include "physics/solve_step.h"

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

std::vector<Vec3d> forces_at(SoftState<double>& state, const Surroundings& surroundings, const std::vector<Vec3d>& x,
                             const std::vector<Vec3d>& v) {
  std::vector<Vec3d> force(x.size());
  compute_forces<double>(state, x, v, surroundings, 0.0, force, nullptr);
  return force;
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
    product[i] = state.vertex_mass_kg * u[i] - s * (ahead[i] - behind[i]) / (2.0 * e);
  }
  return product;
}

double norm(const std::vector<Vec3d>& points) {
  double sum = 0.0;
  for (const Vec3d& point : points) sum += point.squaredNorm();
  return std::sqrt(sum);
}

class Solution : public testing::TestWithParam<GasLaw> {};

TEST_P(Solution, IsThatOfTheForcesOwnDerivative) {
  SoftState<double> state = stretched_ball(GetParam());
  // Damping's force turns with the edges too, and wind's with the faces: of velocities alone both are in full.
  state.body.springs.damping_n_s_m = 0.0;
  const Surroundings still{};
  (void)forces_at(state, still, state.x, state.v);
  ImplicitSystem system;
  ASSERT_TRUE(system.set_up(state, still, s));
  const std::vector<Vec3d> wanted = some_direction(state.x.size());
  const std::vector<Vec3d> b = system_times(state, still, wanted);
  (void)forces_at(state, still, state.x, state.v);
  std::vector<Vec3d> found;
  system.solve(state, still, {state.x, state.v, b}, {.relative = 1e-10}, found);
  for (std::size_t i = 0; i < found.size(); ++i) found[i] -= wanted[i];
  EXPECT_LT(norm(found) / norm(wanted), 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Laws, Solution, testing::Values(GasLaw::isothermal, GasLaw::adiabatic));

TEST(ImplicitSystem, KeepsTheMomentumOfTheRightHandSideHoweverEarlyItStops) {
  SoftState<double> state = stretched_ball();
  const Surroundings still{};
  (void)forces_at(state, still, state.x, state.v);
  ImplicitSystem system;
  ASSERT_TRUE(system.set_up(state, still, s));
  const std::vector<Vec3d> b = some_direction(state.x.size());
  Vec3d momentum = Vec3d::Zero();
  for (const Vec3d& part : b) momentum += part;
  for (const double tolerance : {1.0, 0.3, 1e-3, 1e-10}) {
    std::vector<Vec3d> step;
    system.solve(state, still, {state.x, state.v, b}, {.relative = tolerance}, step);
    Vec3d found = Vec3d::Zero();
    for (const Vec3d& part : step) found += state.vertex_mass_kg * part;
    EXPECT_LT((found - momentum).norm(), 1e-12 * norm(b)) << tolerance;
  }
}

TEST(ImplicitSystem, LeavesPinnedVerticesAlone) {
  SoftState<double> state = stretched_ball();
  state.pinned.assign(state.x.size(), 0);
  state.pinned[3] = 1;
  const Surroundings still{};
  (void)forces_at(state, still, state.x, state.v);
  ImplicitSystem system;
  ASSERT_TRUE(system.set_up(state, still, s));
  std::vector<Vec3d> b = some_direction(state.x.size());
  b[3].setZero();
  std::vector<Vec3d> step;
  system.solve(state, still, {state.x, state.v, b}, {.relative = 1e-8}, step);
  EXPECT_EQ(step[3].norm(), 0.0);
  EXPECT_GT(norm(step), 0.0);
}

TEST(ImplicitSystem, RefusesAMatrixThatIsNone) {
  SoftState<double> state = stretched_ball();
  state.body.springs.stiffness_n_m = std::nan("");
  ImplicitSystem system;
  EXPECT_FALSE(system.set_up(state, Surroundings{}, s));
}

TEST(SolveStep, SaysWhereASolveFindsNoFiniteAnswer) {
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2}) {
    SoftState<double> state = stretched_ball();
    state.x[0].x() = std::nan("");
    SolverScratch<double> scratch;
    solve_step<double>(state, {integrator, {}}, Surroundings{}, s, scratch, nullptr);
    EXPECT_TRUE(state.solve_failed);
    EXPECT_EQ(state.dr[1].norm(), 0.0) << "nothing moved";
  }
}

}  // namespace
}  // namespace pneuma::physics
