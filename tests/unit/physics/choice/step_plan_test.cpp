// Shows that a plan made anew keeps the tables of the meshes that are still there, and adds only what it lacks.
#include "physics/choice/step_plan.h"

#include <gtest/gtest.h>

#include "physics/forces/gas.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/simulation.h"
#include "unit/physics/lively_world.h"

namespace pneuma::physics {
namespace {

Scene balls_of(const std::shared_ptr<const Mesh>& mesh, int count) {
  Scene scene;
  for (int i = 0; i < count; ++i) {
    SoftBody& body = scene.soft_bodies.emplace_back(ball(std::string("ball-").append(std::to_string(i))));
    body.mesh = mesh;
    body.collision.soft = SoftCollision::none;
  }
  return scene;
}

TEST(StepPlan, KeepsTheTablesOfItsMeshes) {
  const auto mesh = *make_icosphere(1, 0.5);
  Simulation sim(balls_of(mesh, 2), {1, Integrator::midpoint, ""});
  auto& bodies = std::get<SoftBodies<double>>(sim.soft);
  const auto tables = bodies.plan.meshes;
  ASSERT_EQ(tables.size(), 1U);
  lose_gas(bodies.states[0]);
  sim.make_plan();
  EXPECT_EQ(bodies.plan.meshes, tables);
  EXPECT_EQ(bodies.plan.groups.size(), 2U);

  bodies.states[0].body.mesh = *make_icosphere(2, 0.5);
  sim.make_plan();
  ASSERT_EQ(bodies.plan.meshes.size(), 2U);
  EXPECT_NE(bodies.plan.meshes[0], tables[0]);
  EXPECT_EQ(bodies.plan.meshes[1], tables[0]);
}

TEST(StepPlan, AddsEdgesToTablesThatAFleetTakesOver) {
  const auto mesh = *make_icosphere(1, 0.5);
  const Simulation few(balls_of(mesh, 1), {1, Integrator::midpoint, ""});
  const Simulation many(balls_of(mesh, 16), {1, Integrator::midpoint, ""});
  const auto& states = std::get<SoftBodies<double>>(many.soft).states;
  const auto& anew = std::get<SoftBodies<double>>(many.soft).plan;
  const auto plan =
      make_step_plan<double>(states, false, Abreast::of_the_world, std::get<SoftBodies<double>>(few.soft).plan);
  EXPECT_EQ(plan.meshes[0]->edges.ends, anew.meshes[0]->edges.ends);
  EXPECT_FALSE(plan.meshes[0]->edges.ends.empty());  // double precision
}

// Which of the two ways a processor takes changes no bit.
template <class Real>
void expect_fleets_to_move_alike_by_rings_and_by_edges(Precision precision, double damping_n_s_m, bool gas) {
  const auto mesh = *make_icosphere(1, 0.5);
  Scene scene = balls_of(mesh, 16);
  scene.stepping.precision = precision;
  for (SoftBody& body : scene.soft_bodies) {
    body.springs.damping_n_s_m = damping_n_s_m;
    body.angular_velocity = Vec3d(1.0, 2.0, 0.5);
    if (!gas) body.gas.reset();
  }
  Workers workers(1);
  const auto moved = [&](bool by_edges) {
    Simulation sim(scene, {8, Integrator::symplectic_euler, ""});
    auto& bodies = std::get<SoftBodies<Real>>(sim.soft);
    auto lanes = std::make_shared<LaneMesh<Real>>(*bodies.plan.meshes[0]);
    lanes->edges = by_edges ? make_ring_edges<Real>(*mesh, lanes->rings, {}) : RingEdges<Real>{};
    bodies.plan.meshes[0] = lanes;
    for (int tick = 0; tick < 5; ++tick) {
      while (!sim.substep(workers)) {
      }
    }
    return bodies.states[7].x;
  };
  EXPECT_EQ(moved(true), moved(false)) << damping_n_s_m << (gas ? " gas" : " no gas");
}

TEST(StepPlan, FleetsMoveAlikeByRingsAndByEdges) {
  for (const double damping_n_s_m : {0.0, 0.5}) {
    for (const bool gas : {false, true}) {
      expect_fleets_to_move_alike_by_rings_and_by_edges<float>(Precision::single_precision, damping_n_s_m, gas);
      expect_fleets_to_move_alike_by_rings_and_by_edges<double>(Precision::double_precision, damping_n_s_m, gas);
    }
  }
}

TEST(StepPlan, MakesNoEdgesForBodiesThatMayTouchAndAreTooFewForAFleet) {
  const auto mesh = *make_icosphere(1, 0.5);
  const Simulation free(balls_of(mesh, 16), {1, Integrator::midpoint, ""});
  const auto states = std::span(std::get<SoftBodies<double>>(free.soft).states);
  const auto has_edges = [&](std::size_t count, bool solids) {
    const auto plan = make_step_plan<double>(states.first(count), solids, Abreast::of_several_worlds, {});
    return !plan.meshes[0]->edges.ends.empty();
  };
  EXPECT_TRUE(has_edges(1, false)) << "others may be in other worlds";
  EXPECT_FALSE(has_edges(1, true));
  EXPECT_TRUE(has_edges(16, true));
}

TEST(StepPlan, LeavesNoThreadWithoutATaskForTheSakeOfAFleet) {
  const auto mesh = *make_icosphere(1, 0.5);
  const Simulation free(balls_of(mesh, 16), {1, Integrator::midpoint, ""});
  const auto& bodies = std::get<SoftBodies<double>>(free.soft);
  const std::size_t width = bodies.plan.kernels->width;
  for (const std::size_t threads : {1U, 2U, 16U}) {
    Workers workers(threads);
    const auto tasks = cut_into_tasks<double>(bodies.plan, bodies.states, {.workers = &workers});
    EXPECT_GE(tasks.size(), threads);
    if (threads == 1) {
      EXPECT_EQ(tasks.size(), 16 / width);
    }
  }
}

TEST(StepPlan, GivesBodiesOfOneMeshWithOtherFactorsTablesOfTheirOwn) {
  const auto mesh = *make_icosphere(1, 0.5);
  Scene scene = balls_of(mesh, 3);
  scene.soft_bodies[1].springs.vertex_stiffness_scale.assign(mesh->positions_m.size(), 2.0);
  scene.soft_bodies[2].springs.vertex_stiffness_scale.assign(mesh->positions_m.size(), 2.0);
  Simulation sim(scene, {1, Integrator::midpoint, ""});
  auto& bodies = std::get<SoftBodies<double>>(sim.soft);
  EXPECT_EQ(bodies.plan.mesh_of_body, (std::vector<std::size_t>{0, 1, 1}));
  EXPECT_EQ(bodies.plan.groups.size(), 2U);
  EXPECT_TRUE(bodies.plan.meshes[0]->stiffness_scales.empty());
  const auto tables = bodies.plan.meshes;

  bodies.states[2].body.springs.vertex_stiffness_scale[5] = 3.0;
  sim.make_plan();
  ASSERT_EQ(bodies.plan.meshes.size(), 3U);
  EXPECT_EQ(bodies.plan.meshes[0], tables[0]);
  EXPECT_EQ(bodies.plan.meshes[1], tables[1]);
  EXPECT_NE(bodies.plan.meshes[2]->stiffness_scales, tables[1]->stiffness_scales);
}

}  // namespace
}  // namespace pneuma::physics
