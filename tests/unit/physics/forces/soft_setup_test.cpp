// Shows that a body begins where its scene places its vertices, while its springs, its bends and the volume that its
// gas is measured by stay those of its mesh, and that they have the masses that it gives them: energies, pressures and
// temperatures against their closed forms.
#include "physics/forces/soft_setup.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "physics/forces/gas.h"
#include "physics/forces/measures.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::physics {
namespace {

constexpr double stiffness_n_m = 40.0;

SoftBody plain_ball(double radius_m = 0.5) {
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(2, radius_m);
  body.springs.stiffness_n_m = stiffness_n_m;
  return body;
}

/// The mesh's shape, `scale` times as large; inside out where negative.
std::vector<Vec3d> scaled_shape(const SoftBody& body, double scale) {
  std::vector<Vec3d> shape;
  for (const Vec3d& position : body.mesh->positions_m) shape.emplace_back(scale * position);
  return shape;
}

SoftBody started(SoftBody body, double scale) {
  body.start_positions_m = scaled_shape(body, scale);
  return body;
}

World world_of(const SoftBody& body) {
  Scene scene;
  scene.soft_bodies = {body};
  auto world = World::create(scene);
  if (!world.ok()) throw std::runtime_error(world.status().message());
  return std::move(*world);
}

TEST(StartPositions, ArePlacedAsTheBodyIs) {
  SoftBody body = started(plain_ball(), 0.5);
  body.position = {1, 2, 3};
  body.orientation = Quatd(Eigen::AngleAxisd(0.7, Vec3d(1, 1, 0).normalized()));
  body.velocity = {0, 1, 0};
  body.angular_velocity = {0, 0, 2};
  const SoftState<double> state = make_soft_state<double>(body);
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const Vec3d arm = body.orientation * (0.5 * body.mesh->positions_m[i]);
    EXPECT_LT((state.x[i] - (body.position + arm)).norm(), 1e-15);
    EXPECT_LT((state.v[i] - (body.velocity + body.angular_velocity.cross(arm))).norm(), 1e-15);
  }
}

TEST(StartPositions, OfTheMeshItselfChangeNothing) {
  SoftBody body = plain_ball();
  body.gas = Gas{.moles = 0.01};
  World plain = world_of(body);
  World placed = world_of(started(body, 1.0));
  Workers workers(1);
  for (int i = 0; i < 30; ++i) {
    plain.step_tick(workers);
    placed.step_tick(workers);
  }
  EXPECT_EQ(plain.state_hash(), placed.state_hash());
}

TEST(StartPositions, LeaveSpringsTheirRestLengths) {
  const SoftBody body = started(plain_ball(), 0.5);
  double squares_m2 = 0.0;
  for (const double length_m : body.mesh->edge_lengths_m) squares_m2 += length_m * length_m;
  EXPECT_NEAR(world_of(body).measure(0).elastic_j, 0.5 * stiffness_n_m * 0.25 * squares_m2, 1e-12);
}

TEST(StartPositions, GasHasItsTemperatureInThemAndIsMeasuredByTheMesh) {
  for (const GasLaw law : {GasLaw::isothermal, GasLaw::adiabatic}) {
    SoftBody body = plain_ball();
    body.gas = Gas{.moles = 0.01, .temperature_k = 300.0, .law = law};
    const double volume_m3 = signed_volume_m3(body.mesh->positions_m, body.mesh->faces);
    const SoftState<double> state = make_soft_state<double>(started(body, 0.5));
    EXPECT_NEAR(state.gas->volume_ref_m3, volume_m3, 1e-15);
    EXPECT_NEAR(gas_temperature_k(*state.gas, *body.gas, volume_m3 / 8), 300.0, 1e-9);
    EXPECT_NEAR(gas_temperature_k(*state.gas, *body.gas, volume_m3),
                law == GasLaw::adiabatic ? 300.0 * std::pow(1.0 / 8.0, 0.4) : 300.0, 1e-9);
  }
}

TEST(StartPositions, InsideOutIsToldOfAndStaysFinite) {
  SoftBody body = plain_ball();
  body.gas = Gas{.moles = 0.01};
  World world = world_of(started(body, -1.0));
  Workers workers(1);
  world.step_tick(workers);
  const std::vector<BodyGasEvent> events = world.take_gas_events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].event.kind, GasEvent::Kind::inverted);
  for (int i = 0; i < 120; ++i) world.step_tick(workers);
  EXPECT_TRUE(std::isfinite(world.measure(0).volume_m3));
}

TEST(StartPositions, OtherOnesBeginTheBodyAnew) {
  EXPECT_TRUE(continues(started(plain_ball(), 0.5), started(plain_ball(), 0.5)));
  EXPECT_FALSE(continues(started(plain_ball(), 0.5), started(plain_ball(), 0.6)));
  EXPECT_FALSE(continues(started(plain_ball(), 0.5), plain_ball()));
}

TEST(VertexMasses, ShareTheBodysMassByTheirFactors) {
  SoftBody body = plain_ball();
  body.mass_kg = 3.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < 162; ++i) body.vertex_mass_scale.push_back(1.0 + 0.5 * static_cast<double>(i % 5));
  for (const double scale : body.vertex_mass_scale) sum += scale;
  const SoftState<float> single = make_soft_state<float>(body);
  const SoftState<double> state = make_soft_state<double>(body);
  double mass_kg = 0.0;
  for (std::size_t i = 0; i < 162; ++i) {
    EXPECT_NEAR(state.mass_kg(i), 3.0 * body.vertex_mass_scale[i] / sum, 1e-15);
    EXPECT_NEAR(single.mass_kg(i), state.mass_kg(i), 1e-7 * state.mass_kg(i));
    mass_kg += state.mass_kg(i);
  }
  EXPECT_NEAR(mass_kg, 3.0, 1e-13);
}

TEST(VertexMasses, KeepTheirSharesWhereTheBodysMassChanges) {
  SoftBody body = plain_ball();
  body.vertex_mass_scale.assign(162, 1.0);
  body.vertex_mass_scale[7] = 10.0;
  SoftState<double> state = make_soft_state<double>(body);
  const double before_kg = state.mass_kg(7);
  body.mass_kg *= 4.0;
  change_soft_state(state, body);
  EXPECT_NEAR(state.mass_kg(7), 4.0 * before_kg, 1e-15);
}

TEST(VertexMasses, ChangeInARunningWorldWhereTheVerticesAre) {
  Scene scene;
  scene.soft_bodies = {plain_ball()};
  scene.soft_bodies[0].velocity = {1.0, 0.0, 0.0};
  World world = std::move(*World::create(scene));
  Workers workers(1);
  for (int i = 0; i < 5; ++i) world.step_tick(workers);
  const Vec3d centre = world.measure(0).centre_of_mass;
  Scene edited = world.scene();
  edited.soft_bodies[0].vertex_mass_scale.assign(162, 1.0);
  edited.soft_bodies[0].vertex_mass_scale[7] = 101.0;
  ASSERT_TRUE(world.apply(edited, {}).ok());
  std::vector<double> x(3 * 162);
  world.copy_positions(0, x);
  const Vec3d expected = (162.0 * centre + 100.0 * Vec3d(x[21], x[22], x[23])) / 262.0;
  EXPECT_LT((world.measure(0).centre_of_mass - expected).norm(), 1e-12);
  EXPECT_NEAR(world.measure(0).momentum.x(), 1.0, 1e-12);
  edited.soft_bodies[0].vertex_mass_scale.clear();
  ASSERT_TRUE(world.apply(edited, {}).ok());
  EXPECT_LT((world.measure(0).centre_of_mass - centre).norm(), 1e-12);
}

}  // namespace
}  // namespace pneuma::physics
