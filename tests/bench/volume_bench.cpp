// What each way to measure a volume costs, and how far it is off: a ball of 162 vertices and the hand, each turned
// sixty ways. Times are of all sixty, errors relative to the exact volume.
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "physics/forces.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::bench {

namespace {

using physics::Vec3d;
using physics::VolumeMethod;

constexpr int poses = 60;

std::shared_ptr<const physics::Mesh> ball() {
  return *physics::make_icosphere(2, 1.0);
}

std::shared_ptr<const physics::Mesh> hand() {
  return scene_io::to_physics(*scene_io::load_scene("hand"))->soft_bodies[0].mesh;
}

std::vector<std::vector<Vec3d>> turned(const physics::Mesh& mesh) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-1.0, 1.0);
  std::vector<std::vector<Vec3d>> all(poses, mesh.positions_m);
  for (std::vector<Vec3d>& x : all) {
    const physics::Quatd turn(anywhere(random), anywhere(random), anywhere(random), anywhere(random));
    for (Vec3d& p : x) p = turn.normalized() * p;
  }
  return all;
}

void volume(benchmark::State& bench, const std::shared_ptr<const physics::Mesh>& mesh, physics::Volume method) {
  physics::SoftBody body;
  body.mesh = mesh;
  body.volume = method;
  const std::vector<std::vector<Vec3d>> all = turned(*mesh);
  const double exact_m3 = physics::signed_volume_m3(mesh->positions_m, mesh->faces);
  double squares = 0.0;
  double worst = 0.0;
  for (const std::vector<Vec3d>& x : all) {
    const double error = physics::body_volume_m3<double>(body, x) / exact_m3 - 1.0;
    squares += error * error;
    worst = std::max(worst, std::abs(error));
  }
  for ([[maybe_unused]] auto _ : bench) {
    for (const std::vector<Vec3d>& x : all) benchmark::DoNotOptimize(physics::body_volume_m3<double>(body, x));
  }
  bench.counters["ns_per_volume"] =
      benchmark::Counter(poses * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  bench.counters["error_rms"] = std::sqrt(squares / poses);
  bench.counters["error_max"] = worst;
}

bool list() {
  struct Row {
    std::string name;
    VolumeMethod method;
    std::vector<std::uint32_t> resolutions;
  };
  const std::array<Row, 6> rows{
      Row{"exact", VolumeMethod::exact, {0}},
      Row{"box", VolumeMethod::box, {0}},
      Row{"ball", VolumeMethod::ball, {0}},
      Row{"ellipsoid", VolumeMethod::ellipsoid, {0}},
      Row{"subdivided", VolumeMethod::subdivided, {4, 8, 16, 32, 64, 128}},
      Row{"monte_carlo", VolumeMethod::monte_carlo, {256, 1'024, 4'096, 16'384, 65'536}},
  };
  for (const Row& row : rows) {
    for (const std::uint32_t resolution : row.resolutions) {
      std::string name = row.name;
      if (resolution != 0) name.append("/").append(std::to_string(resolution));
      const physics::Volume method{row.method, resolution};
      benchmark::RegisterBenchmark(std::string("volume/ball_162/").append(name).c_str(),
                                   [method](benchmark::State& bench) { volume(bench, ball(), method); });
      benchmark::RegisterBenchmark(std::string("volume/hand_1159/").append(name).c_str(),
                                   [method](benchmark::State& bench) { volume(bench, hand(), method); });
    }
  }
  return true;
}

[[maybe_unused]] const bool listed = list();

}  // namespace

}  // namespace pneuma::bench
