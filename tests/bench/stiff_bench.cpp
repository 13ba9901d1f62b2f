// What a stiff ball costs until it rests at the right volume: 162 vertices, 1 kg, a step of implicit Euler a frame at
// 60 Hz, ten seconds from the shape of its springs. Then the same among sixteen, a hundred times as stiff, and with a
// thousand times the gas. The error is that of its volume against the closed form of its equilibrium.
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>
#include <utility>

#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::bench {

namespace {

struct Ball {
  double stiffness_n_m;
  double nrt_j;
};
constexpr Ball ordinary{1e4, 100.0};
constexpr Ball stiff{1e6, 100.0};
constexpr Ball inflated{1e4, 1e5};

struct Outcome {
  double us_per_frame = 0.0;  // a ball
  double volume_error = 0.0;
  double bytes_per_vertex = 0.0;
};

physics::World balls_world(const Ball& ball, int count, const std::shared_ptr<const physics::Mesh>& mesh) {
  physics::Scene scene;
  scene.stepping = {.rate_hz = 60.0, .substeps = 1, .integrator = physics::Integrator::implicit_euler};
  scene.stepping.sleep = false;  // it is the steps that are timed
  physics::SoftBody body;
  body.mesh = mesh;
  body.springs = {.stiffness_n_m = ball.stiffness_n_m, .damping_n_s_m = 10.0};
  body.gas = physics::Gas{.moles = ball.nrt_j / (physics::gas_constant_j_mol_k * 293.15)};
  for (int i = 0; i < count; ++i) {
    body.name = std::to_string(i);
    body.position = {10.0 * i, 0.0, 0.0};
    scene.soft_bodies.push_back(body);
  }
  auto world = physics::World::create(std::move(scene));
  if (!world.ok()) std::abort();
  return std::move(*world);
}

// What the stages of a step hold; a mesh is not in it.
double bytes_per_vertex(const physics::World& world, double vertices) {
  double bytes = 0.0;
  for (const physics::StageRow& row : world.profile()) bytes += static_cast<double>(row.bytes);
  return bytes / vertices;
}

Outcome settle(const Ball& ball, int count = 1) {
  const std::shared_ptr<const physics::Mesh> mesh = *physics::make_icosphere(2, 1.0);
  double squares_m2 = 0.0;
  for (const double length_m : mesh->edge_lengths_m) squares_m2 += length_m * length_m;
  const double scale = (1.0 + std::sqrt(1.0 + 12.0 * ball.nrt_j / (ball.stiffness_n_m * squares_m2))) / 2.0;
  const double rest_m3 = physics::signed_volume_m3(mesh->positions_m, mesh->faces);
  physics::World world = balls_world(ball, count, mesh);
  physics::Workers workers(1);
  const int frames = 600;
  const std::clock_t start = std::clock();  // CPU time: other programs do not count
  for (int frame = 0; frame < frames; ++frame) world.step_tick(workers);
  const double elapsed_us = static_cast<double>(std::clock() - start) * (1e6 / CLOCKS_PER_SEC);
  const double vertices = static_cast<double>(mesh->positions_m.size()) * count;
  return {elapsed_us / (frames * count), std::abs(world.measure(0).volume_m3 / (rest_m3 * std::pow(scale, 3)) - 1.0),
          bytes_per_vertex(world, vertices)};
}

void stiff_ball(benchmark::State& bench) {
  Outcome one;
  Outcome of_fleet;
  Outcome harder;
  Outcome fuller;
  for ([[maybe_unused]] auto _ : bench) {
    one = settle(ordinary);
    of_fleet = settle(ordinary, 16);
    harder = settle(stiff);
    fuller = settle(inflated);
  }
  bench.counters["us"] = one.us_per_frame;
  bench.counters["fleet_us"] = of_fleet.us_per_frame;
  bench.counters["bytes_per_vertex"] = one.bytes_per_vertex;
  bench.counters["fleet_bytes_per_vertex"] = of_fleet.bytes_per_vertex;
  bench.counters["error"] = one.volume_error;
  bench.counters["stiff_x"] = harder.us_per_frame / one.us_per_frame;
  bench.counters["stiff_error"] = harder.volume_error;
  bench.counters["inflated_x"] = fuller.us_per_frame / one.us_per_frame;
  bench.counters["inflated_error"] = fuller.volume_error;
}
BENCHMARK(stiff_ball)->Iterations(1)->Repetitions(5)->Unit(benchmark::kMillisecond);

// Of one ball of 10,242 vertices: its matrix's factor has most of it.
void stiff_memory(benchmark::State& bench) {
  const std::shared_ptr<const physics::Mesh> mesh = *physics::make_icosphere(5, 1.0);
  physics::Workers workers(1);
  for ([[maybe_unused]] auto _ : bench) {
    physics::World world = balls_world(ordinary, 1, mesh);
    world.step_tick(workers);
    bench.counters["bytes_per_vertex"] = bytes_per_vertex(world, static_cast<double>(mesh->positions_m.size()));
  }
}
BENCHMARK(stiff_memory)->Iterations(1);

[[maybe_unused]] const bool stiff_listed =
    expect({"stiff_ball/", "us", Bound::at_most, 35.0,
            "ball of 162 vertices, k = 1e4 N/m, nRT = 100 J, one step a frame: us a frame"}) &&
    expect({"stiff_ball/", "fleet_us", Bound::at_most, 10.0, "the same among sixteen: us a ball a frame"}) &&
    expect({"stiff_ball/", "error", Bound::at_most, 0.01, "its volume at rest, off the closed form by"}) &&
    expect({"stiff_ball/", "stiff_x", Bound::at_most, 8.0, "k = 1e6 N/m: times that cost"}) &&
    expect({"stiff_ball/", "stiff_error", Bound::at_most, 0.02, "k = 1e6 N/m: volume off by"}) &&
    expect({"stiff_ball/", "inflated_x", Bound::at_most, 8.0, "nRT = 1e5 J: times that cost"}) &&
    expect({"stiff_ball/", "inflated_error", Bound::at_most, 0.02, "nRT = 1e5 J: volume off by"});

}  // namespace

}  // namespace pneuma::bench
