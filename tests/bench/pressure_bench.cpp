// The paper's Fig. 6: what the pressure force costs against the number of vertices. Volume and pressure force of
// icospheres from 162 to 40,962 vertices; then a straight line through all of them, with its R^2. The largest ball
// decides that line; so the dearest vertex of any size is also set against the cheapest.
#include <algorithm>
#include <ctime>
#include <limits>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "physics/forces/gas_force.h"
#include "physics/forces/soft_setup.h"
#include "physics/forces/volume.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::bench {

namespace {

using physics::Vec3;

physics::SoftState<double> ball(std::uint32_t subdivisions) {
  physics::SoftBody body;
  body.name = "ball";
  body.mesh = *physics::make_icosphere(subdivisions, 1.0);
  body.gas = physics::Gas{.moles = 0.04};
  return physics::make_soft_state<double>(body);
}

void volume_and_pressure(physics::SoftState<double>& state, std::vector<Vec3<double>>& force) {
  const double volume_m3 = physics::body_volume_m3<double>(state.body, state.x);
  physics::add_pressure<double>(state, 100.0 / volume_m3, state.x, force);
}

void pressure_force(benchmark::State& bench) {
  auto state = ball(static_cast<std::uint32_t>(bench.range(0)));
  std::vector<Vec3<double>> force(state.x.size(), Vec3<double>::Zero());
  for ([[maybe_unused]] auto _ : bench) {
    volume_and_pressure(state, force);
    benchmark::DoNotOptimize(force.data());
  }
  bench.counters["vertices"] = static_cast<double>(state.x.size());
  bench.counters["ns_per_vertex"] =
      benchmark::Counter(static_cast<double>(state.x.size()) * 1e-9,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(pressure_force)->DenseRange(2, 6);

// Least squares of time against vertices over sizes 162..40,962, each timed as the median of interleaved rounds.
void pressure_force_fit(benchmark::State& bench) {
  constexpr int rounds = 15;
  std::vector<physics::SoftState<double>> balls;
  for (std::uint32_t subdivisions = 2; subdivisions <= 6; ++subdivisions) balls.push_back(ball(subdivisions));
  std::vector<std::vector<double>> times_ns(balls.size());
  for ([[maybe_unused]] auto _ : bench) {
    for (int round = 0; round < rounds; ++round) {
      for (std::size_t i = 0; i < balls.size(); ++i) {
        std::vector<Vec3<double>> force(balls[i].x.size(), Vec3<double>::Zero());
        const std::size_t repeats = 200'000 / balls[i].x.size() + 1;
        const std::clock_t start = std::clock();  // CPU time: other programs do not count
        for (std::size_t repeat = 0; repeat < repeats; ++repeat) {
          volume_and_pressure(balls[i], force);
          benchmark::DoNotOptimize(force.data());
        }
        const double elapsed_ns = static_cast<double>(std::clock() - start) * (1e9 / CLOCKS_PER_SEC);
        times_ns[i].push_back(elapsed_ns / static_cast<double>(repeats));
      }
    }
  }
  double dearest_ns = 0.0, cheapest_ns = std::numeric_limits<double>::infinity();  // a vertex
  double n = 0.0, sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0, sum_yy = 0.0;
  for (std::size_t i = 0; i < balls.size(); ++i) {
    std::ranges::sort(times_ns[i]);
    const double x = static_cast<double>(balls[i].x.size());
    const double y = times_ns[i][times_ns[i].size() / 2];
    dearest_ns = std::max(dearest_ns, y / x);
    cheapest_ns = std::min(cheapest_ns, y / x);
    n += 1.0;
    sum_x += x;
    sum_y += y;
    sum_xx += x * x;
    sum_xy += x * y;
    sum_yy += y * y;
  }
  const double covariance = n * sum_xy - sum_x * sum_y;
  const double variance_x = n * sum_xx - sum_x * sum_x;
  const double variance_y = n * sum_yy - sum_y * sum_y;
  bench.counters["ns_per_vertex"] = covariance / variance_x;
  bench.counters["ns_per_vertex_max"] = dearest_ns;
  bench.counters["ns_per_vertex_min"] = cheapest_ns;
  bench.counters["max_over_min"] = dearest_ns / cheapest_ns;
  bench.counters["R2"] = covariance * covariance / (variance_x * variance_y);
}
BENCHMARK(pressure_force_fit)->Iterations(1)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool pressure_listed =
    expect({"pressure_force_fit/", "R2", Bound::at_least, 0.99,
            "pressure force, 162..40,962 vertices: R^2 of a straight line"}) &&
    expect({"pressure_force_fit/", "max_over_min", Bound::at_most, 1.5,
            "pressure force: dearest over cheapest vertex of these sizes"});

}  // namespace

}  // namespace pneuma::bench
