// Shows what a free body must keep: momentum and angular momentum to round-off (the pressure of a closed skin has no
// net force or torque), and the work that its gas does in its springs and its motion; and that bodies which meet have
// no more energy after it.
#include <Eigen/Geometry>

#include "numerics/worlds.h"

namespace pneuma::physics {
namespace {

/// A ball out of shape: stretched, sheared and dented, so that no symmetry helps.
Scene lopsided(Integrator integrator) {
  BreathingBall ball{.subdivisions = 2};
  Scene scene = ball.scene(1.0, integrator, 1000, 1);
  std::vector<Vec3d> positions = scene.soft_bodies[0].mesh->positions_m;
  for (Vec3d& x : positions) {
    x = Vec3d(1.3 * x.x() + 0.2 * x.y(), 0.8 * x.y(), x.z() + 0.3 * x.x() * x.x());
    if (x.y() > 0.25) x.y() -= 0.5 * (x.y() - 0.25);
  }
  scene.soft_bodies[0].mesh = *make_mesh(positions, scene.soft_bodies[0].mesh->faces);
  scene.soft_bodies[0].springs.stiffness_n_m = 30.0;
  scene.soft_bodies[0].springs.damping_n_s_m = 0.01;
  return scene;
}

TEST(FreeBody, KeepsItsMomentumWithEveryIntegrator) {
  for (const Integrator integrator :
       {Integrator::explicit_euler, Integrator::midpoint, Integrator::rk4, Integrator::symplectic_euler,
        Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::xpbd}) {
    Scene scene = lopsided(integrator);
    scene.soft_bodies[0].velocity = {1.0, -2.0, 0.5};
    scene.soft_bodies[0].springs.damping_n_s_m = 0.1;
    World world = make_world(std::move(scene));
    const Vec3d before = world.measure(0).momentum;
    run_ticks(world, 1000);
    EXPECT_GT(world.measure(0).max_speed_m_s, 2.3);
    EXPECT_NEAR((world.measure(0).momentum - before).norm() / before.norm(), 0.0, 1e-12);
  }
}

TEST(FreeBody, KeepsItsAngularMomentumWithSymplecticEuler) {
  Scene scene = lopsided(Integrator::symplectic_euler);
  scene.soft_bodies[0].angular_velocity = {1.0, -2.0, 3.0};
  World world = make_world(std::move(scene));
  const Vec3d before = world.measure(0).angular_momentum;
  run_ticks(world, 1000);
  EXPECT_NEAR((world.measure(0).angular_momentum - before).norm() / before.norm(), 0.0, 1e-12);
}

TEST(FreeBody, DoesNotStartToDriftOrTurnByItsPressure) {
  World world = make_world(lopsided(Integrator::symplectic_euler));
  const Vec3d centre = world.measure(0).centre_of_mass;
  run_ticks(world, 1000);
  const BodyMeasures sums = world.measure(0);
  EXPECT_NEAR((sums.centre_of_mass - centre).norm(), 0.0, 1e-12);
  EXPECT_NEAR(sums.momentum.norm(), 0.0, 1e-12);
  EXPECT_NEAR(sums.angular_momentum.norm(), 0.0, 1e-12);
}

class GasWork : public testing::TestWithParam<Integrator> {
 protected:
  // What the gas has given, and what springs and motion have, differ by an error of the method's order, or less.
  template <class Work>
  static void expect_balance(Scene scene, const Work& work_j) {
    scene.stepping.error_target = 1e-9;
    const auto imbalance_j = [&](std::uint32_t substeps) {
      scene.stepping.substeps = substeps;
      World world = make_world(scene);
      const BodyMeasures start = world.measure(0);
      Workers workers(1);
      double worst_j = 0.0;
      for (int tick = 0; tick < 200; ++tick) {
        world.step_tick(workers);
        const BodyMeasures sums = world.measure(0);
        worst_j = std::max(worst_j, std::abs(sums.kinetic_j + sums.elastic_j - work_j(start, sums)));
      }
      return worst_j;
    };
    const double coarse_j = imbalance_j(8);
    const double fine_j = imbalance_j(16);
    EXPECT_GT(std::log2(coarse_j / fine_j), order_of(GetParam()) - 0.15);
  }
};

TEST_P(GasWork, IsothermalGoesIntoMotionAndSprings) {
  const BreathingBall ball;
  expect_balance(ball.scene(1.0, GetParam(), 1000, 1), [&](const BodyMeasures& start, const BodyMeasures& now) {
    return ball.nrt_j * std::log(now.volume_m3 / start.volume_m3);
  });
}

TEST_P(GasWork, AdiabaticGoesIntoMotionAndSprings) {
  Scene scene = BreathingBall{}.scene(1.0, GetParam(), 1000, 1);
  scene.soft_bodies[0].gas->law = GasLaw::adiabatic;
  expect_balance(std::move(scene), [](const BodyMeasures& start, const BodyMeasures& now) {
    return (start.pressure_pa * start.volume_m3 - now.pressure_pa * now.volume_m3) / 0.4;
  });
}

INSTANTIATE_TEST_SUITE_P(Integrators, GasWork, testing::ValuesIn(every_integrator), test_name_of);

TEST(GasFlow, PumpsAndLeaksTheMolesThatTheSceneSays) {
  const BreathingBall ball;
  Scene scene = ball.scene(ball.equilibrium_scale(), Integrator::midpoint, 1000, 1);
  scene.soft_bodies[0].gas->flow_mol_s = 0.02;
  World pumped = make_world(scene);
  run_ticks(pumped, 500);
  EXPECT_NEAR(pumped.measure(0).moles - scene.soft_bodies[0].gas->moles, 0.01, 1e-12);

  scene.soft_bodies[0].gas->flow_mol_s = 0.0;
  scene.soft_bodies[0].gas->leak_mol_s_pa = 1e-4;
  scene.soft_bodies[0].springs.damping_n_s_m = 2.0;
  World leaking = make_world(scene);
  run_ticks(leaking, 20'000);
  EXPECT_LT(leaking.measure(0).moles, 1e-3 * scene.soft_bodies[0].gas->moles);
  const std::shared_ptr<const Mesh> rest = ball.mesh(1.0);
  EXPECT_NEAR(leaking.measure(0).volume_m3 / signed_volume_m3(rest->positions_m, rest->faces), 1.0, 1e-3);
}

// Energy of motion, springs and gas together. Up to 1 % is the integrator's: it shrinks with the step.
TEST(SoftContact, ElasticHitsOfGasBallsAddNoEnergyFastOrSlow) {
  const BreathingBall ball{.subdivisions = 2, .mass_kg = 1.0, .stiffness_n_m = 300.0, .nrt_j = 24.0};
  for (const double slowness : {1.0, 10.0}) {
    Scene scene;
    scene.stepping = {.rate_hz = 60.0 / slowness, .substeps = 64, .integrator = Integrator::symplectic_euler};
    for (const double side : {-1.0, 1.0}) {
      SoftBody body = ball.body(1.0);
      body.name = side < 0.0 ? "left" : "right";
      body.position = Vec3d(side, 0.1 * side, 0.0);
      body.velocity = Vec3d(-2.0 * side / slowness, 0.0, 0.0);
      body.springs.stiffness_n_m /= slowness * slowness;
      body.gas->moles /= slowness * slowness;
      body.surface = {.restitution = 1.0, .friction = 0.0};
      scene.soft_bodies.push_back(body);
    }
    World world = make_world(std::move(scene));
    const auto energy_j = [&world] {
      double sum = 0.0;
      for (std::size_t i = 0; i < 2; ++i) {
        const BodyMeasures body = world.measure(i);
        sum += body.kinetic_j + body.elastic_j + body.gas_j;
      }
      return sum;
    };
    const double start_j = energy_j();
    const double kinetic_j = 4.0 / (slowness * slowness);
    Workers workers(1);
    for (int tick = 0; tick < 90; ++tick) {
      world.step_tick(workers);
      ASSERT_LT(energy_j(), start_j + 0.01 * kinetic_j) << "tick " << tick;
    }
    EXPECT_LT(world.measure(0).momentum.x(), -0.5 / slowness) << "they met and parted";
  }
}

}  // namespace
}  // namespace pneuma::physics
