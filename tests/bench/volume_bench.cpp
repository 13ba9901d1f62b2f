// What each way to measure a volume costs, and how far it is off: a ball of 162 vertices and the hand, each turned
// sixty ways. Times are of all sixty, errors relative to the exact volume.
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "numerics/volume_errors.h"

namespace pneuma::bench {

namespace {

void volume(benchmark::State& bench, const physics::SoftBody& body) {
  const std::vector<std::vector<physics::Vec3d>> poses_m = physics::turned_m(*body.mesh);
  const physics::VolumeError error = physics::volume_error(body, poses_m);
  for ([[maybe_unused]] auto _ : bench) {
    for (const auto& x : poses_m) benchmark::DoNotOptimize(physics::body_volume_m3<double>(body, x));
  }
  bench.counters["ns_per_volume"] =
      benchmark::Counter(static_cast<double>(poses_m.size()) * 1e-9,
                         benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  bench.counters["error_rms"] = error.rms;
  bench.counters["error_max"] = error.max;
}

bool list() {
  for (const physics::VolumeLadder& ladder : physics::volume_ladders()) {
    for (const std::uint32_t resolution : ladder.resolutions) {
      std::string name(ladder.name);
      if (resolution != 0) name.append("/").append(std::to_string(resolution));
      const physics::Volume method{ladder.method, resolution};
      benchmark::RegisterBenchmark(
          std::string("volume/ball_162/").append(name).c_str(),
          [method](benchmark::State& bench) { volume(bench, physics::ball_measured_by(method)); });
      benchmark::RegisterBenchmark(
          std::string("volume/hand_1159/").append(name).c_str(),
          [method](benchmark::State& bench) { volume(bench, physics::hand_measured_by(method)); });
    }
  }
  return true;
}

[[maybe_unused]] const bool volume_listed = list();

}  // namespace

}  // namespace pneuma::bench
