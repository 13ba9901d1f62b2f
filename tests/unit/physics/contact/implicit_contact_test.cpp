// Shows what colliders within an implicit step are made of: which vertices are stopped and at what speed they end on
// the surface; that a held solve meets its holds, solves the rest, and names the impulses by which it held; and that a
// body in such a step moves as those impulses and gravity say.
#include "physics/contact/implicit_contact.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "physics/forces/soft_setup.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/solve_step.h"
#include "unit/physics/body_tables.h"
#include "unit/physics/contact/contact_rig.h"

namespace pneuma::physics {
namespace {

constexpr double tick_s = 1.0 / 60.0;

SoftState<double> dropped_ball(double stiffness_n_m, const Vec3d& position, const Vec3d& velocity,
                               const Surface& of_ball = {}) {
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(2, 0.5);
  body.springs.stiffness_n_m = stiffness_n_m;
  body.surface = of_ball;
  SoftState<double> state = make_soft_state<double>(body);
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    state.x[i] += position;
    state.v[i] = velocity;
  }
  state.dr.assign(state.x.size(), tick_s * velocity);
  return state;
}

std::vector<VertexStop> stops_of(const SoftState<double>& state, const std::vector<ColliderState>& colliders,
                                 const Vec3d& gravity_m_s2 = Vec3d::Zero()) {
  std::vector<SolidMove> moves;
  for (const ColliderState& collider : colliders) moves.push_back(move_of(collider, tick_s));
  BodyBounds bounds;
  fit_boxes(state, bounds);
  std::vector<VertexStop> stops;
  find_stops<double>(state, bounds, moves, SubstepPhysics::of(gravity_m_s2, tick_s), stops);
  return stops;
}

TEST(FindStops, ListsTheVerticesThatWouldEndBehindAPlaneAndTheSpeedThatEndsThemOnIt) {
  const Vec3d velocity(1.0, -6.0, 0.0);
  const SoftState<double> state = dropped_ball(1e3, {0.0, 0.53, 0.0}, velocity, surface(0.5, 0.3));
  const std::vector<VertexStop> stops = stops_of(state, {make_collider(PlaneShape{})});
  std::size_t behind = 0;
  for (std::uint32_t i = 0; i < state.x.size(); ++i) {
    if (state.x[i].y() + state.dr[i].y() >= 0.0) continue;
    ASSERT_LT(behind, stops.size());
    const VertexStop& stop = stops[behind++];
    EXPECT_EQ(stop.vertex, i);
    EXPECT_NEAR((stop.normal - Vec3d::UnitY()).norm(), 0.0, 1e-15);
    EXPECT_NEAR(state.x[i].y() + tick_s * stop.normal_m_s, 0.0, 1e-14);
    EXPECT_NEAR(stop.away_m_s, 0.5 * 6.0, 1e-14);
    EXPECT_EQ(stop.of_surface.norm(), 0.0);
    EXPECT_EQ(stop.surface.friction, 0.3);
  }
  EXPECT_GT(behind, 0U);
  EXPECT_EQ(stops.size(), behind);
}

TEST(FindStops, SeesASurfaceThatComesToABodyAtRest) {
  const SoftState<double> state = dropped_ball(1e3, {0.0, 0.5, 0.0}, Vec3d::Zero(), surface(0.5, 0.0));
  ColliderState floor = make_collider(PlaneShape{});
  floor.collider.velocity = {3.0, 2.0, 0.0};
  const std::vector<VertexStop> stops = stops_of(state, {floor});
  ASSERT_FALSE(stops.empty());
  for (const VertexStop& stop : stops) {
    EXPECT_NEAR(state.x[stop.vertex].y() + tick_s * stop.normal_m_s, tick_s * 2.0, 1e-14);
    EXPECT_NEAR((stop.of_surface - floor.collider.velocity).norm(), 0.0, 1e-14);
    EXPECT_NEAR(stop.away_m_s, 0.5 * 2.0, 1e-14) << "as seen from the surface";
  }
}

TEST(FindStops, InACornerAVertexHasAStopForEachWall) {
  SoftState<double> state = dropped_ball(1e3, Vec3d::Zero(), Vec3d::Constant(150.0));
  const std::vector<VertexStop> stops = stops_of(state, {make_collider(RoomShape{Vec3d::Constant(0.7)})});
  EXPECT_EQ(stops.size(), 3 * state.x.size());
  for (std::size_t i = 0; i + 2 < stops.size(); i += 3) {
    Vec3d normals = Vec3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(stops[i + k].vertex, i / 3);
      normals += stops[i + k].normal;
    }
    EXPECT_NEAR((normals - Vec3d::Constant(-1.0)).norm(), 0.0, 1e-14);
  }
}

TEST(FindStops, OfFloorsWithoutNumberListsAsManyAsTheBodyMayTouch) {
  const SoftState<double> state = dropped_ball(1e3, {0.0, -1.0, 0.0}, {0.0, -1.0, 0.0});
  const std::vector<ColliderState> floors(100, make_collider(PlaneShape{}));
  EXPECT_EQ(stops_of(state, floors).size(), touches_a_vertex_max * state.x.size());
}

TEST(FindStops, LeavesPinnedVerticesAndWhatStaysOutsideAlone) {
  SoftState<double> state = dropped_ball(1e3, {0.0, 0.53, 0.0}, {0.0, -6.0, 0.0});
  state.pinned.assign(state.x.size(), 1);
  EXPECT_TRUE(stops_of(state, {make_collider(PlaneShape{})}).empty());
  EXPECT_TRUE(stops_of(dropped_ball(1e3, {0.0, 0.61, 0.0}, {0.0, -6.0, 0.0}), {make_collider(PlaneShape{})}).empty());
}

/// A stretched ball, the system at its state, and two vertices held: one in a direction, one in all.
struct HeldProblem {
  SoftState<double> state = dropped_ball(300.0, Vec3d::Zero(), {0.3, -1.0, 0.2});
  std::vector<Hold> holds{
      {3, Eigen::Matrix3d::Identity() - Vec3d::UnitY() * Vec3d::UnitY().transpose(), {9.0, 0.5, 9.0}},
      {40, Eigen::Matrix3d::Zero(), {0.1, 0.2, -0.3}}};
  std::vector<Vec3d> b;

  HeldProblem() {
    state.body.springs.rest_scale = 0.8;  // no spring is compressed, so nothing in the tangent is clamped
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      const auto phase = static_cast<double>(i);
      b.emplace_back(0.01 * std::sin(phase), 0.01 * std::cos(3.0 * phase), 0.005);
    }
  }
};

TEST(SolveHeld, MeetsTheHoldsSolvesTheRestAndNamesTheImpulsesOfTheHolds) {
  HeldProblem problem;
  SoftState<double>& state = problem.state;
  BodyTables<double> tables(state);
  tables.tables.matrices->update(tables.tables.held.steps, state, Surroundings{}, tick_s);
  const std::vector<Vec3d> no_gas;
  ImplicitSystem system;
  std::vector<Vec3d> step;
  system.solve_held(state, *tables.tables.held.steps, Surroundings{}, {state.x, state.v, problem.b, no_gas},
                    problem.holds, {.relative = 1e-10}, step);

  EXPECT_NEAR(state.v[3].y() + step[3].y(), 0.5, 1e-12);
  EXPECT_NEAR((state.v[40] + step[40] - Vec3d(0.1, 0.2, -0.3)).norm(), 0.0, 1e-12);

  // M step - s (f(x + s e step) - f(x - s e step)) / 2e, which is the system times the step, is b and the impulses.
  const double e = 1e-6;
  std::vector<Vec3d> ahead = state.x;
  std::vector<Vec3d> behind = state.x;
  std::vector<Vec3d> v_ahead = state.v;
  std::vector<Vec3d> v_behind = state.v;
  for (std::size_t i = 0; i < step.size(); ++i) {
    ahead[i] += tick_s * e * step[i];
    behind[i] -= tick_s * e * step[i];
    v_ahead[i] += e * step[i];
    v_behind[i] -= e * step[i];
  }
  const std::vector<Vec3d> f_ahead = forces_at(state, {}, ahead, v_ahead);
  const std::vector<Vec3d> f_behind = forces_at(state, {}, behind, v_behind);
  double held_n_s = 0.0;
  for (std::size_t i = 0; i < step.size(); ++i) {
    const Vec3d product = state.vertex_mass_kg * step[i] - tick_s * (f_ahead[i] - f_behind[i]) / (2.0 * e);
    const Vec3d impulse_n_s = -system.residual_n_s()[i];
    EXPECT_NEAR((product - problem.b[i] - impulse_n_s).norm(), 0.0, 1e-6) << i;
    const auto hold = std::ranges::find(problem.holds, i, &Hold::vertex);
    const Vec3d free_part = hold == problem.holds.end() ? impulse_n_s : Vec3d(hold->free * impulse_n_s);
    EXPECT_LT(free_part.norm(), 1e-7) << i;
    held_n_s += impulse_n_s.norm();
  }
  EXPECT_GT(held_n_s, 1e-3);
}

TEST(CorrectHeld, TheBodyMovesAsItsHoldsAndGravitySay) {
  HeldProblem problem;
  SoftState<double>& state = problem.state;
  BodyTables<double> tables(state);
  ImplicitSolver<double> solver;
  const std::vector<Vec3d> start = state.v;
  const Surroundings surroundings{{0.0, -9.81, 0.0}, {}};
  std::vector<Vec3d> u = start;
  for (int round = 0; round < 10; ++round) {
    ASSERT_TRUE(solver.correct_held(state, tables.tables, {state.x, start, tick_s}, problem.holds, {1, 1e-6},
                                    surroundings, u, nullptr));
  }
  EXPECT_NEAR(u[3].y(), 0.5, 1e-10);
  EXPECT_NEAR((u[40] - Vec3d(0.1, 0.2, -0.3)).norm(), 0.0, 1e-10);
  Vec3d change = Vec3d::Zero();
  for (std::size_t i = 0; i < u.size(); ++i) change += state.vertex_mass_kg * (u[i] - start[i]);
  const Vec3d impulse_n_s = solver.holding_n_s(3) + solver.holding_n_s(40);
  EXPECT_NEAR((change - impulse_n_s - state.body.mass_kg * tick_s * surroundings.gravity).norm(), 0.0, 1e-6);
  EXPECT_GT(impulse_n_s.norm(), 1e-3);
}

TEST(ImplicitContact, LeavesNoVertexBehindASurfaceThatMoves) {
  for (const double stiffness_n_m : {1e2, 1e4, 1e6}) {
    SoftState<double> state = dropped_ball(stiffness_n_m, {0.0, 0.53, 0.0}, {0.0, -4.0, 0.0}, surface(0.0, 0.5));
    ColliderState floor = make_collider(PlaneShape{});
    floor.collider.velocity = {1.0, 2.0, 0.0};
    const std::vector<SolidMove> moves{move_of(floor, tick_s)};
    BodyTables<double> tables(state);
    SolverScratch<double> scratch;
    const std::vector<Vec3d> start = state.v;
    solve_step<double>(state, tables.tables, {Integrator::implicit_euler, {}}, {}, moves, start, tick_s, scratch,
                       nullptr, nullptr);
    ASSERT_FALSE(state.solve_failed);
    double lowest_m = 1.0;
    for (std::size_t i = 0; i < state.x.size(); ++i) {
      lowest_m = std::min(lowest_m, state.x[i].y() + state.dr[i].y() - tick_s * 2.0);
    }
    EXPECT_NEAR(lowest_m, 0.0, 1e-4) << stiffness_n_m << ": on the surface, where it has gone";
    EXPECT_GT(mean_velocity(state).x(), 0.0) << "friction takes it along";
  }
}

TEST(ImplicitContact, HoldsNoMoreForABodyWithPinsTheMoreOftenItTouches) {
  SoftState<double> state = dropped_ball(1e4, {0.0, 0.53, 0.0}, {0.0, -4.0, 0.0}, surface(0.0, 0.5));
  state.pinned.assign(state.x.size(), 0);
  const auto higher = [](const Vec3d& a, const Vec3d& b) { return a.y() < b.y(); };
  const auto top = static_cast<std::size_t>(std::ranges::max_element(state.x, higher) - state.x.begin());
  state.pinned[top] = 1;
  state.v[top].setZero();
  const ColliderState floor = make_collider(PlaneShape{});
  const std::vector<SolidMove> moves{move_of(floor, tick_s)};
  BodyTables<double> tables(state);
  SolverScratch<double> scratch;
  const auto step = [&, start = state.v] {
    state.v = start;
    solve_step<double>(state, tables.tables, {Integrator::implicit_euler, {}}, {}, moves, start, tick_s, scratch,
                       nullptr, nullptr);
  };
  step();
  ASSERT_FALSE(state.solve_failed);
  const std::size_t after_one = scratch.contact.bytes();
  for (int i = 0; i < 20; ++i) step();
  EXPECT_EQ(scratch.contact.bytes(), after_one);
}

}  // namespace
}  // namespace pneuma::physics
