// Shows that motions with a closed form come out: free fall (exactly what each method makes of it), a damped
// oscillator, a pendulum, a bounce.
#include <numbers>

#include "numerics/worlds.h"

namespace pneuma::physics {
namespace {

TEST(FreeFall, IsExactUpToEachMethodsKnownOffset) {
  const Vec3d gravity(0.3, -9.81, 0.1);
  const Vec3d velocity(2.0, 5.0, -1.0);
  struct Method {
    Integrator integrator;
    // Of t^2 in g t^2 / 2: explicit Euler moves by the old velocity, symplectic Euler and XPBD by the new one.
    double offset_steps;
  };
  for (const Method& method :
       {Method{Integrator::explicit_euler, -1.0}, Method{Integrator::midpoint, 0.0}, Method{Integrator::rk4, 0.0},
        Method{Integrator::symplectic_euler, 1.0}, Method{Integrator::implicit_euler, 0.0},
        Method{Integrator::tr_bdf2, 0.0}, Method{Integrator::xpbd, 1.0}}) {
    Scene scene;
    scene.gravity = gravity;
    scene.stepping = {.rate_hz = 60, .substeps = 4, .integrator = method.integrator, .on_unstable = OnUnstable::allow};
    SoftBody body = BreathingBall{.nrt_j = 0.0}.body(1.0);
    body.gas.reset();
    body.velocity = velocity;
    scene.soft_bodies.push_back(body);
    World world = make_world(std::move(scene));
    run_ticks(world, 120);
    const double t = 2.0;
    const double h = 1.0 / 240;
    const Vec3d expected = t * velocity + 0.5 * t * (t + method.offset_steps * h) * gravity;
    EXPECT_NEAR((world.measure(0).centre_of_mass - expected).norm(), 0.0, 1e-11);
    EXPECT_NEAR((world.measure(0).momentum - body.mass_kg * (velocity + t * gravity)).norm(), 0.0, 1e-11);
  }
}

TEST(FreeFlight, KeepsItsSpeedInSinglePrecision) {
  for (const Integrator integrator : every_integrator) {
    Scene scene = BreathingBall{.nrt_j = 0.0}.scene(1.0, integrator, 60.0, 22);
    scene.stepping.precision = Precision::single_precision;
    scene.soft_bodies[0].gas.reset();
    scene.soft_bodies[0].velocity = {1.0, 0.0, 0.0};
    World world = make_world(std::move(scene));
    const double before = world.measure(0).momentum.x();
    run_ticks(world, 240);  // 5,280 steps: roundings of 6e-8 that all went one way would make 3e-4
    EXPECT_NEAR(world.measure(0).momentum.x() / before, 1.0, 1e-5) << name_of(integrator);
  }
}

TEST(FreeFall, ARigidBodyFallsTheSameWay) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60, .substeps = 16};
  RigidBody ball;
  ball.name = "ball";
  ball.shape = SphereShape{0.1};
  ball.velocity = {1, 2, 3};
  scene.rigid_bodies.push_back(ball);
  World world = make_world(std::move(scene));
  run_ticks(world, 60);
  EXPECT_NEAR((world.rigid_bodies()[0].velocity - Vec3d(1, 2 - 9.81, 3)).norm(), 0.0, 1e-11);
  const double step_s = 1.0 / 960;  // first order: at most one step's offset
  EXPECT_NEAR((world.rigid_bodies()[0].position - Vec3d(1, 2 - 9.81 / 2, 3)).norm(), 0.0, 9.81 / 2 * step_s + 1e-11);
}

class Oscillator : public testing::TestWithParam<Integrator> {};

TEST_P(Oscillator, FollowsItsDecayingSine) {
  const HungVertex hung{.damping_n_s_m = 0.4};
  const double decay_1_s = hung.damping_n_s_m * hung.slope() * hung.slope() / hung.vertex_mass_kg;
  const double undamped_rad_s = std::sqrt(2.0 * hung.stiffness_n_m / hung.vertex_mass_kg) * hung.slope();
  const double frequency_rad_s = std::sqrt(undamped_rad_s * undamped_rad_s - decay_1_s * decay_1_s);
  const double speed_m_s = 1e-7;  // small: the springs' angle stays
  const auto worst_share = [&](std::uint32_t substeps) {
    Scene scene = hung.scene(GetParam(), 50, substeps);
    scene.stepping.error_target = 1e-12;
    scene.soft_bodies[0].velocity = {0, speed_m_s, 0};
    World world = make_world(std::move(scene));
    Workers workers(1);
    double worst = 0.0;
    for (int tick = 1; tick <= 50; ++tick) {
      world.step_tick(workers);
      const double t = tick / 50.0;
      const double expected_m = speed_m_s / frequency_rad_s * std::exp(-decay_1_s * t) * std::sin(frequency_rad_s * t);
      worst = std::max(worst, std::abs(positions_of(world)[2].y() + hung.height_m - expected_m));
    }
    return worst * frequency_rad_s / speed_m_s;
  };
  // Finer steps of RK4 meet the curve to what the angle, which does not quite stay, leaves.
  const std::uint32_t coarse = GetParam() == Integrator::rk4 ? 4 : 16;
  EXPECT_NEAR(std::log2(worst_share(coarse) / worst_share(2 * coarse)), order_of(GetParam()), 0.2);
  EXPECT_LT(worst_share(2 * coarse), 0.05);
}

TEST_P(Oscillator, SwingsAsAPendulumWithThePeriodOfItsLength) {
  HungVertex hung{.stiffness_n_m = 5000.0, .damping_n_s_m = 20.0};
  const double weight_n = hung.vertex_mass_kg * 9.81;
  const double stretch_m = weight_n / (2.0 * hung.stiffness_n_m * hung.slope());
  hung.rest_scale = 1.0 - stretch_m / hung.spring_m();  // hangs still as it is placed
  Scene scene = hung.scene(GetParam(), 1000, 2);
  scene.gravity = {0, -9.81, 0};
  scene.stepping.error_target = 1e-6;
  const double angle_rad = 1e-3;
  const double frequency_rad_s = std::sqrt(9.81 / hung.height_m);
  scene.soft_bodies[0].velocity = {angle_rad * hung.height_m * frequency_rad_s, 0, 0};
  World world = make_world(std::move(scene));
  Workers workers(1);
  std::vector<double> across_m;
  for (int tick = 0; tick < 8000; ++tick) {
    world.step_tick(workers);
    across_m.push_back(positions_of(world)[2].x());
  }
  EXPECT_NEAR(period_s(across_m, 1e-3) * frequency_rad_s / (2.0 * std::numbers::pi), 1.0, 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Integrators, Oscillator, testing::ValuesIn(every_integrator), test_name_of);

/// Highest point after the first bounce.
template <class Height>
double rebound_m(World& world, const Height& height_m) {
  Workers workers(1);
  double lowest = height_m(world);
  double highest_since = lowest;
  for (int tick = 0; tick < 240; ++tick) {
    world.step_tick(workers);
    const double now = height_m(world);
    if (now < lowest) {
      lowest = now;
      highest_since = now;
    }
    if (now < highest_since - 1e-3) break;  // past the top
    highest_since = std::max(highest_since, now);
  }
  return highest_since;
}

class Bounce : public testing::TestWithParam<double> {
 protected:
  Scene floor_scene() const {
    Scene scene;
    scene.gravity = {0, -9.81, 0};
    scene.stepping = {.rate_hz = 240, .substeps = 16};
    Collider floor;
    floor.name = "floor";
    floor.shape = PlaneShape{};
    floor.surface.restitution = GetParam();
    scene.colliders.push_back(floor);
    return scene;
  }
};

TEST_P(Bounce, OfAParticleReachesTheSquareOfTheRestitutionTimesTheHeight) {
  Scene scene = floor_scene();
  SoftBody body;  // no springs: three particles side by side
  body.name = "particles";
  body.mesh = *make_mesh({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}}, {{0, 1, 2}});
  body.position = {0, 1, 0};
  scene.soft_bodies.push_back(body);
  const double expected_m = GetParam() * GetParam();
  for (const Integrator integrator : every_integrator) {
    scene.stepping.integrator = integrator;
    World world = make_world(scene);
    EXPECT_NEAR(rebound_m(world, [](const World& w) { return positions_of(w)[0].y(); }), expected_m, 0.005)
        << name_of(integrator);
  }
}

TEST_P(Bounce, OfARigidBallReachesTheSquareOfTheRestitutionTimesTheHeight) {
  Scene scene = floor_scene();
  RigidBody ball;
  ball.name = "ball";
  ball.shape = SphereShape{0.25};
  ball.position = {0, 1.25, 0};
  scene.rigid_bodies.push_back(ball);
  World world = make_world(std::move(scene));
  const double expected_m = GetParam() * GetParam();
  EXPECT_NEAR(rebound_m(world, [](const World& w) { return w.rigid_bodies()[0].position.y() - 0.25; }), expected_m,
              0.005);
}

/// Distance that a particle slides in a second from rest on a slope with a friction coefficient of 0.5.
double slide_m(double slope_rad, Integrator integrator) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 120, .substeps = 8, .integrator = integrator};
  Collider slope;
  slope.name = "slope";
  slope.shape = PlaneShape{{std::sin(slope_rad), std::cos(slope_rad), 0}};
  slope.surface = {0.0, 0.5, 0.0};
  scene.colliders.push_back(slope);
  SoftBody body;  // no springs: three particles, side by side across the slope
  body.name = "particles";
  const Vec3d down(std::cos(slope_rad), -std::sin(slope_rad), 0);
  body.mesh = *make_mesh({{0, 0, 0}, {0, 0, 1}, down}, {{0, 1, 2}});
  scene.soft_bodies.push_back(body);
  World world = make_world(std::move(scene));
  const Vec3d before = world.measure(0).centre_of_mass;
  run_ticks(world, 120);
  return (world.measure(0).centre_of_mass - before).dot(down);
}

class Slope : public testing::TestWithParam<Integrator> {};

TEST_P(Slope, HoldsAParticleWhereItsTangentIsBelowTheFriction) {
  EXPECT_NEAR(slide_m(std::atan(0.45), GetParam()), 0.0, 0.01);
  EXPECT_NEAR(slide_m(std::atan(0.2), GetParam()), 0.0, 0.01);
}

TEST_P(Slope, LetsAParticleSlideAtTheExcessWhereItIsSteeper) {
  for (const double tangent : {0.55, 0.7, 1.0}) {
    const double angle_rad = std::atan(tangent);
    const double expected_m = 0.5 * 9.81 * (std::sin(angle_rad) - 0.5 * std::cos(angle_rad));
    EXPECT_NEAR(slide_m(angle_rad, GetParam()), expected_m, 0.02 * expected_m + 0.005) << tangent;
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, Slope, testing::ValuesIn(every_integrator), test_name_of);

INSTANTIATE_TEST_SUITE_P(Restitutions, Bounce, testing::Values(0.3, 0.5, 0.8, 1.0));

}  // namespace
}  // namespace pneuma::physics
