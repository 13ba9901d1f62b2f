#include "numerics/report/precision_runs.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "numerics/report/methods.h"
#include "numerics/report/timing.h"

namespace pneuma::report::precision {

using physics::Integrator;
using physics::World;

namespace {

constexpr std::uint32_t engine_substeps_max = 4096;

bool is_implicit(Integrator integrator) {
  return integrator == Integrator::implicit_euler || integrator == Integrator::tr_bdf2;
}

Sample sample_of(const World& world, const physics::Vec3d& gravity_m_s2) {
  Sample sample;
  for (std::size_t body = 0; body < world.soft_body_count(); ++body) {
    std::vector<double> coordinates(3 * world.soft_body(body).mesh->positions_m.size());
    world.copy_positions(body, coordinates);
    std::vector<physics::Vec3d>& positions = sample.positions_m.emplace_back();
    for (std::size_t i = 0; i < coordinates.size(); i += 3) positions.emplace_back(coordinates.data() + i);
    const physics::BodyMeasures& sums = sample.soft.emplace_back(world.measure(body));
    sample.kinetic_j += sums.kinetic_j;
    sample.energy_j += sums.kinetic_j + sums.elastic_j + sums.gas_j + sums.gravity_j;
    sample.momentum += sums.momentum;
    sample.angular_momentum += sums.angular_momentum;
  }
  for (const physics::RigidState& rigid : world.rigid_bodies()) {
    const double mass_kg = rigid.body.mass_kg;
    const double kinetic_j = 0.5 * mass_kg * rigid.velocity.squaredNorm();
    sample.rigid_m.push_back(rigid.position);
    sample.kinetic_j += kinetic_j;
    sample.energy_j += kinetic_j - mass_kg * gravity_m_s2.dot(rigid.position);
    sample.momentum += mass_kg * rigid.velocity;
    sample.angular_momentum += mass_kg * rigid.position.cross(rigid.velocity);
  }
  return sample;
}

std::string failure_of(World& world, const Sample& sample) {
  if (const auto frozen = world.take_frozen(); !frozen.empty()) return "frozen: " + frozen.front().reason;
  for (const std::vector<physics::Vec3d>& positions : sample.positions_m) {
    for (const physics::Vec3d& position : positions) {
      if (!position.allFinite()) return "not finite";
    }
  }
  return {};
}

/// Runs the case, its samples a sixtieth of a second apart whatever the rate.
Trajectory follow(const Case& subject, World& world, std::uint32_t rate) {
  physics::Workers alone(1);
  Trajectory trajectory;
  trajectory.samples.push_back(sample_of(world, subject.scene.gravity));
  while (trajectory.samples.size() <= subject.ticks && trajectory.failure.empty()) {
    for (std::uint32_t i = 0; i < rate; ++i) world.step_tick(alone);
    trajectory.samples.push_back(sample_of(world, subject.scene.gravity));
    trajectory.failure = failure_of(world, trajectory.samples.back());
  }
  return trajectory;
}

/// By RK4 with so many steps in 1/60 s, a power of two.
Trajectory follow_finely(const Case& subject, std::uint32_t substeps) {
  const std::uint32_t rate = std::max(1u, substeps / engine_substeps_max);
  World world = start(subject, {.integrator = Integrator::rk4, .substeps = substeps / rate}, rate);
  return follow(subject, world, rate);
}

double energy_drift(const Trajectory& trajectory) {
  double kinetic_j = 0.0;
  double drift_j = 0.0;
  for (const Sample& sample : trajectory.samples) {
    kinetic_j = std::max(kinetic_j, sample.kinetic_j);
    drift_j = std::max(drift_j, std::abs(sample.energy_j - trajectory.samples.front().energy_j));
  }
  return drift_j / kinetic_j;
}

}  // namespace

World start(const Case& subject, const Setting& setting, std::uint32_t rate) {
  physics::Scene scene = subject.scene;
  scene.stepping = {.rate_hz = rate_hz * rate,
                    .substeps = setting.substeps,
                    .integrator = setting.integrator,
                    .precision = setting.precision,
                    .error_target = setting.error_target,
                    .newton_iterations = setting.newton_iterations,
                    .on_unstable = physics::OnUnstable::allow,
                    .sleep = false};
  base::Result<World> world = World::create(std::move(scene));
  if (!world.ok()) throw std::runtime_error(subject.name + ": " + world.status().message());
  return std::move(*world);
}

Reference make_reference(const Case& subject) {
  constexpr std::uint32_t substeps_max = 32'768;
  const Measuring measuring = measuring_of(subject);
  Reference reference;
  reference.substeps = subject.reference_substeps;
  Trajectory coarse = follow_finely(subject, reference.substeps);
  while (!reference.converged && reference.substeps < substeps_max) {
    reference.substeps *= 2;
    reference.trajectory = follow_finely(subject, reference.substeps);
    if (!reference.trajectory.failure.empty()) throw std::runtime_error(subject.name + ": the reference failed");
    reference.halving = errors_of(coarse, reference.trajectory, measuring);
    reference.converged = reference.halving.*subject.judged.front().error < reference_change_max;
    coarse = reference.trajectory;
  }
  reference.energy_drift = energy_drift(reference.trajectory);
  return reference;
}

std::vector<Run> make_ladder(const Case& subject, bool quick) {
  const std::uint32_t rungs = quick ? 3 : 7;
  const std::uint32_t factor = quick ? 4 : 2;
  std::vector<Run> runs;
  const auto add = [&](const Setting& setting) {
    Run& run = runs.emplace_back();
    run.setting = setting;
    run.chosen = setting.integrator == Integrator::automatic;
  };
  for (const Integrator integrator : every_integrator) {
    std::uint32_t substeps = physics::is_explicit(integrator) ? subject.explicit_from : 1;
    for (std::uint32_t rung = 0; rung < rungs; ++rung, substeps *= factor) {
      add({.integrator = integrator, .substeps = substeps});
      if (integrator == Integrator::rk4 && subject.in_single_too) {
        add({.integrator = integrator, .substeps = substeps, .precision = physics::Precision::single_precision});
      }
      if (!is_implicit(integrator) || quick) continue;
      for (const std::uint32_t iterations : {1u, 2u, 4u, 8u}) {
        if (rung > 0 && iterations != 4) continue;
        add({integrator, substeps, iterations, tight_target});
      }
    }
  }
  for (const double target : {default_target, 0.1 * default_target}) {
    add({.integrator = Integrator::automatic, .error_target = target});
  }
  return runs;
}

void measure_error(Run& run, const Case& subject, const Trajectory& reference) {
  World world = start(subject, run.setting);
  run.setting.integrator = world.integrator();
  run.setting.substeps = world.substeps();
  run.reason = world.substeps_reason();
  const Trajectory trajectory = follow(subject, world, 1);
  run.failure = trajectory.failure;
  if (run.failure.empty()) run.errors = errors_of(trajectory, reference, measuring_of(subject));
}

Errors standstill_of(const Case& subject, const Trajectory& reference) {
  const World world = start(subject, {.substeps = 1});
  const Trajectory still{.samples{reference.samples.size(), sample_of(world, subject.scene.gravity)}, .failure{}};
  Measuring measuring = measuring_of(subject);
  measuring.period_s = 0.0;
  return errors_of(still, reference, measuring);
}

std::vector<Timed> timed_runs(const Case& subject, std::vector<Run>& runs) {
  std::vector<Timed> timed;
  for (Run& run : runs) {
    auto world = std::make_shared<World>(start(subject, run.setting));
    const auto race = [world, from = world->snapshot(), ticks = subject.ticks] {
      physics::Workers alone(1);
      if (!world->restore(from).ok()) throw std::logic_error("a world does not go back to its start");
      for (std::uint64_t tick = 0; tick < ticks; ++tick) world->step_tick(alone);
    };
    timed.push_back({race, static_cast<double>(subject.ticks) / rate_hz, &run.cpu_ms_per_s});
  }
  return timed;
}

void take_times(const std::vector<Timed>& timed, bool quick, const std::function<void()>& between) {
  constexpr double least_s = 0.004;  // shorter runs are made several times over: caches are cold after another's turn
  std::vector<int> repeats(timed.size(), 0);
  std::vector<std::function<void()>> contenders;
  for (std::size_t i = 0; i < timed.size(); ++i) {
    contenders.emplace_back([&run = timed[i].run, &times = repeats[i]] {
      if (times == 0) {
        const double begun_s = cpu_time_s();
        run();
        times = static_cast<int>(std::clamp(least_s / (cpu_time_s() - begun_s), 1.0, 100.0));
        return;
      }
      for (int repeat = 0; repeat < times; ++repeat) run();
    });
  }
  const std::vector<double> times_s = race_s(contenders, quick ? 1 : 5, quick ? 0.01 : 0.05, between);
  for (std::size_t i = 0; i < timed.size(); ++i) {
    *timed[i].cpu_ms_per_s = 1e3 * times_s[i] / (repeats[i] * timed[i].simulated_s);
  }
}

}  // namespace pneuma::report::precision
