// Shows that seeded random scenes gain no energy beyond what was there: of rigid bodies alone, and of all that a scene
// can have, by every method and at the steps that are chosen where a scene leaves them open.
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "numerics/worlds.h"
#include "physics/mesh/polyhedron.h"

namespace pneuma::physics {
namespace {

constexpr double earth_m_s2 = 9.81;

double gas_of_all_j(const World& world) {
  double sum_j = 0.0;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) sum_j += world.measure(i).gas_j;
  return sum_j;
}

// Draws in the order of its statements, the same by every compiler.
class AnyScene {
 public:
  explicit AnyScene(std::uint32_t seed) : random_(seed) {}

  Scene of_rigid_bodies() {
    begin();
    add_rigid_bodies(1 + below(3));
    add_solids();
    return scene_;
  }

  Scene of_all() {
    begin();
    const bool solved = scene_.stepping.integrator >= Integrator::implicit_euler;
    const double stiffness_n_m = std::pow(10.0, between(1.5, solved ? 5.5 : 4.0));
    const std::size_t soft_count = 1 + below(3);
    for (std::size_t i = 0; i < soft_count; ++i) add_soft_body(stiffness_n_m);
    add_rigid_bodies(below(4));
    add_solids();
    return scene_;
  }

 private:
  std::size_t below(std::size_t count) { return random_() % count; }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 8U) / static_cast<double>(1U << 24U);
  }
  bool chance(double of_one) { return between(0.0, 1.0) < of_one; }
  Vec3d within(double reach) {
    Vec3d point;
    for (double& coordinate : point) coordinate = between(-reach, reach);
    return point;
  }
  Quatd turn() {
    Quatd any;
    for (double& part : any.coeffs()) part = between(-1.0, 1.0);
    return any.normalized();
  }
  Surface surface() {
    const double restitution = between(0.0, 1.0);
    return {.restitution = restitution, .friction = between(0.0, 1.0)};
  }

  void begin() {
    constexpr std::array methods{
        Integrator::automatic,     Integrator::automatic, Integrator::symplectic_euler, Integrator::midpoint,
        Integrator::rk4,           Integrator::xpbd,      Integrator::tr_bdf2,          Integrator::implicit_euler,
        Integrator::implicit_euler};
    constexpr std::array rates_hz{60.0, 60.0, 120.0, 30.0};
    scene_.gravity = {0.0, chance(0.85) ? -earth_m_s2 : 0.0, 0.0};
    scene_.stepping.integrator = methods[below(methods.size())];
    scene_.stepping.precision = chance(0.5) ? Precision::single_precision : Precision::double_precision;
    scene_.stepping.rate_hz = rates_hz[below(rates_hz.size())];
    scene_.stepping.sleep = chance(0.5);
    for (std::size_t i = 0; i < cells_.size(); ++i) cells_[i] = i;
    for (std::size_t i = cells_.size() - 1; i > 0; --i) std::swap(cells_[i], cells_[below(i + 1)]);
  }

  // Far enough from the others.
  Vec3d place() {
    const std::size_t cell = cells_[scene_.soft_bodies.size() + scene_.rigid_bodies.size()];
    const auto along = [&](unsigned axis) { return (cell >> axis & 1U) != 0 ? 0.95 : -0.95; };
    return Vec3d(along(0), 2.05 + along(1), along(2)) + within(0.05);
  }

  void add_soft_body(double stiffness_n_m) {
    SoftBody body;
    const std::size_t kind = below(5);
    if (kind < 3) {
      BreathingBall ball{.subdivisions = 1 + static_cast<std::uint32_t>(below(2)), .stiffness_n_m = stiffness_n_m};
      ball.radius_m = between(0.3, 0.55);
      ball.nrt_j = between(20.0, 400.0);
      body = ball.body(std::min(1.1, ball.equilibrium_scale()));
    } else if (kind == 3) {
      body.mesh = *make_grid(6, 6, 1.0, 1.0);
      const std::size_t pins = below(3);
      body.pin_boundary = pins == 1;
      if (pins == 2) body.pins = {0, 6};
      body.springs.bend_stiffness_n_m = chance(0.5) ? between(0.0, 0.05) : 0.0;
    } else {
      Vec3d half_m;
      for (double& extent : half_m) extent = between(0.2, 0.5);
      body.mesh = *make_box(half_m, 2);
      if (chance(0.6)) body.gas = Gas{.moles = between(5.0, 200.0) / (gas_constant_j_mol_k * 293.15)};
    }
    body.name = "soft-" + std::to_string(scene_.soft_bodies.size());
    body.mass_kg = between(0.1, 2.0);
    body.springs.stiffness_n_m = stiffness_n_m;
    body.springs.damping_n_s_m = between(0.0, 1.0);
    body.collision.self = chance(0.3);
    body.surface = surface();
    if (chance(0.3)) body.surface.thickness_m = between(0.0, 0.02);
    body.position = place();
    body.orientation = turn();
    body.velocity = within(3.0);
    body.angular_velocity = within(3.0);
    scene_.soft_bodies.push_back(body);
  }

  Shape rigid_shape() {
    switch (below(5)) {
      case 0:
        return SphereShape{between(0.1, 0.5)};
      case 1: {
        BoxShape box;
        for (double& extent : box.half_extents_m) extent = between(0.05, 0.5);
        return box;
      }
      case 2: {
        BoxShape plate{{0.0, 0.03, 0.0}};
        plate.half_extents_m.x() = between(0.1, 0.6);
        plate.half_extents_m.z() = between(0.1, 0.6);
        return plate;
      }
      case 3: {
        CapsuleShape capsule{.radius_m = between(0.05, 0.2)};
        capsule.half_height_m = between(0.1, 0.4);
        return capsule;
      }
      default: {
        const auto subdivisions = static_cast<std::uint32_t>(below(2));
        const std::shared_ptr<const Mesh> mesh = *make_icosphere(subdivisions, between(0.2, 0.5));
        return ConvexShape{"convex", mesh, *make_polyhedron(*mesh)};
      }
    }
  }

  void add_rigid_bodies(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      RigidBody body;
      body.name = "rigid-" + std::to_string(i);
      body.shape = rigid_shape();
      body.mass_kg = std::pow(10.0, between(-1.0, 2.0));
      body.surface = surface();
      body.position = place();
      body.orientation = turn();
      body.velocity = within(3.0);
      body.angular_velocity = within(3.0);
      scene_.rigid_bodies.push_back(body);
    }
  }

  void add_solids() {
    Collider ground{.name = "ground", .shape = PlaneShape{}, .surface = surface()};
    if (chance(0.4)) {
      ground.shape = RoomShape{{2.0, 2.1, 2.0}};
      ground.position = {0.0, 2.0, 0.0};
    }
    scene_.colliders.push_back(ground);
    if (!chance(0.4)) return;
    Collider block{.name = "block", .shape = BoxShape{{0.3, 0.2, 0.3}}, .surface = surface()};
    if (chance(0.5)) block.shape = EllipsoidShape{{0.3, 0.2, 0.15}};
    block.position = Vec3d(between(-0.5, 0.5), 0.1, 0.0);
    scene_.colliders.push_back(block);
  }

  std::mt19937 random_;
  Scene scene_;
  std::array<std::size_t, 8> cells_{};
};

// Of what the bodies fell and flew with, and what their gases gave and took.
void expect_no_more_than(double share, const Scene& scene, double seconds, const std::string& what) {
  double came_with_j = 0.0;
  const auto count = [&](const auto& body) {
    came_with_j += body.mass_kg * (0.5 * body.velocity.squaredNorm() - scene.gravity.dot(body.position));
  };
  for (const SoftBody& body : scene.soft_bodies) count(body);
  for (const RigidBody& body : scene.rigid_bodies) count(body);
  World world = make_world(scene);
  const double first_j = whole_energy_j(world);
  const auto ticks = static_cast<std::uint64_t>(seconds * scene.stepping.rate_hz);
  double least_gas_j = gas_of_all_j(world);
  double most_gas_j = least_gas_j;
  double most_j = 0.0;
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    run_ticks(world, 1);
    const double gas_j = gas_of_all_j(world);
    least_gas_j = std::min(least_gas_j, gas_j);
    most_gas_j = std::max(most_gas_j, gas_j);
    const double gained_j = whole_energy_j(world) - first_j;
    ASSERT_TRUE(std::isfinite(gained_j)) << what;
    most_j = std::max(most_j, gained_j);
  }
  EXPECT_LE(most_j, share * (came_with_j + most_gas_j - least_gas_j)) << what;
  EXPECT_TRUE(world.take_frozen().empty()) << what;
}

class AnyScenes : public testing::TestWithParam<std::uint32_t> {};

// Steps of 1/30 s are long for what turns and hits: of 10,000 scenes, 22 gained more.
TEST_P(AnyScenes, OfRigidBodiesGainNoEnergy) {
  for (std::uint32_t i = 0; i < 10; ++i) {
    const std::uint32_t seed = 10 * GetParam() + i;
    expect_no_more_than(0.02, AnyScene(seed).of_rigid_bodies(), 2.0, "seed " + std::to_string(seed));
  }
}

// Of 500 scenes, 6 gained more: three by XPBD, and three where springs of 2e5 N/m and more were stretched by some
// millimetres too far, for a tick or a few, as a body hit after one step of 1/30 s.
TEST_P(AnyScenes, OfAllKindsGainNoEnergy) {
  for (std::uint32_t i = 0; i < 5; ++i) {
    const std::uint32_t seed = 5 * GetParam() + i;
    expect_no_more_than(0.02, AnyScene(seed).of_all(), 1.0, "seed " + std::to_string(seed));
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, AnyScenes, testing::Range(0U, tens_of_scenes()));

}  // namespace
}  // namespace pneuma::physics
