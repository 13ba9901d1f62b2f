// What bodies at rest cost: 32 balls on a floor, asleep and kept awake, a tick each in turn.
#include <chrono>
#include <string>
#include <utility>

#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::bench {

namespace {

using namespace physics;

constexpr int balls = 32;
constexpr double patience_s = 60.0;

Scene balls_on_a_floor(bool sleep) {
  Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping = {.integrator = Integrator::symplectic_euler, .precision = Precision::single_precision};
  scene.stepping.sleep = sleep;
  const auto mesh = *make_icosphere(2, 0.5);
  for (int i = 0; i < balls; ++i) {
    SoftBody ball;
    ball.name = "ball-" + std::to_string(i);
    ball.mesh = mesh;
    const int row = i / 8;
    ball.position = {1.5 * (i % 8), 0.5, 1.5 * row};
    ball.springs = {.stiffness_n_m = 1000.0, .damping_n_s_m = 5.0};
    ball.gas = Gas{.moles = 0.028};
    ball.surface.friction = 0.3;
    scene.soft_bodies.push_back(ball);
  }
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  scene.colliders.push_back(floor);
  return scene;
}

bool all_sleep(const World& world) {
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    if (!world.is_asleep(i)) return false;
  }
  return true;
}

double timed_tick_s(World& world, Workers& workers) {
  const auto start = std::chrono::steady_clock::now();
  world.step_tick(workers);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void resting_balls(benchmark::State& bench) {
  World asleep = std::move(*World::create(balls_on_a_floor(true)));
  World awake = std::move(*World::create(balls_on_a_floor(false)));
  Workers one_thread(1);
  while (!all_sleep(asleep) && asleep.time_s() < patience_s) {
    asleep.step_tick(one_thread);
    awake.step_tick(one_thread);
  }
  if (!all_sleep(asleep)) bench.SkipWithError("they do not fall asleep");
  double asleep_s = 0.0;
  double awake_s = 0.0;
  for ([[maybe_unused]] auto _ : bench) {
    asleep_s += timed_tick_s(asleep, one_thread);
    awake_s += timed_tick_s(awake, one_thread);
  }
  bench.counters["share"] = asleep_s / awake_s;
  bench.counters["fell_asleep_s"] = asleep.time_s();
}
BENCHMARK(resting_balls)->MinTime(0.5)->Repetitions(3)->Unit(benchmark::kMicrosecond);

[[maybe_unused]] const bool sleep_listed =
    expect({"resting_balls/", "share", Bound::at_most, 0.03, "32 balls at rest: cost asleep over cost awake"});

}  // namespace

}  // namespace pneuma::bench
