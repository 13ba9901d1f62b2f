#include "numerics/report/volume_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "numerics/known_scenes.h"
#include "numerics/report/precision_errors.h"
#include "numerics/volume_errors.h"

namespace pneuma::report::volumes {

using physics::Integrator;
using physics::Scene;

namespace {

constexpr std::uint64_t rest_ticks = 60;
constexpr std::uint64_t free_ticks = 120;
constexpr double rest_rate_hz = 60.0;
constexpr double free_rate_hz = 240.0;
constexpr double none = std::numeric_limits<double>::quiet_NaN();  // of a body that ran away

Scene scene_of(physics::SoftBody body, Integrator integrator, double rate_hz, std::uint32_t substeps) {
  Scene scene;
  scene.stepping = {.rate_hz = rate_hz,
                    .substeps = substeps,
                    .integrator = integrator,
                    .on_unstable = physics::OnUnstable::allow,
                    .sleep = false};
  scene.soft_bodies.push_back(std::move(body));
  return scene;
}

// Symplectic Euler keeps the energy of what has one, so what is gained or lost when free is the volume's.
Motion motion_of(const std::string& name, physics::SoftBody body, double damping_n_s_m, const physics::Vec3d& spin,
                 std::uint32_t free_substeps) {
  Motion motion{.name = name};
  body.springs.damping_n_s_m = damping_n_s_m;
  motion.rest = scene_of(body, Integrator::implicit_euler, rest_rate_hz, 4);
  body.springs.damping_n_s_m = 0.0;
  body.angular_velocity = spin;
  motion.free = scene_of(std::move(body), Integrator::symplectic_euler, free_rate_hz, free_substeps);
  return motion;
}

double mean(std::span<const double> values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double volume_at_rest_m3(const Scene& scene) {
  physics::World world = physics::make_world(scene);
  physics::Workers workers(1);
  std::vector<double> volumes_m3;
  for (std::uint64_t i = 0; i < rest_ticks; ++i) {
    world.step_tick(workers);
    volumes_m3.push_back(world.measure(0).volume_m3);
  }
  return world.is_frozen(0) ? none : mean(std::span(volumes_m3).last(rest_ticks / 6));
}

// The work of the gas is PV ln(V / V_start) where PV is the same all along, at whatever ratio to nRT.
double gained_j(const std::vector<physics::BodyMeasures>& samples) {
  double pv_j = 0.0;
  for (const auto& each : samples) pv_j += each.pressure_pa * each.volume_m3 / static_cast<double>(samples.size());
  std::vector<double> energies_j;
  for (const auto& each : samples) {
    energies_j.push_back(each.kinetic_j + each.elastic_j - pv_j * std::log(each.volume_m3 / samples[0].volume_m3));
  }
  const std::size_t quarter = energies_j.size() / 4;
  return mean(std::span(energies_j).last(quarter)) - mean(std::span(energies_j).first(quarter));
}

}  // namespace

std::array<Motion, 2> motions() {
  const physics::BreathingBall ball{.subdivisions = 2};
  std::array<Motion, 2> all{motion_of("ball", ball.body(0.9 * ball.equilibrium_scale()), 10.0, {0.5, 1.0, 1.5}, 16),
                            motion_of("hand", physics::hand_measured_by({}), 0.2, {2.0, 3.0, 6.0}, 32)};
  all[0].period_s = 2.0 * std::numbers::pi / ball.frequency_rad_s();
  for (Scene* scene : {&all[1].rest, &all[1].free}) scene->soft_bodies[0].pins.clear();
  return all;
}

MotionResult run_motion(const Motion& motion, const physics::Volume& volume) {
  Motion measured = motion;
  measured.rest.soft_bodies[0].volume = volume;
  measured.free.soft_bodies[0].volume = volume;
  MotionResult result{.volume_at_rest_m3 = volume_at_rest_m3(measured.rest)};

  physics::World world = physics::make_world(measured.free);
  physics::Workers workers(1);
  std::vector<physics::BodyMeasures> samples{world.measure(0)};
  std::vector<double> volumes_m3{samples[0].volume_m3};
  for (std::uint64_t i = 0; i < free_ticks; ++i) {
    world.step_tick(workers);
    samples.push_back(world.measure(0));
    volumes_m3.push_back(samples.back().volume_m3);
    result.kinetic_max_j = std::max(result.kinetic_max_j, samples.back().kinetic_j);
  }
  result.energy_gained_j = world.is_frozen(0) ? none : gained_j(samples);
  if (motion.period_s > 0.0) {
    result.period_s = precision::fitted_period_s(volumes_m3, 1.0 / free_rate_hz, motion.period_s);
  }
  return result;
}

}  // namespace pneuma::report::volumes
