// Shows that contact keeps laws with closed forms: the momentum of bodies that meet in free space to 1e-12, their
// angular momentum to 0.1 %, and Coulomb's bound on a slope to 1 %. Soft and stiff bodies, explicit and implicit
// methods. And that friction feeds no heap.
#include "numerics/known_scenes.h"
#include "numerics/worlds.h"
#include "support/soft_heap.h"

namespace pneuma::physics {
namespace {

struct Material {
  Integrator integrator;
  double stiffness_n_m;
};

std::uint32_t substeps_of(Integrator integrator) {
  return integrator == Integrator::implicit_euler || integrator == Integrator::tr_bdf2 ? 1U : 0U;
}

Collider floor_with(double friction) {
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  floor.surface = {.restitution = 0.0, .friction = friction};
  return floor;
}

Vec3d momentum_of(const World& world) {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) sum += world.measure(i).momentum;
  for (const RigidState& body : world.rigid_bodies()) sum += body.body.mass_kg * body.velocity;
  return sum;
}

Vec3d angular_momentum_of(const World& world) {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) sum += world.measure(i).angular_momentum;
  for (const RigidState& body : world.rigid_bodies()) {
    const Vec3d spin_rad_s = body.orientation.conjugate() * body.angular_velocity;
    sum += body.position.cross(Vec3d(body.body.mass_kg * body.velocity)) +
           body.orientation * spin_rad_s.cwiseQuotient(body.inverse_inertia_1_kg_m2);
  }
  return sum;
}

class ContactLaw : public testing::TestWithParam<Material> {
 protected:
  [[nodiscard]] static BreathingBall ball(std::uint32_t subdivisions) {
    return {.subdivisions = subdivisions,
            .mass_kg = 1.0,
            .stiffness_n_m = GetParam().stiffness_n_m,
            .damping_n_s_m = 1.0,
            .nrt_j = 73.0};
  }
  [[nodiscard]] static Scene ball_scene(std::uint32_t subdivisions) {
    Scene scene = ball(subdivisions).scene(1.0, GetParam().integrator, 60.0, substeps_of(GetParam().integrator));
    scene.soft_bodies[0] = ball(subdivisions).body(ball(subdivisions).equilibrium_scale());
    scene.soft_bodies[0].springs.rest_scale = 1.0 / ball(subdivisions).equilibrium_scale();
    return scene;
  }
};

// A graze that the first body comes to at least a fifth slower from: their centres pass each other at 0.4 m.
void expect_momenta_kept(Scene scene) {
  World world = make_world(std::move(scene));
  const Vec3d start = momentum_of(world);
  const Vec3d start_kg_m2_s = angular_momentum_of(world);
  const double approach_kg_m_s = world.measure(0).momentum.norm();
  run_ticks(world, 60);
  const Vec3d end = momentum_of(world);
  EXPECT_LT(world.measure(0).momentum.x(), 0.8 * approach_kg_m_s) << "they did not meet";
  EXPECT_LT((end - start).norm(), 1e-12 * approach_kg_m_s);
  EXPECT_LT((angular_momentum_of(world) - start_kg_m2_s).norm(), 1e-3 * start_kg_m2_s.norm());
}

TEST_P(ContactLaw, TwoSoftBallsThatGrazeKeepTheirMomenta) {
  Scene scene = ball_scene(2);
  scene.soft_bodies.push_back(scene.soft_bodies[0]);
  scene.soft_bodies[1].name = "other";
  for (const int side : {0, 1}) {
    SoftBody& body = scene.soft_bodies[static_cast<std::size_t>(side)];
    const double sign = side == 0 ? 1.0 : -1.0;
    body.position = sign * Vec3d(-0.8, 0.2, 0.0);
    body.velocity = {sign * 1.5, 0.0, 0.0};
    body.surface = {.restitution = 0.5, .friction = 0.5};
  }
  expect_momenta_kept(std::move(scene));
}

TEST_P(ContactLaw, ASoftBallAndARigidOneThatGrazeKeepTheirMomenta) {
  Scene scene = ball_scene(2);
  SoftBody& body = scene.soft_bodies[0];
  body.position = {-0.8, 0.2, 0.0};
  body.velocity = {1.5, 0.0, 0.0};
  body.surface = {.restitution = 0.5, .friction = 0.5};
  RigidBody stone;
  stone.name = "stone";
  stone.shape = SphereShape{0.5};
  stone.position = {0.8, -0.2, 0.0};
  stone.velocity = {-1.5, 0.0, 0.0};
  stone.surface = body.surface;
  scene.rigid_bodies.push_back(stone);
  expect_momenta_kept(std::move(scene));
}

// What a slab has slid in the last half second of two, on a slope whose tangent is a share of the friction. Where it
// slides, what presses carries its weight and also stops its last swings across the slope; friction is a share of both.
TEST_P(ContactLaw, ASoftSlabSticksOnASlopeIfAndOnlyIfItsTangentIsWithinTheFriction) {
  constexpr double friction = 0.5;
  for (const double share : {0.99, 1.01}) {
    Scene scene;
    scene.stepping = steps_as_asked(GetParam().integrator, 60.0, substeps_of(GetParam().integrator));
    scene.gravity = 9.81 * Vec3d(share * friction, -1.0, 0.0).normalized();
    SoftBody slab;
    slab.name = "slab";
    slab.mesh = *make_box({0.4, 0.1, 0.4}, 2);
    slab.mass_kg = 1.0;
    slab.springs = {.stiffness_n_m = GetParam().stiffness_n_m, .damping_n_s_m = 20.0};
    slab.position.y() = 0.1;
    slab.surface = {.restitution = 0.0, .friction = friction};
    scene.soft_bodies.push_back(slab);
    scene.colliders.push_back(floor_with(friction));
    World world = make_world(std::move(scene));
    run_ticks(world, 90);
    const double start_m = world.measure(0).centre_of_mass.x();
    const Vec3d start_kg_m_s = world.measure(0).momentum;
    run_ticks(world, 30);
    const double moved_m = world.measure(0).centre_of_mass.x() - start_m;
    const double excess_m_s2 = 9.81 * (share - 1.0) * friction / std::hypot(1.0, share * friction);
    const Vec3d gained_m_s = world.measure(0).momentum - start_kg_m_s;  // of 1 kg
    const double wanted_m_s = 0.5 * excess_m_s2 - friction * gained_m_s.y();
    if (share < 1.0) {
      EXPECT_LT(std::abs(moved_m), 1e-3);
    } else {
      EXPECT_NEAR(gained_m_s.x(), wanted_m_s, 1e-3 * wanted_m_s);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Methods, ContactLaw,
    testing::Values(Material{Integrator::symplectic_euler, 1e3}, Material{Integrator::midpoint, 1e3},
                    Material{Integrator::rk4, 1e3}, Material{Integrator::automatic, 1e3},
                    Material{Integrator::automatic, 1e6}, Material{Integrator::implicit_euler, 1e3},
                    Material{Integrator::implicit_euler, 1e6}, Material{Integrator::tr_bdf2, 1e3},
                    Material{Integrator::tr_bdf2, 1e6}),
    [](const auto& param) {
      return std::string(name_of(param.param.integrator)).append(param.param.stiffness_n_m > 1e5 ? "Stiff" : "Soft");
    });

/// Two layers of four soft balls in a shaft.
Scene heap_in_a_shaft(Integrator integrator) {
  Scene scene = support::soft_heap(8, 0.65, integrator);
  scene.stepping.sleep = false;
  return scene;
}

/// In which every third is a box.
Scene heap_with_boxes(Integrator integrator) {
  Scene scene = heap_in_a_shaft(integrator);
  for (const std::size_t i : {std::size_t{7}, std::size_t{4}, std::size_t{1}}) {
    RigidBody box;
    box.name = "box-" + std::to_string(i);
    box.shape = BoxShape{Vec3d::Constant(0.18)};
    box.position = scene.soft_bodies[i].position;
    box.surface.friction = 0.5;
    scene.rigid_bodies.push_back(box);
    scene.soft_bodies.erase(scene.soft_bodies.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return scene;
}

/// Of the half second from 9.5 s on, the furthest that a vertex of a soft body came.
double furthest_at_rest_m(const Scene& heap) {
  World world = make_world(heap);
  run_ticks(world, 570);
  std::vector<std::vector<Vec3d>> before_m;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) before_m.push_back(positions_of(world, i));
  run_ticks(world, 30);
  double furthest_m = 0.0;
  for (std::size_t i = 0; i < before_m.size(); ++i) {
    const std::vector<Vec3d> after_m = positions_of(world, i);
    for (std::size_t k = 0; k < after_m.size(); ++k) {
      furthest_m = std::max(furthest_m, (after_m[k] - before_m[i][k]).norm());
    }
  }
  return furthest_m;
}

class ExplicitHeap : public testing::TestWithParam<Integrator> {};

// Where a substep moved by its mean velocity what friction held, midpoint and RK4 went on for ever, RK4 by up to 250 mm
// in half a second.
TEST_P(ExplicitHeap, ComesToRest) {
  EXPECT_LT(furthest_at_rest_m(heap_in_a_shaft(GetParam())), 3e-3);
}
INSTANTIATE_TEST_SUITE_P(Methods, ExplicitHeap,
                         testing::Values(Integrator::symplectic_euler, Integrator::midpoint, Integrator::rk4),
                         test_name_of);

// By 5 mm where only rows of two skins moved by the velocity that a substep ends with.
TEST(ExplicitHeapWithBoxes, ComesToRestByMidpoint) {
  EXPECT_LT(furthest_at_rest_m(heap_with_boxes(Integrator::midpoint)), 3e-3);
}

}  // namespace
}  // namespace pneuma::physics
