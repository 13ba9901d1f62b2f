// Shows that single precision holds far from the world's origin: a ball at (1e6, 0, 1e6) m falls and bounces there as
// it does at the origin.
#include "numerics/worlds.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

Scene falling_ball(const Vec3d& at, Precision precision, Integrator integrator) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping.precision = precision;
  scene.stepping.integrator = integrator;
  scene.stepping.substeps = 24;
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5);
  ball.springs = {.stiffness_n_m = 60.0, .damping_n_s_m = 0.5};
  ball.gas = Gas{.moles = 0.01};
  ball.position = at + Vec3d(0.3, 2.0, 0.1);
  scene.soft_bodies = {ball};
  Collider floor;
  floor.name = "floor";
  floor.position = at;
  floor.surface.restitution = 0.3;
  scene.colliders = {floor};
  return scene;
}

double energy_j(const BodyMeasures& m) {
  return m.kinetic_j + m.elastic_j + m.gas_j;
}

/// The largest relative errors of what a ball does, against the same one at the origin.
struct Errors {
  double volume = 0.0;
  double energy = 0.0;
  double place_m = 0.0;
};

Errors compare(Scene reference, Scene far_away, const Vec3d& at, int ticks) {
  World near = make_world(std::move(reference));
  World far = make_world(std::move(far_away));
  Errors errors;
  for (int tick = 0; tick < ticks; ++tick) {
    run_ticks(near, 1);
    run_ticks(far, 1);
    const BodyMeasures here = near.measure(0);
    const BodyMeasures there = far.measure(0);
    errors.volume = std::max(errors.volume, std::abs(there.volume_m3 / here.volume_m3 - 1.0));
    errors.energy = std::max(errors.energy,
                             std::abs((energy_j(there) + there.gravity_j) / (energy_j(here) + here.gravity_j) - 1.0));
    errors.place_m = std::max(errors.place_m, (there.centre_of_mass - at - here.centre_of_mass).norm());
  }
  return errors;
}

class FarAway : public testing::TestWithParam<Integrator> {};

// As long as it falls, also against double precision; off its lattice, so that it is rounded in another way.
TEST_P(FarAway, ABallFallsAsItDoesAtTheOrigin) {
  const Vec3d at(1e6 + 0.371, 0.0, 1e6 + 0.117);
  const Errors errors = compare(falling_ball(Vec3d::Zero(), Precision::double_precision, GetParam()),
                                falling_ball(at, Precision::single_precision, GetParam()), at, 33);
  EXPECT_LT(errors.volume, 1e-4);
  EXPECT_LT(errors.energy, 1e-4);
  EXPECT_LT(errors.place_m, 1e-4);
}

// Past a contact, rounding decides which vertex is first, so the reference is rounded in the same way.
TEST_P(FarAway, ABallBouncesAsItDoesAtTheOrigin) {
  const Vec3d at(1e6, 0, 1e6);
  const Errors errors = compare(falling_ball(Vec3d::Zero(), Precision::single_precision, GetParam()),
                                falling_ball(at, Precision::single_precision, GetParam()), at, 300);
  EXPECT_LT(errors.volume, 1e-3);
  EXPECT_LT(errors.energy, 1e-3);
  EXPECT_LT(errors.place_m, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Integrators, FarAway,
                         testing::Values(Integrator::midpoint, Integrator::rk4, Integrator::symplectic_euler,
                                         Integrator::implicit_euler, Integrator::tr_bdf2, Integrator::xpbd));

}  // namespace
}  // namespace pneuma::physics
