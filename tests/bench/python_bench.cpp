// What Python costs: the engine and the codec from a script, over the same from C++. They take turns, since what else
// the machine does changes, and the medians of the turns are compared.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <google/protobuf/util/json_util.h>

#include "app/frame_hub.h"
#include "app/live_world.h"
#include "bench/figures.h"
#include "bench/median.h"
#include "bench/peers.h"
#include "bench/recorded_ticks.h"
#include "physics/machine/workers.h"
#include "physics/mesh/mesh_builders.h"
#include "pneuma_client/frames.h"
#include "pneuma_client/recording.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"
#include "support/program.h"
#include "support/temporary_folder.h"

namespace pneuma::bench {

namespace {

using Clock = std::chrono::steady_clock;

constexpr int python_turns = 5;
constexpr std::size_t fleet_worlds = 1'024;
constexpr int fleet_ticks = 20;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// The number that the script prints; 0 where it fails, with its reason on our standard error.
double python_figure(const std::vector<std::string>& arguments) {
  std::vector<std::string> all{PNEUMA_SOURCE_DIR "/tests/bench/python_figures.py"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  auto program = support::Program::start(PNEUMA_PYTHON_PROGRAM, all);
  if (!program.ok()) return 0.0;
  const auto ended = program->wait(std::chrono::minutes(2));
  if (ended.ok() && *ended == 0) return std::stod(program->output());
  std::fputs(program->error_output().c_str(), stderr);
  return 0.0;
}

/// A ball of 162 vertices that falls on a floor, in 8 substeps a tick. By symplectic Euler, which evaluates the forces
/// once a substep, as Bullet does once a pass.
v1::Scene ball_scene() {
  v1::Scene scene = *scene_io::load_scene("bouncing-ball");
  scene.mutable_stepping()->set_substeps(8);
  scene.mutable_stepping()->set_integrator(v1::Stepping::SYMPLECTIC_EULER);
  return scene;
}

/// Each world by itself, as a program in C++ would step it, on as many threads as Python uses.
double straight_ticks_a_second(const physics::Scene& scene) {
  std::vector<physics::World> worlds;
  for (std::size_t i = 0; i < fleet_worlds; ++i) worlds.push_back(std::move(*physics::World::create(scene)));
  physics::Workers threads(std::max(1U, std::thread::hardware_concurrency()));
  const auto start = Clock::now();
  for (int tick = 0; tick < fleet_ticks; ++tick) {
    threads.for_each(fleet_worlds, [&](std::size_t i) {
      physics::Workers alone(1);
      worlds[i].step_tick(alone);
    });
  }
  return static_cast<double>(fleet_worlds) * fleet_ticks / seconds_since(start);
}

void python_worlds(benchmark::State& bench) {
  const support::TemporaryFolder folder;
  const std::string path = folder / "ball.json";
  std::string json;
  if (!google::protobuf::util::MessageToJsonString(ball_scene(), &json).ok()) return bench.SkipWithError("no JSON");
  std::ofstream(path) << json;
  const auto scene = scene_io::to_physics(ball_scene());
  if (!scene.ok()) return bench.SkipWithError(scene.status().message().c_str());
  std::vector<double> straight;
  std::vector<double> python;
  for ([[maybe_unused]] auto _ : bench) {
    straight.push_back(straight_ticks_a_second(*scene));
    python.push_back(python_figure({"worlds", path, std::to_string(fleet_worlds), std::to_string(fleet_ticks)}));
  }
  bench.counters["straight_per_s"] = median(straight);
  bench.counters["python_per_s"] = median(python);
  bench.counters["ratio"] = median(python) / median(straight);
}
BENCHMARK(python_worlds)->Iterations(python_turns)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool worlds_listed =
    expect({"python_worlds/", "ratio", Bound::at_least, 0.9,
            "1,024 worlds of a ball of 162 vertices, 8 substeps: Python over C++"});

/// In free flight: Bullet's ball has no world.
void python_worlds_beside_bullet(benchmark::State& bench) {
  constexpr double substeps = 8.0;
  const support::TemporaryFolder folder;
  const std::string path = folder / "flight.json";
  v1::Scene flight = ball_scene();
  flight.clear_colliders();
  std::string json;
  if (!google::protobuf::util::MessageToJsonString(flight, &json).ok()) return bench.SkipWithError("no JSON");
  std::ofstream(path) << json;
  const auto mesh = *physics::make_icosphere(2, 0.5);
  const auto vertices = static_cast<double>(mesh->positions_m.size());
  const BallCase ball;
  std::vector<BulletBall> peers;
  for (std::size_t i = 0; i < fleet_worlds; ++i) peers.emplace_back(*mesh, ball);
  physics::Workers threads(std::max(1U, std::thread::hardware_concurrency()));
  std::vector<double> bullet;
  std::vector<double> python;
  for ([[maybe_unused]] auto _ : bench) {
    const auto start = Clock::now();
    for (int tick = 0; tick < fleet_ticks; ++tick)
      threads.for_each(fleet_worlds, [&](std::size_t i) { peers[i].step(); });
    const double passes = static_cast<double>(fleet_worlds) * fleet_ticks * BulletSettings{}.iterations;
    bullet.push_back(passes * vertices / seconds_since(start));
    const double ticks = python_figure({"worlds", path, std::to_string(fleet_worlds), std::to_string(fleet_ticks)});
    python.push_back(ticks * substeps * vertices);
  }
  bench.counters["bullet_per_s"] = median(bullet);
  bench.counters["python_per_s"] = median(python);
  bench.counters["ratio"] = median(python) / median(bullet);
}
BENCHMARK(python_worlds_beside_bullet)->Iterations(python_turns)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool beside_bullet_listed =
    expect({"python_worlds_beside_bullet/", "ratio", Bound::at_least, 10.0,
            "the same in flight: vertex substeps a second over btSoftBody's vertex passes, from C++"});

/// A server of Python's own, asked for one tick of five balls at a time.
void python_steps(benchmark::State& bench) {
  std::vector<double> on_top_ms;
  for ([[maybe_unused]] auto _ : bench) on_top_ms.push_back(python_figure({"steps", PNEUMA_SERVER_PROGRAM}));
  bench.counters["on_top_ms"] = median(on_top_ms);
}
BENCHMARK(python_steps)->Iterations(python_turns)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool steps_listed =
    expect({"python_steps/", "on_top_ms", Bound::at_most, 0.4,
            "five-balls: ms to step and observe over loopback, over the time of the step"});

/// A ball of 10,242 vertices.
v1::Scene large_ball_scene() {
  v1::Scene scene = *scene_io::load_scene("bouncing-ball");
  scene.mutable_meshes(0)->mutable_icosphere()->set_subdivisions(5);
  return scene;
}

double straight_ms_a_frame(const std::string& path) {
  auto reader = client::RecordingReader::open(path);
  if (!reader.ok()) return 0.0;
  std::vector<v1::ServerMessage> messages;
  for (auto record = reader->next(); record.ok() && *record; record = reader->next()) {
    messages.push_back(std::move((*record)->message));
  }
  client::StreamDecoder decoder;
  int frames = 0;
  const auto start = Clock::now();
  bool sound = decoder.add_stream(reader->header().stream()).ok();
  for (const v1::ServerMessage& message : messages) {
    if (message.has_topology()) sound &= decoder.take_topology(message.topology()).ok();
    if (message.has_layout()) sound &= decoder.take_layout(message.layout()).ok();
    if (!message.has_frame()) continue;
    sound &= decoder.take_frame(message.frame(), 0).ok();
    ++frames;
  }
  return sound ? 1e3 * seconds_since(start) / frames : 0.0;
}

void python_frames(benchmark::State& bench) {
  const support::TemporaryFolder folder;
  const std::string path = folder / "large.pneuma";
  if (const base::Status recorded = record_ticks(large_ball_scene(), 200, path); !recorded.ok()) {
    return bench.SkipWithError(recorded.message().c_str());
  }
  std::vector<double> straight;
  std::vector<double> python;
  for ([[maybe_unused]] auto _ : bench) {
    straight.push_back(straight_ms_a_frame(path));
    python.push_back(python_figure({"frames", path}));
  }
  bench.counters["straight_ms"] = median(straight);
  bench.counters["python_ms"] = median(python);
  bench.counters["ratio"] = median(python) / median(straight);
}
BENCHMARK(python_frames)->Iterations(python_turns)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool frames_listed =
    expect({"python_frames/", "ratio", Bound::at_most, 1.5, "frames of 10,242 vertices decoded: Python over C++"});

}  // namespace

}  // namespace pneuma::bench
