// Shows that pins, grabs, wind and bending act with every integrator, and that they come to the same rest.
#include "numerics/worlds.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

class EveryMethod : public testing::TestWithParam<Integrator> {
 protected:
  [[nodiscard]] static Stepping stepping() { return {.rate_hz = 60, .integrator = GetParam(), .error_target = 0.05}; }
};

TEST_P(EveryMethod, GoesOnFromASnapshotWithTheSameBits) {
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    Scene scene = BreathingBall{.subdivisions = 1, .damping_n_s_m = 0.5}.scene(0.9, GetParam(), 60, 0);
    scene.stepping = stepping();
    scene.stepping.precision = precision;
    scene.gravity = {0, -9.81, 0};
    scene.atmosphere = {.density_kg_m3 = 1.2, .wind = {1.0, 0.5, 0.0}};
    scene.soft_bodies[0].drag = {.normal = 1.0, .tangential = 0.2};
    scene.soft_bodies[0].springs.bend_stiffness_n_m = GetParam() == Integrator::explicit_euler ? 0.0 : 0.1;
    World world = make_world(scene);
    ASSERT_TRUE(world.add_grab(1, "ball", std::uint32_t{5}, {Vec3d(0, 1, 0), 20.0, 1.0}).ok());
    run_ticks(world, 10);
    World restored = make_world(scene);
    ASSERT_TRUE(restored.restore(world.snapshot()).ok());
    run_ticks(world, 20);
    run_ticks(restored, 20, 2);
    EXPECT_EQ(world.state_hash(), restored.state_hash());
    EXPECT_FALSE(world.is_frozen(0));
  }
}

// By a sampled volume too a ball comes to rest at s = (1 + sqrt(1 + 12 nRT / K)) / 2, to within what the samples say.
TEST_P(EveryMethod, SampledGasHoldsABallAtItsRadius) {
  for (const Volume volume : {Volume{VolumeMethod::subdivided, 32}, Volume{VolumeMethod::monte_carlo, 4'096}}) {
    const BreathingBall ball{.subdivisions = 1, .damping_n_s_m = 2.0};
    Scene scene = ball.scene(1.0, GetParam(), 60, 0);
    scene.stepping = stepping();
    scene.soft_bodies[0].volume = volume;
    World world = make_world(std::move(scene));
    run_ticks(world, 300);
    EXPECT_FALSE(world.is_frozen(0));
    const std::shared_ptr<const Mesh> rest = ball.mesh(1.0);
    const double rest_m3 = signed_volume_m3(rest->positions_m, rest->faces);
    EXPECT_NEAR(std::cbrt(world.measure(0).volume_m3 / rest_m3) / ball.equilibrium_scale(), 1.0, 0.02);
  }
}

// A triangle of springs: two vertices pinned, the third hangs. At rest its springs carry its weight:
// 2 k (l - l0) h / l = m g, whatever the method.
TEST_P(EveryMethod, APinnedTriangleHangsWhereItsWeightIsCarried) {
  HungVertex hung{.stiffness_n_m = 200.0, .damping_n_s_m = 3.0};
  Scene scene = hung.scene(GetParam(), 60, 0);
  scene.stepping = stepping();
  scene.gravity = {0, -9.81, 0};
  World world = make_world(std::move(scene));
  run_ticks(world, 600);
  const std::vector<Vec3d> x = positions_of(world);
  EXPECT_EQ(x[0], Vec3d(0, 0, -hung.half_base_m));
  EXPECT_EQ(x[1], Vec3d(0, 0, hung.half_base_m));
  const double height_m = -x[2].y();
  const double length_m = std::hypot(height_m, hung.half_base_m);
  const double carried_n = 2.0 * hung.stiffness_n_m * (length_m - hung.spring_m()) * height_m / length_m;
  EXPECT_NEAR(carried_n / (hung.vertex_mass_kg * 9.81), 1.0, 0.005);
}

TEST_P(EveryMethod, AGrabbedBallComesToTheHand) {
  Scene scene = BreathingBall{.subdivisions = 1, .damping_n_s_m = 2.0, .nrt_j = 10.0}.scene(1.0, GetParam(), 60, 0);
  scene.stepping = stepping();
  World world = make_world(std::move(scene));
  const Vec3d target(0.5, 1.0, -0.5);
  ASSERT_TRUE(world.add_grab(1, "ball", std::uint32_t{0}, {target, 50.0, 5.0}).ok());
  run_ticks(world, 900);
  EXPECT_LT((positions_of(world)[0] - target).norm(), 0.02);
  EXPECT_FALSE(world.is_frozen(0));
}

// Drag is 1/2 rho C A u^2 on a flat plate, here one face: it falls at the speed at which that carries its weight.
TEST_P(EveryMethod, APlateFallsAtItsTerminalSpeed) {
  Scene scene;
  scene.stepping = stepping();
  scene.gravity = {0, -9.81, 0};
  scene.atmosphere.density_kg_m3 = 1.2;
  SoftBody plate;
  plate.name = "plate";
  plate.mesh = *make_mesh({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}}, {{0, 1, 2}});
  plate.mass_kg = 0.05;
  plate.springs = {.stiffness_n_m = 5.0, .damping_n_s_m = 0.05};
  plate.drag.normal = 1.3;
  scene.soft_bodies.push_back(plate);
  World world = make_world(std::move(scene));
  run_ticks(world, 300);
  const double terminal_m_s = std::sqrt(2.0 * plate.mass_kg * 9.81 / (1.2 * 1.3 * 0.5));
  EXPECT_NEAR(-world.measure(0).momentum.y() / plate.mass_kg / terminal_m_s, 1.0, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Integrators, EveryMethod,
                         testing::Values(Integrator::explicit_euler, Integrator::midpoint, Integrator::rk4,
                                         Integrator::symplectic_euler, Integrator::implicit_euler, Integrator::tr_bdf2,
                                         Integrator::xpbd, Integrator::automatic));

// A sheet held at one side in gravity: springs alone let it hang down, bending holds it out.
class Bending : public testing::TestWithParam<Integrator> {};

TEST_P(Bending, HoldsAShapeThatSpringsAloneDoNot) {
  const auto droop_m = [&](double bend_stiffness_n_m) {
    Scene scene;
    scene.stepping = {.rate_hz = 60, .integrator = GetParam(), .error_target = 0.05};
    scene.gravity = {0, -9.81, 0};
    SoftBody sheet;
    sheet.name = "sheet";
    sheet.mesh = *make_grid(6, 2, 0.6, 0.2);
    sheet.mass_kg = 0.1;
    sheet.springs = {.stiffness_n_m = 300.0, .damping_n_s_m = 0.3, .bend_stiffness_n_m = bend_stiffness_n_m};
    for (std::uint32_t i = 0; i < sheet.mesh->positions_m.size(); ++i) {
      if (sheet.mesh->positions_m[i].x() < -0.15) sheet.pins.push_back(i);
    }
    scene.soft_bodies.push_back(sheet);
    World world = make_world(std::move(scene));
    run_ticks(world, 300);
    EXPECT_FALSE(world.is_frozen(0));
    double lowest_m = 0.0;
    for (const Vec3d& x : positions_of(world)) lowest_m = std::min(lowest_m, x.y());
    return -lowest_m;
  };
  EXPECT_GT(droop_m(0.0), 0.3);
  EXPECT_LT(droop_m(1.0), 0.1);
}

// Not with explicit Euler, which nothing keeps from growing where bending swings undamped.
INSTANTIATE_TEST_SUITE_P(Integrators, Bending,
                         testing::Values(Integrator::midpoint, Integrator::rk4, Integrator::symplectic_euler,
                                         Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::xpbd,
                                         Integrator::automatic));

}  // namespace
}  // namespace pneuma::physics
