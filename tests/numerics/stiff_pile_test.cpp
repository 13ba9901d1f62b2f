// Shows that balls with and without gas, cloths and solids that fall on each other gain no energy, however unlike their
// stiffness: in seeded random scenes, by all methods but explicit Euler and XPBD, by one implicit step a tick, and
// where ropes tie them.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

#include "numerics/worlds.h"

namespace pneuma::physics {
namespace {

constexpr double pile_pull_m_s2 = 9.81;

// Draws in the order of its statements, the same by every compiler.
class Pile {
 public:
  explicit Pile(std::uint32_t seed) : random_(seed) {
    constexpr std::array methods{Integrator::symplectic_euler, Integrator::midpoint,  Integrator::implicit_euler,
                                 Integrator::tr_bdf2,          Integrator::automatic, Integrator::automatic,
                                 Integrator::automatic,        Integrator::rk4};
    scene_.gravity = {0.0, -pile_pull_m_s2, 0.0};
    scene_.stepping.sleep = false;
    scene_.stepping.integrator = methods[random_() % methods.size()];
    const bool is_solved =
        scene_.stepping.integrator == Integrator::implicit_euler || scene_.stepping.integrator == Integrator::tr_bdf2;
    if (is_solved) scene_.stepping.substeps = 1 + static_cast<std::uint32_t>(random_() % 4);
    scene_.stepping.precision = random_() % 2 == 1 ? Precision::single_precision : Precision::double_precision;
    Collider floor{.name = "floor", .shape = PlaneShape{}, .surface = {}};
    floor.surface.restitution = between(0.0, 1.0);
    floor.surface.friction = between(0.0, 1.0);
    scene_.colliders.push_back(floor);
    const std::size_t count = 2 + random_() % 2;
    for (std::size_t i = 0; i < count; ++i) add("body-" + std::to_string(i));
  }

  [[nodiscard]] const Scene& scene() const { return scene_; }
  [[nodiscard]] std::uint32_t draw() { return static_cast<std::uint32_t>(random_()); }
  void step_by(Integrator integrator, std::uint32_t substeps) {
    scene_.stepping.integrator = integrator;
    scene_.stepping.substeps = substeps;
  }
  /// A rope from a vertex of a soft body to where that vertex begins, or to a vertex of another.
  void tie() {
    const SoftBody& first = scene_.soft_bodies[draw() % scene_.soft_bodies.size()];
    const SoftBody& second = scene_.soft_bodies[draw() % scene_.soft_bodies.size()];
    const auto end_of = [this](const SoftBody& body) {
      return Anchor{.of = Anchor::Of::soft,
                    .body = body.name,
                    .vertex = static_cast<std::uint32_t>(draw() % body.mesh->positions_m.size())};
    };
    const auto place_of = [](const SoftBody& body, const Anchor& end) {
      return Vec3d(body.position + body.mesh->positions_m[*end.vertex]);
    };
    Joint rope;
    rope.name = "rope";
    rope.first = end_of(first);
    const Vec3d from = place_of(first, rope.first);
    double apart_m = 0.0;
    if (first.name == second.name) {
      rope.second.point_m = from;
    } else {
      rope.second = end_of(second);
      apart_m = (place_of(second, rope.second) - from).norm();
    }
    rope.kind = DistanceLimit{apart_m + between(0.1, 1.0)};
    scene_.joints.push_back(rope);
  }
  /// What all fall and fly with.
  [[nodiscard]] double came_with_j() const {
    double sum_j = 0.0;
    const auto count = [&](const auto& body) {
      sum_j += body.mass_kg * (pile_pull_m_s2 * body.position.y() + 0.5 * body.velocity.squaredNorm());
    };
    for (const SoftBody& body : scene_.soft_bodies) count(body);
    for (const RigidBody& body : scene_.rigid_bodies) count(body);
    return sum_j;
  }

 private:
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_() >> 8U) / static_cast<double>(1U << 24U);
  }
  double by_magnitude(double low, double high) { return std::pow(10.0, between(std::log10(low), std::log10(high))); }

  void add(const std::string& name) {
    const std::size_t kind = random_() % 4;
    const double radius_m = between(0.3, 0.6);
    SoftBody body;
    body.name = name;
    body.springs.stiffness_n_m = by_magnitude(1e2, 1e6);
    body.mass_kg = by_magnitude(0.2, 5.0);
    body.springs.damping_n_s_m = random_() % 3 == 0 ? 0.0 : between(0.0, 2.0);
    body.surface.restitution = random_() % 2 == 1 ? 0.0 : between(0.0, 1.0);
    body.surface.friction = between(0.0, 1.0);
    if (random_() % 2 == 0) body.velocity.y() = -between(0.0, 6.0);
    if (kind == 3) return add_solid(body);
    double half_m = radius_m;
    if (kind == 2) {
      const auto cells = 6 + static_cast<std::uint32_t>(random_() % 8);
      body.mesh = *make_grid(cells, cells, 2.0 / cells, 2.0 / cells);
      half_m = 0.05;
    } else {
      body.mesh = *make_icosphere(1 + static_cast<std::uint32_t>(random_() % 2), radius_m);
      if (kind == 0) body.gas = Gas{.moles = by_magnitude(1.0, 1e3) / (gas_constant_j_mol_k * 293.15)};
    }
    body.position.x() = between(-0.3, 0.3);
    body.position.y() = height_m_ + half_m + 0.02;
    body.position.z() = between(-0.3, 0.3);
    height_m_ += 2.0 * half_m + between(0.1, 1.0) + (kind == 0 ? half_m : 0.0);
    scene_.soft_bodies.push_back(body);
  }

  // Of the soft body's name, surface and velocity.
  void add_solid(const SoftBody& like) {
    constexpr double reach_m = 0.9;
    RigidBody solid;
    solid.name = like.name;
    solid.surface = like.surface;
    solid.velocity = like.velocity;
    const double half_m = between(0.1, 0.5);
    switch (random_() % 3) {
      case 0:
        solid.shape = SphereShape{half_m};
        break;
      case 1: {
        const double height_m = between(0.05, 0.5);
        solid.shape = BoxShape{{half_m, height_m, between(0.05, 0.5)}};
        break;
      }
      default:
        solid.shape = CapsuleShape{.radius_m = 0.4 * half_m, .half_height_m = between(0.1, 0.4)};
    }
    solid.mass_kg = by_magnitude(0.1, 100.0);
    for (double& part : solid.orientation.coeffs()) part = between(-1.0, 1.0);
    solid.orientation.normalize();
    solid.position.x() = between(-0.2, 0.2);
    solid.position.y() = height_m_ + reach_m;
    solid.position.z() = between(-0.2, 0.2);
    height_m_ += 2.0 * reach_m;
    scene_.rigid_bodies.push_back(solid);
  }

  std::mt19937 random_;
  Scene scene_;
  double height_m_ = 0.1;
};

double gases_j(const World& world) {
  double sum_j = 0.0;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) sum_j += world.measure(i).gas_j;
  return sum_j;
}

// Undamped balls that their gas blows up swing by a fiftieth of what it gives.
void expect_no_gain(const Pile& pile, std::uint32_t seed) {
  if (pile.scene().soft_bodies.empty()) return;
  auto world = World::create(pile.scene());
  if (!world.ok()) {
    ASSERT_EQ(pile.scene().stepping.substeps, 0U) << "seed " << seed << ": " << world.status().message();
    return;  // more substeps than a tick may have
  }
  const double first_j = whole_energy_j(*world);
  double least_gas_j = gases_j(*world);
  double most_gas_j = least_gas_j;
  for (int tick = 0; tick < 90; ++tick) {
    run_ticks(*world, 1);
    least_gas_j = std::min(least_gas_j, gases_j(*world));
    most_gas_j = std::max(most_gas_j, gases_j(*world));
    const double gained_j = whole_energy_j(*world) - first_j;
    ASSERT_LT(gained_j, 0.02 * (pile.came_with_j() + most_gas_j - least_gas_j)) << "seed " << seed << ", tick " << tick;
  }
  EXPECT_TRUE(world->take_frozen().empty()) << "seed " << seed;
}

// Ticks of it take more substeps than were chosen.
void expect_same_bits_in_more_substeps(const Pile& pile) {
  World on_one = make_world(pile.scene());
  World on_two = make_world(pile.scene());
  Workers one(1);
  Workers two(2);
  std::uint32_t most = 0;
  for (int tick = 0; tick < 60; ++tick) {
    on_one.step_tick(one);
    std::uint32_t substeps = 1;
    while (!on_two.substep(two)) ++substeps;
    most = std::max(most, substeps);
    ASSERT_EQ(on_one.state_hash(), on_two.state_hash()) << tick;
  }
  EXPECT_GT(most, on_two.substeps());
}

class StiffPiles : public testing::TestWithParam<std::uint32_t> {};

TEST_P(StiffPiles, GainNoEnergy) {
  for (std::uint32_t i = 0; i < 10; ++i) expect_no_gain(Pile(10 * GetParam() + i), 10 * GetParam() + i);
}

TEST_P(StiffPiles, GainNoEnergyByAnImplicitStepATick) {
  for (std::uint32_t i = 0; i < 5; ++i) {
    const std::uint32_t seed = 3'000 + 5 * GetParam() + i;
    Pile pile(seed);
    pile.step_by(pile.draw() % 2 == 0 ? Integrator::implicit_euler : Integrator::tr_bdf2, 1);
    expect_no_gain(pile, seed);
  }
}

TEST_P(StiffPiles, GainNoEnergyByAnImplicitStepATickOnARope) {
  for (std::uint32_t i = 0; i < 5; ++i) {
    const std::uint32_t seed = 6'000 + 5 * GetParam() + i;
    Pile pile(seed);
    pile.step_by(pile.draw() % 2 == 0 ? Integrator::implicit_euler : Integrator::tr_bdf2, 1);
    if (pile.scene().soft_bodies.empty()) continue;
    pile.tie();
    expect_no_gain(pile, seed);
  }
}

// The ball lies beside a box and on its rim, and rows that part what overlaps work on its springs: 4,400 % in a second.
// Shorter steps gained as much a second.
TEST(StiffPile, ABallOnARimGainsNoEnergyByOneStepATick) {
  Pile pile(3'258);
  ASSERT_EQ(pile.scene().stepping.integrator, Integrator::tr_bdf2);
  ASSERT_EQ(pile.scene().stepping.substeps, 1U);
  expect_no_gain(pile, 3'258);
}

// Steps of it gain, and are taken again with more care.
TEST(StiffPile, ATickThatIsTakenAgainHasTheSameBitsOnAnyNumberOfThreads) {
  const Pile pile(3'258);
  expect_same_bits_in_more_substeps(pile);
}

// A capsule of 10 kg falls 2 m on it. Its rows are found once a tick, and the vertices that it pressed against others
// meanwhile were stopped at the end: a step of 24 J.
TEST(StiffPile, ABallThatACapsuleFallsOnGainsNoEnergy) {
  Scene scene;
  scene.gravity = {0.0, -pile_pull_m_s2, 0.0};
  scene.stepping = {.integrator = Integrator::rk4, .sleep = false};
  Collider floor{.name = "floor", .shape = PlaneShape{}, .surface = {}};
  floor.surface = {.restitution = 0.708656, .friction = 0.583742};
  scene.colliders.push_back(floor);
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(1, 0.479041);
  ball.mass_kg = 0.422689;
  ball.springs = {.stiffness_n_m = 449'907.0, .damping_n_s_m = 1.03277};
  ball.gas = Gas{.moles = 0.0174391};
  ball.surface = {.restitution = 0.956528, .friction = 0.241512};
  ball.position = {0.235407, 0.599041, -0.0653777};
  scene.soft_bodies.push_back(ball);
  RigidBody capsule;
  capsule.name = "capsule";
  capsule.shape = CapsuleShape{.radius_m = 0.114982, .half_height_m = 0.286958};
  capsule.mass_kg = 10.7053;
  capsule.surface.friction = 0.717944;
  capsule.position = {0.0306498, 2.62253, 0.00360723};
  capsule.orientation = Quatd(-0.495832, -0.764774, -0.0904617, -0.401356).normalized();
  scene.rigid_bodies.push_back(capsule);
  World world = make_world(std::move(scene));
  const double first_j = whole_energy_j(world);
  bool is_met = false;  // the capsule falls more slowly than by its weight, and higher than the floor would stop it
  for (int tick = 0; tick < 60; ++tick) {
    run_ticks(world, 1);
    const RigidState& falling = world.rigid_bodies()[0];
    const bool is_slowed = falling.velocity.y() > 0.5 - pile_pull_m_s2 * world.time_s();
    is_met = is_met || (is_slowed && falling.position.y() > 0.5);
    ASSERT_LT(whole_energy_j(world), 1.005 * first_j) << "tick " << tick;
  }
  EXPECT_TRUE(is_met);
}

// A span that is stepped again takes more substeps than the tick has.
TEST(StiffPile, SteppedAgainHasTheSameBitsOnAnyNumberOfThreads) {
  const Pile pile(751);
  for (const SoftBody& body : pile.scene().soft_bodies) ASSERT_FALSE(body.gas) << "a pressed gas takes more as well";
  expect_same_bits_in_more_substeps(pile);
}

INSTANTIATE_TEST_SUITE_P(Seeds, StiffPiles, testing::Range(0U, tens_of_scenes()));

}  // namespace
}  // namespace pneuma::physics
