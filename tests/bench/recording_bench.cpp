// What it takes to go to any time of a recording: a minute of five-balls, a key frame a second, as `pneuma record`
// makes it, sought at times that have nothing to do with each other.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "bench/recorded_ticks.h"
#include "pneuma_client/playback.h"
#include "scene_io/load.h"
#include "support/temporary_folder.h"

namespace pneuma::bench {

namespace {

constexpr std::uint64_t recorded_ticks = 3'600;
void recording_seek(benchmark::State& bench) {
  const support::TemporaryFolder folder;
  const std::string path = folder / "minute.pneuma";
  if (const base::Status recorded = record_ticks(*scene_io::load_scene("five-balls"), recorded_ticks, path);
      !recorded.ok()) {
    return bench.SkipWithError(recorded.message().c_str());
  }
  auto playback = client::Playback::open(path);
  if (!playback.ok()) return bench.SkipWithError(playback.status().message().c_str());
  constexpr double golden_ratio = 0.6180339887498949;  // its multiples' fractions are nowhere near each other
  double place = 0.0;
  double slowest_ms = 0.0;
  for ([[maybe_unused]] auto _ : bench) {
    place = std::fmod(place + golden_ratio, 1.0);
    const auto start = std::chrono::steady_clock::now();
    const base::Status found = playback->seek(place * playback->index().duration_s());
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    if (!found.ok()) return bench.SkipWithError(found.message().c_str());
    slowest_ms = std::max(slowest_ms, took.count());
  }
  bench.counters["slowest_ms"] = slowest_ms;
}
BENCHMARK(recording_seek)->Iterations(500)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool recording_listed = expect({"recording_seek/", "slowest_ms", Bound::at_most, 50.0,
                                                       "a seek in a minute of five-balls, the slowest of 500, ms"});

}  // namespace

}  // namespace pneuma::bench
