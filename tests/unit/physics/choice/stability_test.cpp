// Shows that the frequency estimates meet what is known of icospheres and springs, and that the steps chosen from them
// hold: a run with the chosen number of substeps does not grow, for every integrator.
#include "physics/choice/stability.h"

#include <cmath>
#include <tuple>

#include <gtest/gtest.h>

#include "physics/choice/longest_step.h"
#include "physics/choice/step_choice.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"
#include "support/eigen_solvers.h"

namespace pneuma::physics {
namespace {

base::Result<SubstepChoice> substeps_for(const Scene& scene) {
  FrequencyTable none_known;
  return choose_substeps(scene, none_known);
}

SoftBody springy_ball(std::uint32_t subdivisions, double stiffness_n_m, double nrt_j) {
  SoftBody body;
  body.name = "ball";
  body.mesh = *make_icosphere(subdivisions, 1.0);
  body.springs.stiffness_n_m = stiffness_n_m;
  if (nrt_j > 0.0) body.gas = Gas{.moles = nrt_j / (gas_constant_j_mol_k * 293.15)};
  return body;
}

double spring_eigenvalue(const SoftBody& body) {
  const double vertex_mass = body.mass_kg / static_cast<double>(body.mesh->positions_m.size());
  return std::pow(estimate_frequencies(body, {}).fastest_rad_s, 2.0) * vertex_mass / body.springs.stiffness_n_m;
}

TEST(Frequencies, LargestSpringEigenvalueOfAnIcosphereIsSixToSixPointThreeK) {
  for (const std::uint32_t subdivisions : {2U, 3U, 4U}) {
    const double eigenvalue = spring_eigenvalue(springy_ball(subdivisions, 1000.0, 0.0));
    EXPECT_GT(eigenvalue, 6.0);
    EXPECT_LT(eigenvalue, 6.3 * 1.06);  // the estimate's own margin is 5 %
  }
}

TEST(Frequencies, BreathingOfTheIcosahedronMeetsItsClosedForm) {
  const SoftBody body = springy_ball(0, 500.0, 80.0);
  double spring_sum = 0.0;
  for (const double length : body.mesh->edge_lengths_m) spring_sum += 500.0 * length * length;
  // At rest lengths, where the gas adds 3 nRT less what it would at its equilibrium: gradV gradV^T alone gives 9 nRT.
  const double expected = std::sqrt((spring_sum + 9.0 * 80.0) / (body.mass_kg * 1.0));
  EXPECT_NEAR(estimate_frequencies(body, {}).breathing_rad_s, expected, 1e-9 * expected);
}

TEST(Frequencies, DampingFollowsTheSpringsPattern) {
  SoftBody body = springy_ball(2, 1000.0, 0.0);
  body.springs.damping_n_s_m = 5.0;
  const Frequencies frequencies = estimate_frequencies(body, {});
  EXPECT_NEAR(frequencies.fastest_decay_1_s, std::pow(frequencies.fastest_rad_s, 2.0) * 5.0 / 1000.0, 1e-9);
}

// A grid of stretched springs.
SoftBody drum() {
  SoftBody body;
  body.name = "drum";
  body.mesh = *make_grid(40, 40, 1.0, 1.0);
  body.springs = {.stiffness_n_m = 1e5, .rest_scale = 0.05};
  body.pin_boundary = true;
  return body;
}

TEST(Frequencies, OfADrumAreThoseOfWhatPullsItsSprings) {
  // Out of its plane nothing else holds it. The Rayleigh quotient of the vertices where diagonals meet, row against
  // row:
  const SoftBody body = drum();
  const auto out_of_plane = [](std::uint32_t vertex) {
    if (vertex % 2 != 0) return 0.0;
    return vertex / 41 % 2 == 0 ? 1.0 : -1.0;
  };
  const auto vertex_count = static_cast<std::uint32_t>(body.mesh->positions_m.size());
  double stiffness_n_m = 0.0;
  double mass_kg = 0.0;
  for (const auto& [a, b] : body.mesh->edges) {
    stiffness_n_m += 0.95 * body.springs.stiffness_n_m * std::pow(out_of_plane(a) - out_of_plane(b), 2.0);
  }
  for (std::uint32_t i = 0; i < vertex_count; ++i) {
    mass_kg += std::pow(out_of_plane(i), 2.0) * body.mass_kg / vertex_count;
  }
  EXPECT_GE(std::pow(estimate_frequencies(body, {}).fastest_rad_s, 2.0), stiffness_n_m / mass_kg);
  EXPECT_LE(estimate_frequencies(body, {}).fastest_rad_s, bound_frequencies(body, {}).fastest_rad_s);
}

TEST(Substeps, AtTheLimitHoldADrum) {
  Scene scene;
  scene.soft_bodies.push_back(drum());
  const double limit_s = stability_limit_s(Integrator::rk4, estimate_frequencies(drum(), {}));
  const double substeps = std::ceil(1.0 / scene.stepping.rate_hz / limit_s);
  scene.stepping.substeps = static_cast<std::uint32_t>(substeps);
  scene.stepping.integrator = Integrator::rk4;
  auto world = World::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  ASSERT_TRUE(world->apply_impulse("drum", std::uint32_t{800}, Vec3d(0.0, 1e-4, 0.0)).ok());
  const double start_m_s = world->measure(0).max_speed_m_s;
  Workers workers(1);
  for (int tick = 0; tick < 60; ++tick) world->step_tick(workers);
  EXPECT_FALSE(world->is_frozen(0));
  EXPECT_LT(world->measure(0).max_speed_m_s, start_m_s) << substeps << " substeps";
}

// The largest eigenvalue of K + c gradV gradV^T over the vertex mass, with every entry of the matrix.
double dense_fastest_rad_s(const SoftBody& body) {
  const std::vector<Vec3d>& x = body.mesh->positions_m;
  const auto size = static_cast<Eigen::Index>(3 * x.size());
  Eigen::MatrixXd stiffness = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
  for (const auto& [a, b] : body.mesh->edges) {
    const Vec3d n = (x[b] - x[a]).normalized();
    const double stiffness_n_m = body.springs.stiffness_n_m * body.springs.stiffness_scale({a, b});
    const Eigen::Matrix3d block = stiffness_n_m * n * n.transpose();
    for (const auto& [row, column, sign] : {std::tuple(a, a, 1.0), {b, b, 1.0}, {a, b, -1.0}, {b, a, -1.0}}) {
      stiffness.block<3, 3>(3 * row, 3 * column) += sign * block;
    }
  }
  for (const auto& [a, b, c] : body.mesh->faces) {
    const Vec3d share = (x[b] - x[a]).cross(x[c] - x[a]) / 6.0;
    for (const std::uint32_t vertex : {a, b, c}) gradient.segment<3>(3 * vertex) += share;
  }
  const double volume_m3 = signed_volume_m3(x, body.mesh->faces);
  const double nrt_j = body.gas->moles * gas_constant_j_mol_k * body.gas->temperature_k;
  stiffness += nrt_j / (volume_m3 * volume_m3) * gradient * gradient.transpose();
  return std::sqrt(support::eigenvalues(stiffness).maxCoeff() * static_cast<double>(x.size()) / body.mass_kg);
}

TEST(Frequencies, WithGasAreAboveTheMatrixsOwnByAFewPerCent) {
  for (const bool box : {false, true}) {
    for (const double nrt_j : {1.0, 100.0, 500.0, 2e3, 1e4, 1e6}) {
      SoftBody body = springy_ball(1, 1e3, nrt_j);
      if (box) body.mesh = *make_box(Vec3d(1.0, 0.4, 0.2), 2);
      const double dense_rad_s = dense_fastest_rad_s(body);
      const double estimate_rad_s = estimate_frequencies(body, {}).fastest_rad_s;
      EXPECT_GE(estimate_rad_s, dense_rad_s * (1.0 - 1e-9)) << nrt_j << " J" << (box ? ", box" : "");
      EXPECT_LE(estimate_rad_s, dense_rad_s * 1.08) << nrt_j << " J" << (box ? ", box" : "");
    }
  }
}

/// A hemisphere `ratio` times stiffer.
SoftBody half_stiff_ball(double ratio) {
  SoftBody body = springy_ball(1, 200.0, 20.0);
  for (const Vec3d& x : body.mesh->positions_m) {
    body.springs.vertex_stiffness_scale.push_back(x.y() > 0.1 ? ratio : 1.0);
  }
  return body;
}

TEST(Frequencies, OfSpringsThatDifferAreAboveTheMatrixsOwnByAFewPerCent) {
  for (const double ratio : {0.0, 1e-3, 10.0, 1e3, 1e6}) {
    const SoftBody body = half_stiff_ball(ratio);
    const double dense_rad_s = dense_fastest_rad_s(body);
    const double estimate_rad_s = estimate_frequencies(body, {}).fastest_rad_s;
    EXPECT_GE(estimate_rad_s, dense_rad_s * (1.0 - 1e-9)) << ratio;
    EXPECT_LE(estimate_rad_s, dense_rad_s * 1.08) << ratio;
    EXPECT_LE(estimate_rad_s, bound_frequencies(body, {}).fastest_rad_s) << ratio;
  }
}

TEST(Frequencies, BreathingIsThatOfTheSofterPart) {
  const double alike_rad_s = estimate_frequencies(half_stiff_ball(1.0), {}).breathing_rad_s;
  for (const double ratio : {1e3, 1e6, 1e9}) {
    const double breathing_rad_s = estimate_frequencies(half_stiff_ball(ratio), {}).breathing_rad_s;
    EXPECT_GT(breathing_rad_s, 0.5 * alike_rad_s) << ratio;
    EXPECT_LT(breathing_rad_s, 4.0 * alike_rad_s) << ratio;
  }
}

TEST(Frequencies, AreWithinTheirBounds) {
  for (const double nrt_j : {0.0, 50.0, 1e5}) {
    SoftBody body = springy_ball(2, 1000.0, nrt_j);
    body.springs.damping_n_s_m = 3.0;
    body.springs.bend_stiffness_n_m = 0.5;
    const Frequencies estimate = estimate_frequencies(body, {});
    const Frequencies bound = bound_frequencies(body, {});
    EXPECT_LE(estimate.fastest_rad_s, bound.fastest_rad_s);
    EXPECT_LE(estimate.fastest_decay_1_s, bound.fastest_decay_1_s);
    EXPECT_LE(estimate.bending_rad_s, bound.bending_rad_s);
    EXPECT_LT(bound.fastest_rad_s, 3.0 * estimate.fastest_rad_s);
  }
}

/// With springs that are alike, and with some a hundred times stiffer than others.
class ChosenSubsteps : public testing::TestWithParam<std::tuple<Integrator, double>> {};

TEST_P(ChosenSubsteps, Hold) {
  const auto [integrator, ratio] = GetParam();
  Scene scene;
  scene.stepping.integrator = integrator;
  SoftBody body = half_stiff_ball(ratio);
  body.springs.damping_n_s_m = 0.5;
  scene.soft_bodies.push_back(body);
  auto world = World::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  ASSERT_TRUE(world->apply_impulse("ball", std::uint32_t{3}, Vec3d(0.2, 0.1, 0.0)).ok());
  const double energy_at_start = world->measure(0).kinetic_j + world->measure(0).elastic_j + world->measure(0).gas_j;
  Workers workers(1);
  for (int tick = 0; tick < 120; ++tick) world->step_tick(workers);
  EXPECT_FALSE(world->is_frozen(0));
  const double energy = world->measure(0).kinetic_j + world->measure(0).elastic_j + world->measure(0).gas_j;
  EXPECT_LT(energy, energy_at_start) << "integrator " << static_cast<int>(integrator) << ", " << world->substeps()
                                     << " substeps";
}

INSTANTIATE_TEST_SUITE_P(Methods, ChosenSubsteps,
                         testing::Combine(testing::Values(Integrator::explicit_euler, Integrator::midpoint,
                                                          Integrator::rk4, Integrator::symplectic_euler,
                                                          Integrator::implicit_euler, Integrator::tr_bdf2,
                                                          Integrator::xpbd, Integrator::automatic),
                                          testing::Values(1.0, 100.0)));

// Damping is not scaled: the fastest motion, of the stiff vertex, has less of it than the most damped one.
TEST(Substeps, AtTheLimitHoldAStiffVertexAmongSoftOnes) {
  for (const Integrator integrator : {Integrator::explicit_euler, Integrator::midpoint}) {
    SoftBody body = springy_ball(2, 20.0, 0.0);
    body.springs.damping_n_s_m = 0.05;
    body.springs.vertex_stiffness_scale.assign(body.mesh->positions_m.size(), 1.0);
    body.springs.vertex_stiffness_scale[3] = 20.0;
    Scene scene;
    scene.soft_bodies.push_back(body);
    const double limit_s = stability_limit_s(integrator, estimate_frequencies(body, {}));
    scene.stepping.integrator = integrator;
    scene.stepping.substeps = static_cast<std::uint32_t>(std::ceil(1.0 / scene.stepping.rate_hz / limit_s));
    auto world = World::create(scene);
    ASSERT_TRUE(world.ok()) << world.status().message();
    ASSERT_TRUE(world->apply_impulse("ball", std::uint32_t{3}, Vec3d(1e-4, 2e-4, 0.0)).ok());
    const double start_j = world->measure(0).kinetic_j;
    Workers workers(1);
    for (int tick = 0; tick < 120; ++tick) world->step_tick(workers);
    EXPECT_LT(world->measure(0).kinetic_j + world->measure(0).elastic_j, start_j) << name_of(integrator);
  }
}

// The springs' damping stops their own motion at once, and that of the gas, which is faster, hardly.
TEST(Substeps, AtTheLimitHoldAGasThatItsSkinHardlyDamps) {
  for (const Integrator integrator : {Integrator::explicit_euler, Integrator::midpoint}) {
    Scene scene;
    SoftBody body = springy_ball(2, 1.0, 52.0);
    body.springs.damping_n_s_m = 0.1;
    scene.soft_bodies.push_back(body);
    const double limit_s = stability_limit_s(integrator, estimate_frequencies(body, {}));
    scene.stepping.integrator = integrator;
    scene.stepping.substeps = static_cast<std::uint32_t>(std::ceil(1.0 / scene.stepping.rate_hz / limit_s));
    auto world = World::create(scene);
    ASSERT_TRUE(world.ok()) << world.status().message();
    const auto energy_j = [&] {
      const BodyMeasures now = world->measure(0);
      return now.kinetic_j + now.elastic_j + now.gas_j;
    };
    const double at_start_j = energy_j();
    Workers workers(1);
    for (int tick = 0; tick < 60; ++tick) world->step_tick(workers);
    EXPECT_FALSE(world->is_frozen(0)) << name_of(integrator);
    EXPECT_LT(energy_j() - at_start_j, 0.05 * std::abs(at_start_j)) << name_of(integrator);
  }
}

TEST(Substeps, HoldALightClothInAStrongWind) {
  Scene scene;
  scene.stepping.integrator = Integrator::rk4;  // for which the springs alone would allow a longer step than the drag
  scene.atmosphere = {.density_kg_m3 = 1.2, .wind = Vec3d(0.0, 8.0, 0.0)};
  SoftBody cloth;
  cloth.name = "cloth";
  cloth.mesh = *make_grid(20, 20, 2.0, 2.0);
  cloth.mass_kg = 0.02;
  cloth.pin_boundary = true;
  cloth.springs = {.stiffness_n_m = 20.0, .damping_n_s_m = 1e-3};
  cloth.drag.normal = 1.0;
  scene.soft_bodies.push_back(cloth);
  auto world = World::create(scene);
  ASSERT_TRUE(world.ok()) << world.status().message();
  Workers workers(1);
  for (int tick = 0; tick < 120; ++tick) world->step_tick(workers);
  EXPECT_FALSE(world->is_frozen(0)) << world->substeps() << " substeps";
}

TEST(Substeps, AreAsTheSceneSaysWhereItSays) {
  Scene scene;
  scene.stepping.substeps = 130;
  scene.soft_bodies.push_back(springy_ball(2, 1e3, 0.0));
  const auto choice = substeps_for(scene);
  ASSERT_TRUE(choice.ok()) << choice.status().message();
  EXPECT_EQ(choice->substeps, 130U);
  EXPECT_EQ(choice->integrator, Integrator::midpoint);
}

Scene three_substeps_of(double stiffness_n_m) {
  Scene scene;
  scene.stepping = {.substeps = 3, .integrator = Integrator::symplectic_euler};
  scene.soft_bodies.push_back(springy_ball(2, stiffness_n_m, 0.0));
  return scene;
}

TEST(Substeps, TooFewToBeStableAreRefusedWithTheLimitOrRaisedOrAllowed) {
  Scene scene = three_substeps_of(1e6);
  // w^2 = 6.2 k / m: 2 / w is 63 us, a tick of 1/60 s is 264 of these.
  const auto refused = substeps_for(scene);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.status().where(), "stepping.substeps");
  EXPECT_NE(refused.status().what().find("stable up to a step of 6."), std::string::npos) << refused.status().what();

  scene.stepping.on_unstable = OnUnstable::substep;
  const auto raised = substeps_for(scene);
  ASSERT_TRUE(raised.ok());
  EXPECT_GT(raised->substeps, 264U);
  EXPECT_LT(raised->substeps, 2 * 264U * 1.1);
  const std::string taken = std::string("SUBSTEP takes ").append(std::to_string(raised->substeps));
  EXPECT_NE(refused.status().what().find(taken), std::string::npos) << refused.status().what();

  scene.stepping.on_unstable = OnUnstable::allow;
  EXPECT_EQ(substeps_for(scene)->substeps, 3U);
  EXPECT_NE(substeps_for(scene)->reason.find("unstable"), std::string::npos);
}

TEST(Substeps, OfXpbdThatLeaveTheGasTooLargeAVolumeAreRefused) {
  Scene scene;
  scene.stepping = {.integrator = Integrator::xpbd};
  scene.soft_bodies.push_back(springy_ball(2, 100.0, 0.0));
  scene.soft_bodies[0].gas = Gas{.moles = 4.0};
  const std::uint32_t within_1_percent = substeps_for(scene)->substeps;
  // The error falls with the square of the step: within 5 % it takes the square root of a fifth as many.
  const auto within_5_percent = static_cast<std::uint32_t>(std::ceil(within_1_percent / std::sqrt(5.0)));
  scene.stepping.substeps = within_5_percent + 1;
  EXPECT_TRUE(substeps_for(scene).ok());
  scene.stepping.substeps = within_5_percent - 1;
  const auto refused = substeps_for(scene);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.status().what().find("rests within 5 % of its volume"), std::string::npos)
      << refused.status().what();
  scene.stepping.on_unstable = OnUnstable::substep;
  EXPECT_EQ(substeps_for(scene)->substeps, within_1_percent);
  scene.stepping.on_unstable = OnUnstable::allow;
  EXPECT_EQ(substeps_for(scene)->substeps, within_5_percent - 1);
}

TEST(Substeps, TooFewAreRefusedWithWhatIsPastTheirLimitToo) {
  // Stable at 2,640; a margin more is past substeps_max.
  Scene scene = three_substeps_of(1e8);
  const auto refused = substeps_for(scene);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.status().what().find("past the limit of 4096"), std::string::npos) << refused.status().what();
  scene.stepping.on_unstable = OnUnstable::substep;
  EXPECT_FALSE(substeps_for(scene).ok());
}

TEST(Substeps, TheLimitOfSymplecticEulerIsThatOfItsAmplificationFactor) {
  // z^2 - (2 - 2a - b) z + (1 - 2a) = 0 with a = ch/2, b = (wh)^2: a root passes -1 at b + 4a = 4.
  const Frequencies undamped{.fastest_rad_s = 50.0};
  EXPECT_NEAR(stability_limit_s(Integrator::symplectic_euler, undamped), 2.0 / 50.0, 1e-15);
  const Frequencies damped{.fastest_rad_s = 50.0, .fastest_decay_1_s = 30.0};
  const double h = stability_limit_s(Integrator::symplectic_euler, damped);
  EXPECT_NEAR(2500.0 * h * h + 2.0 * 30.0 * h, 4.0, 1e-12);
  for (const Integrator integrator : {Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::xpbd}) {
    EXPECT_TRUE(std::isinf(stability_limit_s(integrator, damped)));
  }
}

TEST(Automatic, TakesAnExplicitMethodForASoftSceneAndAnImplicitOneForAStiffOne) {
  Scene scene;
  scene.stepping.integrator = Integrator::automatic;
  scene.soft_bodies.push_back(springy_ball(2, 20.0, 5.0));
  const auto soft = substeps_for(scene);
  ASSERT_TRUE(soft.ok());
  EXPECT_LE(soft->integrator, Integrator::symplectic_euler);
  scene.soft_bodies.push_back(springy_ball(2, 1e6, 5.0));
  scene.soft_bodies.back().collision.soft = SoftCollision::none;
  const auto stiff = substeps_for(scene);
  ASSERT_TRUE(stiff.ok());
  EXPECT_GE(stiff->integrator, Integrator::implicit_euler);
  EXPECT_LE(stiff->substeps, 4U);
  EXPECT_NE(stiff->reason.find("SYMPLECTIC_EULER asks for"), std::string::npos) << stiff->reason;
}

// The icosahedron's 30 springs of 1.0515 m scale as a whole at sqrt(sum k l^2 / m R^2), with gas at
// sqrt((sum k l^2 + 9 nRT) / m R^2).
TEST(Automatic, SaysHowItsBodyMovesToThreeDigits) {
  const auto reason = [](double nrt_j) {
    Scene scene;
    scene.stepping.integrator = Integrator::automatic;
    scene.soft_bodies.push_back(springy_ball(0, 80.0, nrt_j));
    return substeps_for(scene)->reason;
  };
  EXPECT_NE(reason(0.0).find(" rad/s and stretches as a whole at 51.5 rad/s: "), std::string::npos) << reason(0.0);
  EXPECT_NE(reason(24.0).find(" rad/s and breathes at 53.6 rad/s: "), std::string::npos) << reason(24.0);
}

Scene stiff_ball(double stiffness_n_m) {
  Scene scene;
  scene.stepping.integrator = Integrator::automatic;
  scene.soft_bodies.push_back(springy_ball(2, stiffness_n_m, 5.0));
  return scene;
}

Collider floor() {
  return {.name = "floor", .shape = PlaneShape{}, .surface = {}};
}

TEST(Automatic, TakesAnImplicitMethodForAStiffBodyWhateverItCanTouchAndAnExplicitOneForASoftBody) {
  for (const double stiffness_n_m : {20.0, 1e6}) {
    const Scene alone = stiff_ball(stiffness_n_m);
    Scene on_floor = alone;
    on_floor.colliders.push_back(floor());
    Scene with_stone = alone;
    with_stone.rigid_bodies.push_back({.name = "stone", .shape = SphereShape{0.1}, .surface = {}});
    Scene with_other = alone;
    with_other.soft_bodies.push_back(alone.soft_bodies.front());
    for (const Scene& scene : {alone, on_floor, with_stone, with_other}) {
      const auto choice = substeps_for(scene);
      ASSERT_TRUE(choice.ok());
      const bool stiff = stiffness_n_m > 1e3;
      EXPECT_EQ(is_explicit(choice->integrator), !stiff) << choice->reason;
      const bool can_touch = !scene.colliders.empty() || !scene.rigid_bodies.empty() || scene.soft_bodies.size() > 1;
      const bool counts_contact = choice->reason.find("passes that it takes at contact") != std::string::npos;
      EXPECT_EQ(counts_contact, stiff && can_touch) << choice->reason;
    }
  }
}

TEST(Automatic, TakesTheCheapestStableMethodWhereTheGivenSubstepsAllowNoAccurateOne) {
  // Stable at 2 substeps; a millionth takes RK4 8 of them.
  Scene scene;
  scene.stepping = {.substeps = 3, .integrator = Integrator::automatic, .error_target = 1e-6};
  scene.soft_bodies.push_back(springy_ball(2, 20.0, 5.0));
  const auto choice = substeps_for(scene);
  ASSERT_TRUE(choice.ok());
  EXPECT_EQ(choice->substeps, 3U);
  EXPECT_EQ(choice->integrator, Integrator::symplectic_euler) << choice->reason;
  EXPECT_NE(choice->reason.find("not within the error target"), std::string::npos) << choice->reason;
}

TEST(FrequencyTable, GivesEachBodyItsOwnEstimateWhateverItRemembers) {
  // A wind's drag is added to what is remembered, and nothing else than the numbers that matter is looked at.
  std::vector<SoftBody> bodies{springy_ball(2, 1e3, 5.0), springy_ball(2, 1e3, 5.0), springy_ball(2, 2e3, 5.0)};
  bodies[1].mesh = bodies[0].mesh;
  bodies[1].position = {5.0, 0.0, 0.0};
  bodies[0].drag = bodies[1].drag = {1.0, 0.1};
  FrequencyTable table;
  const auto expect_as_estimated_alone = [&](const Atmosphere& atmosphere) {
    const std::vector<Frequencies> all = table.estimate(bodies, atmosphere);
    ASSERT_EQ(all.size(), bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      EXPECT_EQ(all[i], estimate_frequencies(bodies[i], atmosphere)) << i;
    }
  };
  expect_as_estimated_alone({});
  expect_as_estimated_alone({.density_kg_m3 = 1.2, .wind = {3.0, 0.0, 0.0}});
  bodies[0].gas->moles *= 2.0;
  bodies[1].springs.damping_n_s_m *= 3.0;
  bodies[2].mass_kg *= 4.0;
  expect_as_estimated_alone({});
}

TEST(FrequencyTable, FindsTheModesOfASkinOnceWhateverItsGasAndMass) {
  std::vector<SoftBody> bodies{springy_ball(2, 1e3, 5.0), springy_ball(2, 1e3, 5.0)};
  bodies[1].mesh = bodies[0].mesh;
  bodies[1].gas->moles *= 3.0;
  FrequencyTable table;
  static_cast<void>(table.estimate(bodies, {}));
  EXPECT_EQ(table.skins_found(), 1U);
  bodies[0].gas->moles *= 2.0;
  bodies[0].gas->temperature_k += 10.0;
  bodies[1].gas.reset();
  bodies[1].mass_kg = 3.0;
  static_cast<void>(table.estimate(bodies, {}));
  EXPECT_EQ(table.skins_found(), 1U);
  bodies[1].springs.rest_scale = 0.9;
  static_cast<void>(table.estimate(bodies, {}));
  EXPECT_EQ(table.skins_found(), 2U);
}

TEST(Substeps, PastTheLimitAreRefusedNamingTheBody) {
  Scene scene;
  scene.soft_bodies.push_back(springy_ball(1, 1.0, 0.0));
  scene.soft_bodies.push_back(springy_ball(2, 1e12, 0.0));
  const auto choice = substeps_for(scene);
  ASSERT_FALSE(choice.ok());
  EXPECT_EQ(choice.status().where(), "soft_bodies[1]");
}

}  // namespace
}  // namespace pneuma::physics
