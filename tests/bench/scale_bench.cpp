// How many worlds and readers two cores carry, what a world takes, and what large and stiff bodies cost.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "bench/watching.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"
#include "pneuma_client/client.h"
#include "support/server_process.h"
#include "support/temporary_folder.h"

namespace pneuma::bench {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::duration;
using std::chrono::seconds;

// The most for which `holds`, of 1 and what it is asked up to, to a sixteenth; 0 where there is none. It asks twice
// before it says no: other programs may have been busy.
template <class Holds>
std::size_t most_that(std::size_t up_to, const Holds& holds) {
  const auto holds_at_last = [&](std::size_t count) { return holds(count) || holds(count); };
  std::size_t held = 0;
  std::size_t missed = up_to + 1;
  for (std::size_t count = std::max<std::size_t>(1, up_to / 16); count < missed; count = std::min(2 * count, up_to)) {
    if (holds_at_last(count)) {
      held = count;
      if (count == up_to) return held;
    } else {
      missed = count;
    }
  }
  while (missed - held > std::max<std::size_t>(1, held / 16)) {
    const std::size_t middle = held + (missed - held) / 2;
    (holds_at_last(middle) ? held : missed) = middle;
  }
  return held;
}

void worlds_on_time(benchmark::State& bench) {
  constexpr seconds watched{8};
  std::string failure;  // the last one: too many worlds are no error
  for ([[maybe_unused]] auto _ : bench) {
    const auto are_on_time = [&](std::size_t worlds) {
      const auto late_ms = watch_worlds_late_ms(worlds, watched);
      if (!late_ms.ok()) failure = late_ms.status().message();
      // What does not come is late too.
      const double due = 60.0 * duration<double>(watched).count() * static_cast<double>(worlds);
      return late_ms.ok() && count_within(*late_ms, 5.0) >= 0.99 * due;
    };
    const std::size_t most = most_that(256, are_on_time);
    if (most == 0 && !failure.empty()) return bench.SkipWithError(failure.c_str());
    bench.counters["worlds"] = static_cast<double>(most);
  }
}
BENCHMARK(worlds_on_time)->Name("scale/worlds")->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

void readers_on_time(benchmark::State& bench) {
  constexpr seconds watched{6};
  std::string failure;
  for ([[maybe_unused]] auto _ : bench) {
    const auto are_on_time = [&](std::size_t readers) {
      const auto run = watch_five_balls(readers, false, watched);
      if (!run.ok()) failure = run.status().message();
      const double due = 30.0 * duration<double>(watched).count() * static_cast<double>(readers);
      return run.ok() && count_within(run->ages_ms, 20.0) >= 0.99 * due;
    };
    const std::size_t most = most_that(2'000, are_on_time);
    if (most == 0 && !failure.empty()) return bench.SkipWithError(failure.c_str());
    bench.counters["readers"] = static_cast<double>(most);
  }
}
BENCHMARK(readers_on_time)->Name("scale/readers")->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

// Nothing happens in it, but it does not sleep: a tick is one substep of twelve vertices.
constexpr const char* small_world = R"({
  "name": "small",
  "gravity": {"y": 0},
  "stepping": {"rate_hz": 60, "substeps": 1, "integrator": "SYMPLECTIC_EULER", "sleep": false},
  "meshes": [{"name": "ball", "icosphere": {"subdivisions": 0}}],
  "soft_bodies": [{"name": "ball", "mesh": "ball", "springs": {"stiffness_n_m": 10, "damping_n_s_m": 0.1}}]
})";

// What a tick takes of a processor, and what of it is not the step.
void tick_cost(benchmark::State& bench) {
  constexpr int worlds = 500;
  constexpr seconds watched{10};
  for ([[maybe_unused]] auto _ : bench) {
    auto server = support::ServerProcess::start({"--log-level", "warn"});
    if (!server.ok()) return bench.SkipWithError(server.status().message().c_str());
    auto control = client::Client::connect(server->tcp_address());
    if (!control.ok()) return bench.SkipWithError(control.status().message().c_str());
    v1::CreateWorld create;
    create.set_scene_json(small_world);
    for (int i = 0; i < worlds; ++i) {
      create.set_name(std::to_string(i));
      if (auto done = control->create_world(create); !done.ok()) {
        return bench.SkipWithError(done.status().message().c_str());
      }
    }
    const auto ticks = [&]() -> double {
      const auto list = control->list_worlds();
      if (!list.ok()) return 0.0;
      double sum = 0.0;
      for (const v1::WorldList::World& world : list->worlds()) sum += static_cast<double>(world.tick());
      return sum;
    };
    const double ticks_before = ticks();
    const double s_before = processor_s(server->pid());
    std::this_thread::sleep_for(watched);
    const double ticked = ticks() - ticks_before;
    if (!(ticked > 0.0)) return bench.SkipWithError("the worlds do not tick");
    const double tick_us = 1e6 * (processor_s(server->pid()) - s_before) / ticked;
    bench.counters["us"] = tick_us;
    bench.counters["of_real_time"] = ticked / (60.0 * worlds * duration<double>(watched).count());
    const auto stats = control->stats("0");
    if (!stats.ok()) return bench.SkipWithError(stats.status().message().c_str());
    bench.counters["beside_step_us"] = tick_us - 1e3 * stats->step_time_ms();
  }
}
BENCHMARK(tick_cost)->Name("scale/tick")->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

constexpr int kept_worlds = 100;

base::Status create_five_balls(client::Client& control, int worlds) {
  for (int i = 0; i < worlds; ++i) {
    auto done = control.create_builtin("five-balls", std::string("w").append(std::to_string(i)));
    if (!done.ok()) return done.status();
  }
  return {};
}

void world_memory(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    auto server = support::ServerProcess::start({"--log-level", "warn"});
    if (!server.ok()) return bench.SkipWithError(server.status().message().c_str());
    auto control = client::Client::connect(server->tcp_address());
    if (!control.ok()) return bench.SkipWithError(control.status().message().c_str());
    // The first has what all of them share.
    if (auto done = control->create_builtin("five-balls", "first"); !done.ok()) {
      return bench.SkipWithError(done.status().message().c_str());
    }
    std::this_thread::sleep_for(seconds(2));
    const double before_mib = resident_mib(server->pid());
    if (auto done = create_five_balls(*control, kept_worlds); !done.ok()) {
      return bench.SkipWithError(done.message().c_str());
    }
    std::this_thread::sleep_for(seconds(10));
    bench.counters["kib"] = 1024.0 * (resident_mib(server->pid()) - before_mib) / kept_worlds;
  }
}
BENCHMARK(world_memory)->Name("scale/memory")->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

void restart(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    const support::TemporaryFolder folder;
    const std::vector<std::string> flags{"--log-level", "warn", "--data-dir", folder.path()};
    {
      auto server = support::ServerProcess::start(flags);
      if (!server.ok()) return bench.SkipWithError(server.status().message().c_str());
      auto control = client::Client::connect(server->tcp_address());
      if (!control.ok()) return bench.SkipWithError(control.status().message().c_str());
      if (auto done = create_five_balls(*control, kept_worlds); !done.ok()) {
        return bench.SkipWithError(done.message().c_str());
      }
      if (auto ended = server->stop(); !ended.ok()) return bench.SkipWithError(ended.status().message().c_str());
    }
    const auto start = Clock::now();
    auto server = support::ServerProcess::start(flags);
    if (!server.ok()) return bench.SkipWithError(server.status().message().c_str());
    bench.counters["s"] = duration<double>(Clock::now() - start).count();
  }
}
BENCHMARK(restart)->Name("scale/restart")->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

// A ball as a cube's grid: no vertex has more than six neighbours.
std::shared_ptr<const physics::Mesh> large_ball() {
  const auto box = *physics::make_box(physics::Vec3d::Constant(1.0), 66);
  std::vector<physics::Vec3d> positions_m = box->positions_m;
  for (physics::Vec3d& position_m : positions_m) position_m.normalize();
  return *physics::make_mesh(std::move(positions_m), box->faces);
}

// Processor seconds a simulated second, by AUTO.
double large_ball_s(bool on_floor) {
  physics::Scene scene;
  scene.stepping.integrator = physics::Integrator::automatic;
  scene.stepping.precision = physics::Precision::single_precision;
  physics::SoftBody body;
  body.name = "ball";
  body.mesh = large_ball();
  body.position = {0.0, on_floor ? 1.0 : 1000.0, 0.0};
  body.springs = {.stiffness_n_m = 100.0, .damping_n_s_m = 0.0};
  body.gas = physics::Gas{.moles = 5.0 / (physics::gas_constant_j_mol_k * 293.15)};
  scene.soft_bodies.push_back(body);
  if (on_floor) {
    scene.colliders.emplace_back();
    scene.colliders.back().name = "floor";
    scene.colliders.back().shape = physics::PlaneShape{};
  }
  auto world = physics::World::create(std::move(scene));
  if (!world.ok()) std::abort();
  physics::Workers workers(1);
  world->step_tick(workers);
  constexpr int frames = 30;
  const std::clock_t start = std::clock();
  for (int frame = 0; frame < frames; ++frame) world->step_tick(workers);
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC * 60.0 / frames;
}

void large_body(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    bench.counters["flight_s"] = large_ball_s(false);
    bench.counters["floor_s"] = large_ball_s(true);
  }
}
BENCHMARK(large_body)->Name("scale/large_body")->Iterations(1)->Unit(benchmark::kSecond);

[[maybe_unused]] const bool scale_listed =
    expect({"scale/worlds/", "worlds", Bound::at_least, 250.0,
            "worlds of five balls, one reader each, 99 % within 5 ms"}) &&
    expect({"scale/readers/", "readers", Bound::at_least, 2'000.0,
            "readers of a world at 30 Hz, server on one core, p99 in 20 ms"}) &&
    expect({"scale/tick/", "beside_step_us", Bound::at_most, 10.0,
            "500 small worlds: us of a processor a tick, without the step"}) &&
    expect({"scale/memory/", "kib", Bound::at_most, 400.0, "memory of a world of five balls, KiB"}) &&
    expect({"scale/restart/", "s", Bound::at_most, 2.0, "restart of 100 worlds, s"}) &&
    expect({"scale/large_body/", "flight_s", Bound::at_most, 0.8,
            "26,138 vertices in free flight: processor s a simulated s"}) &&
    expect({"scale/large_body/", "floor_s", Bound::at_most, 1.0, "the same on a floor"});

}  // namespace

}  // namespace pneuma::bench
