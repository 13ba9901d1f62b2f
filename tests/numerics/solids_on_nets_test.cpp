// Shows that solids smaller than the meshes of a net, which meet none of its vertices, lie on it by every method: on
// its edges by theirs, and on its faces by their corners. So does a net on a post.
#include <cmath>
#include <random>
#include <string>

#include "numerics/worlds.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

// 2 m wide, its meshes a third of a metre, its border pinned.
SoftBody net() {
  SoftBody net;
  net.name = "net";
  net.mesh = *make_grid(6, 6, 2.0, 2.0);
  net.mass_kg = 0.4;
  net.springs = {.stiffness_n_m = 500.0, .damping_n_s_m = 0.05};
  net.pin_boundary = true;
  net.surface.friction = 0.5;
  return net;
}

Scene scene_of(const SoftBody& body, Integrator integrator) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60.0, .integrator = integrator, .sleep = false};
  if (!is_explicit(integrator) && integrator != Integrator::xpbd) scene.stepping.substeps = 2;
  scene.soft_bodies.push_back(body);
  return scene;
}

struct Falling {
  std::string name;
  Shape shape;
};

class SolidOnNet : public testing::TestWithParam<std::tuple<Integrator, Falling>> {};

TEST_P(SolidOnNet, LiesOnIt) {
  const auto& [integrator, falling] = GetParam();
  std::mt19937 random(5);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int drop = 0; drop < 3; ++drop) {
    Scene scene = scene_of(net(), integrator);
    RigidBody solid;
    solid.name = falling.name;
    solid.shape = falling.shape;
    solid.mass_kg = 0.2;
    solid.surface.friction = 0.5;
    const double x_m = between(-0.4, 0.4);
    solid.position = {x_m, 0.3, between(-0.4, 0.4)};
    const double w = between(-1, 1);
    const double x = between(-1, 1);
    const double y = between(-1, 1);
    solid.orientation = Quatd(w, x, y, between(-1, 1)).normalized();
    scene.rigid_bodies.push_back(solid);
    World world = make_world(std::move(scene));
    for (int tick = 0; tick < 120; ++tick) {
      run_ticks(world, 1);
      const Vec3d& at = world.rigid_bodies()[0].position;
      ASSERT_GT(at.y(), -0.4) << "drop " << drop << ", tick " << tick;
      ASSERT_LT(at.y(), 0.35) << "drop " << drop << ", tick " << tick;
    }
    EXPECT_FALSE(world.is_frozen(0));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Methods, SolidOnNet,
    testing::Combine(testing::Values(Integrator::midpoint, Integrator::rk4, Integrator::symplectic_euler,
                                     Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::xpbd),
                     testing::Values(Falling{"Ball", SphereShape{0.1}}, Falling{"Capsule", CapsuleShape{0.05, 0.1}},
                                     Falling{"Cube", BoxShape{{0.08, 0.08, 0.08}}},
                                     Falling{"Plate", BoxShape{{0.15, 0.03, 0.1}}})),
    [](const auto& info) {
      return std::string(name_of(std::get<0>(info.param))) + "_" + std::get<1>(info.param).name;
    });

class NetOnPost : public testing::TestWithParam<Integrator> {};

// A sheet that nothing pins falls on a post, whose top is smaller than its meshes and under the middle of one.
TEST_P(NetOnPost, DoesNotSlipOverIt) {
  SoftBody sheet = net();
  sheet.pin_boundary = false;
  sheet.position = {0.11, 0.2, 0.06};
  Scene scene = scene_of(sheet, GetParam());
  Surface surface_of_post;
  surface_of_post.friction = 0.9;
  scene.colliders.push_back(
      {.name = "post", .shape = BoxShape{{0.05, 0.5, 0.05}}, .position = {0, -0.5, 0}, .surface = surface_of_post});
  World world = make_world(std::move(scene));
  run_ticks(world, 30);
  std::vector<double> at_m(3 * sheet.mesh->positions_m.size());
  world.copy_positions(0, at_m);
  double highest_m = -1.0;
  for (std::size_t i = 1; i < at_m.size(); i += 3) highest_m = std::max(highest_m, at_m[i]);
  EXPECT_GT(highest_m, -0.05);  // it hangs over the post: free, it would be 1.0 m below
  EXPECT_LT(highest_m, 0.2);
}

INSTANTIATE_TEST_SUITE_P(Methods, NetOnPost,
                         testing::Values(Integrator::midpoint, Integrator::symplectic_euler, Integrator::implicit_euler,
                                         Integrator::tr_bdf2),
                         test_name_of);

}  // namespace
}  // namespace pneuma::physics
