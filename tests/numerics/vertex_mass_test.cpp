// Shows that vertices of different mass move as they should: frequencies against closed forms, momentum and angular
// momentum kept, every integrator at its order; and that what is done for them is nothing to a body whose shares are
// all 1, on every path, to the bit.
#include <numbers>
#include <span>

#include <Eigen/Geometry>

#include "numerics/worlds.h"
#include "physics/simulation.h"
#include "support/eigen_solvers.h"

namespace pneuma::physics {
namespace {

constexpr double heavy = 1e6;

/// One factor a vertex, from 1 to `ratio`, in no order.
std::vector<double> mixed_scales(std::size_t count, double ratio) {
  std::vector<double> scales;
  for (std::size_t i = 0; i < count; ++i) scales.push_back(std::pow(ratio, static_cast<double>(7 * i % 11) / 10.0));
  return scales;
}

/// A ball that turns, with one vertex a million times heavier than each of the others, as they are in a ball of 1 kg.
Scene lopsided_ball(Integrator integrator) {
  BreathingBall ball{.subdivisions = 2, .stiffness_n_m = 1000.0, .damping_n_s_m = 1.0, .nrt_j = 100.0};
  Scene scene = ball.scene(1.0, integrator, 60, 0);
  SoftBody& body = scene.soft_bodies[0];
  body.vertex_mass_scale.assign(body.mesh->positions_m.size(), 1.0);
  body.vertex_mass_scale[5] = heavy;
  body.mass_kg = (heavy + 161.0) / 162.0;
  body.velocity = {2.0, -1.0, 0.5};
  body.angular_velocity = {1.0, 2.0, -1.0};
  return scene;
}

Vec3d spin(const BodyMeasures& sums) {
  return sums.angular_momentum - sums.centre_of_mass.cross(sums.momentum);
}

class VertexMasses : public testing::TestWithParam<Integrator> {};
class VertexMassesByAMethod : public VertexMasses {};  // that AUTO is none of

// Two masses on a spring: w^2 = k (1 / m1 + 1 / m2). The third vertex is so far that its springs pull across, and a
// pin.
TEST_P(VertexMasses, SwingOnASpringAtTheTwoMassFrequency) {
  constexpr double far_m = 100.0;
  constexpr double length_m = 0.1;
  constexpr double stiffness_n_m = 50.0;
  const double m1_kg = 0.2;
  const double m2_kg = 5.0;
  Scene scene;
  scene.stepping = {
      .rate_hz = 1000, .substeps = 8, .integrator = GetParam(), .on_unstable = OnUnstable::allow, .sleep = false};
  SoftBody body;
  body.name = "pair";
  body.mesh = *make_mesh({{0, 0, 0}, {0, 0, length_m}, {far_m, 0, 0.5 * length_m}}, {{0, 1, 2}});
  body.vertex_mass_scale = {m1_kg, m2_kg, 1.0};
  body.mass_kg = m1_kg + m2_kg + 1.0;
  body.springs.stiffness_n_m = stiffness_n_m;
  body.start_positions_m = body.mesh->positions_m;
  body.start_positions_m[0].z() = -0.01 * length_m;
  body.pins = {2};
  scene.soft_bodies = {body};
  World world = make_world(std::move(scene));
  std::vector<double> stretch_m;
  for (int tick = 0; tick < 2000; ++tick) {
    run_ticks(world, 1);
    const std::vector<Vec3d> x = positions_of(world);
    stretch_m.push_back((x[1] - x[0]).norm() - length_m);
  }
  const double expected_s = 2.0 * std::numbers::pi / std::sqrt(stiffness_n_m * (1.0 / m1_kg + 1.0 / m2_kg));
  EXPECT_NEAR(period_s(stretch_m, 1e-3) / expected_s, 1.0, 1e-4);
}

TEST_P(VertexMasses, KeepMomentumBesideAMillionTimesHeavierVertex) {
  World world = make_world(lopsided_ball(GetParam()));
  const BodyMeasures start = world.measure(0);
  run_ticks(world, 60);
  const BodyMeasures sums = world.measure(0);
  EXPECT_LT((sums.momentum - start.momentum).norm(), 1e-12 * start.momentum.norm());
  const double spin_lost = (spin(sums) - spin(start)).norm() / spin(start).norm();
  const bool keeps_spin = world.integrator() == Integrator::symplectic_euler;
  EXPECT_LT(spin_lost, keeps_spin ? 1e-8 : 1e-3);
  // The light ones do swing about it: the motion is not that of a rigid body, and not that of the heavy one alone.
  EXPECT_GT(sums.max_speed_m_s, 1.5 * start.momentum.norm() / world.soft_body(0).mass_kg);
}

// Every force acts in it; the reference is RK4 at a step far finer.
TEST_P(VertexMassesByAMethod, AreSteppedAtItsOrder) {
  Scene scene = all_forces_scene();
  scene.soft_bodies[0].vertex_mass_scale = mixed_scales(42, 30.0);
  const std::vector<Vec3d> exact = after_a_thirtieth(scene, Integrator::rk4, 4096);
  const auto error_m = [&](std::uint32_t substeps) {
    return distance_m(after_a_thirtieth(scene, GetParam(), substeps), exact);
  };
  const double coarse_m = error_m(128);
  const double fine_m = error_m(256);
  EXPECT_GT(std::log2(coarse_m / fine_m), order_of(GetParam()) - 0.15) << coarse_m << " m, " << fine_m << " m";
}

TEST_P(VertexMasses, KeepMomentumWhereTwoBallsAndAStoneMeet) {
  Scene scene = lopsided_ball(GetParam());
  scene.stepping.error_target = 0.05;
  scene.soft_bodies.push_back(scene.soft_bodies[0]);
  for (std::size_t i = 0; i < 2; ++i) {
    SoftBody& body = scene.soft_bodies[i];
    body.vertex_mass_scale = mixed_scales(162, 100.0);
    body.mass_kg = 1.0 + static_cast<double>(i);
    body.position = {i == 0 ? -0.6 : 0.6, 0.0, 0.0};
    body.velocity = {i == 0 ? 2.0 : -2.0, 0.0, 0.0};
  }
  scene.soft_bodies[1].name = "other";
  RigidBody stone;
  stone.name = "stone";
  stone.shape = SphereShape{0.2};
  stone.mass_kg = 0.5;
  stone.position = {-1.5, 0.1, 0.0};
  stone.velocity = {6.0, 0.0, 0.0};
  scene.rigid_bodies = {stone};
  World world = make_world(std::move(scene));
  const auto momentum = [&] {
    return Vec3d(world.measure(0).momentum + world.measure(1).momentum +
                 stone.mass_kg * world.rigid_bodies()[0].velocity);
  };
  const Vec3d before = momentum();
  const Vec3d of_first = world.measure(0).momentum;
  run_ticks(world, 60);
  EXPECT_LT((momentum() - before).norm(), 1e-11 * before.norm());
  EXPECT_GT((world.measure(0).momentum - of_first).norm(), 1.0);
  EXPECT_LT(world.rigid_bodies()[0].velocity.x(), 5.0);
}

constexpr std::array all_and_automatic{
    Integrator::automatic,        Integrator::explicit_euler, Integrator::midpoint, Integrator::rk4,
    Integrator::symplectic_euler, Integrator::implicit_euler, Integrator::tr_bdf2,  Integrator::xpbd};
INSTANTIATE_TEST_SUITE_P(Integrators, VertexMasses, testing::ValuesIn(all_and_automatic), test_name_of);
INSTANTIATE_TEST_SUITE_P(Integrators, VertexMassesByAMethod, testing::ValuesIn(std::span(all_and_automatic).subspan(1)),
                         test_name_of);

/// What the masses are part of: floor, friction, a partner, a stone, a pin, a grab, wind, gas.
Scene busy_scene(Integrator integrator, Precision precision) {
  Scene scene = all_forces_scene();
  scene.stepping = {.rate_hz = 60,
                    .substeps = 40,
                    .integrator = integrator,
                    .precision = precision,
                    .on_unstable = OnUnstable::allow};
  scene.soft_bodies.push_back(scene.soft_bodies[0]);
  SoftBody& free = scene.soft_bodies[1];
  free.name = "free";
  free.pins.clear();
  free.position = {0.0, 1.0, 0.1};
  scene.soft_bodies.push_back(free);
  SoftBody& plain = scene.soft_bodies[2];  // without what the lane kernels do not know
  plain.name = "plain";
  plain.position = {1.2, 0.2, 0.0};
  plain.drag = {};
  plain.springs.bend_stiffness_n_m = 0.0;
  RigidBody stone;
  stone.name = "stone";
  stone.shape = SphereShape{0.2};
  stone.position = {1.2, 1.0, 0.0};
  scene.rigid_bodies = {stone};
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  floor.position = {0.0, -0.55, 0.0};
  floor.surface = {.restitution = 0.3, .friction = 0.5};
  scene.colliders = {floor};
  return scene;
}

template <class Real>
std::vector<SoftState<Real>> after_ticks(const Scene& scene, bool with_shares) {
  Simulation simulation(scene, {scene.stepping.substeps, scene.stepping.integrator, ""});
  auto& states = std::get<SoftBodies<Real>>(simulation.soft).states;
  if (with_shares) {
    for (SoftState<Real>& state : states) state.mass_shares.assign(state.x.size(), 1.0);
    simulation.make_plan();
  }
  Workers workers(1);
  for (int i = 0; i < 30 * static_cast<int>(scene.stepping.substeps); ++i) (void)simulation.substep(workers);
  return states;
}

template <class Real>
void expect_shares_of_one_to_change_nothing(const Scene& scene) {
  const std::vector<SoftState<Real>> plain = after_ticks<Real>(scene, false);
  const std::vector<SoftState<Real>> shared = after_ticks<Real>(scene, true);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    EXPECT_FALSE(plain[i].frozen);
    EXPECT_TRUE(plain[i].x == shared[i].x && plain[i].v == shared[i].v)
        << name_of(scene.stepping.integrator) << ", " << plain[i].body.name;
  }
}

TEST(MassShares, OfOneChangeNoBitOnAnyPath) {
  for (const Integrator integrator : every_integrator) {
    expect_shares_of_one_to_change_nothing<double>(busy_scene(integrator, Precision::double_precision));
    expect_shares_of_one_to_change_nothing<float>(busy_scene(integrator, Precision::single_precision));
  }
}

TEST(MassShares, OfFactorsThatAreAllAlikeAreNone) {
  Scene scene = busy_scene(Integrator::midpoint, Precision::double_precision);
  World plain = make_world(scene);
  for (SoftBody& body : scene.soft_bodies) body.vertex_mass_scale.assign(body.mesh->positions_m.size(), 0.3);
  World alike = make_world(scene);
  run_ticks(plain, 10);
  run_ticks(alike, 10);
  EXPECT_EQ(plain.state_hash(), alike.state_hash());
}

// The largest eigenvalue of M^-1/2 (K + dP/dV gradV gradV^T) M^-1/2, from the dense matrices by differences of the
// forces' own linear law: the estimate is that from above, within its margin, and the bound is above both.
TEST(MassShares, CountInTheFastestFrequency) {
  SoftBody body = BreathingBall{.subdivisions = 1, .stiffness_n_m = 300.0, .nrt_j = 80.0}.body(1.0);
  body.vertex_mass_scale = mixed_scales(42, 1000.0);
  const Mesh& mesh = *body.mesh;
  const auto count = static_cast<Eigen::Index>(mesh.positions_m.size());
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(3 * count, 3 * count);
  for (const auto& [a, b] : mesh.edges) {
    Eigen::VectorXd along = Eigen::VectorXd::Zero(3 * count);
    const Vec3d n = (mesh.positions_m[b] - mesh.positions_m[a]).normalized();
    along.segment<3>(3 * static_cast<Eigen::Index>(a)) = -n;
    along.segment<3>(3 * static_cast<Eigen::Index>(b)) = n;
    stiffness += body.springs.stiffness_n_m * along * along.transpose();
  }
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(3 * count);
  for (const auto& [a, b, c] : mesh.faces) {
    const std::vector<Vec3d>& x = mesh.positions_m;
    const Vec3d share = (x[b] - x[a]).cross(x[c] - x[a]) / 6.0;
    for (const std::uint32_t vertex : {a, b, c}) gradient.segment<3>(3 * static_cast<Eigen::Index>(vertex)) += share;
  }
  const double volume_m3 = signed_volume_m3(mesh.positions_m, mesh.faces);
  stiffness += 80.0 / (volume_m3 * volume_m3) * gradient * gradient.transpose();
  double sum = 0.0;
  for (const double scale : body.vertex_mass_scale) sum += scale;
  for (Eigen::Index i = 0; i < 3 * count; ++i) {
    const double mass_kg = body.mass_kg * body.vertex_mass_scale[static_cast<std::size_t>(i / 3)] / sum;
    stiffness.row(i) /= std::sqrt(mass_kg);
    stiffness.col(i) /= std::sqrt(mass_kg);
  }
  const double fastest_rad_s = std::sqrt(support::eigenvalues(stiffness).maxCoeff());
  const double estimate_rad_s = estimate_frequencies(body, {}).fastest_rad_s;
  EXPECT_GT(estimate_rad_s, fastest_rad_s);
  EXPECT_LT(estimate_rad_s, 1.06 * fastest_rad_s);
  EXPECT_GT(bound_frequencies(body, {}).fastest_rad_s, estimate_rad_s);
}

// A light vertex makes the step short: the one that is chosen holds, and the undamped ball does not grow.
TEST(MassShares, OfAFeatherAskForStepsThatHold) {
  for (const Integrator integrator : {Integrator::symplectic_euler, Integrator::rk4}) {
    const BreathingBall ball{.subdivisions = 2};
    Scene scene = ball.scene(0.97 * ball.equilibrium_scale(), integrator, 60, 0);
    const std::uint32_t even = make_world(scene).substeps();
    scene.soft_bodies[0].vertex_mass_scale.assign(162, 1.0);
    scene.soft_bodies[0].vertex_mass_scale[40] = 1e-3;
    World world = make_world(scene);
    EXPECT_GT(world.substeps(), 5 * even);
    const auto energy_j = [&] {
      const BodyMeasures sums = world.measure(0);
      return sums.kinetic_j + sums.elastic_j + sums.gas_j;
    };
    const double before_j = energy_j();
    const double elastic_j = world.measure(0).elastic_j;
    run_ticks(world, 120);
    EXPECT_NEAR(energy_j(), before_j, 0.01 * elastic_j);
  }
}

}  // namespace
}  // namespace pneuma::physics
