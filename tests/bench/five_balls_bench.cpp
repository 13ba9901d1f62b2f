// How much faster than real time one core steps the paper's Fig. 1 as in the paper: five balls of 162 vertices in a
// rotating room, by bounding ellipsoids, midpoint, eight substeps.
#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "physics/world.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::bench {

namespace {

void contact(benchmark::State& bench, const char* name) {
  auto scene = scene_io::to_physics(*scene_io::load_scene(name));
  auto world = physics::World::create(std::move(*scene));
  physics::Workers one_thread(1);
  while (world->time_s() < 5.0) world->step_tick(one_thread);  // until they tumble in a heap
  for ([[maybe_unused]] auto _ : bench) world->step_tick(one_thread);
  bench.counters["times_real_time"] =
      benchmark::Counter(world->tick_period_s(), benchmark::Counter::kIsIterationInvariantRate);
  bench.counters["substeps"] = world->substeps();
}
BENCHMARK_CAPTURE(contact, five_balls_paper, "five-balls-paper")
    ->MinTime(2.0)
    ->Repetitions(5)
    ->Unit(benchmark::kMicrosecond);

[[maybe_unused]] const bool five_balls_paper_listed =
    expect({"contact/five_balls_paper/", "times_real_time", Bound::at_least, 15.0,
            "five-balls by ellipsoids on one core: times real time"});

}  // namespace

}  // namespace pneuma::bench
