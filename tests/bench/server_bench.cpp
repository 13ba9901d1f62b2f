// The served whole, from outside: a real server on loopback, real clients.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "bench/watching.h"
#include "pneuma_client/client.h"
#include "support/server_process.h"
#include "support/temporary_folder.h"

namespace pneuma::bench {

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::duration;
using std::chrono::milliseconds;
using std::chrono::seconds;

// A ball at rest in empty space: nothing changes in its frames until it is hit.
constexpr const char* resting_ball = R"({
  "name": "resting-ball",
  "stepping": {"rate_hz": 60, "substeps": 8},
  "meshes": [{"name": "ball", "icosphere": {"subdivisions": 2}}],
  "soft_bodies": [{"name": "ball", "mesh": "ball", "springs": {"stiffness_n_m": 100, "damping_n_s_m": 0.1}}]
})";

// Hits the resting ball and waits for the first frame that shows it off its place. Milliseconds, or an error's text.
base::Result<double> hit_and_see(client::Client& client, std::mt19937& random) {
  if (auto reset = client.reset("resting-ball"); !reset.ok()) return reset.status();
  double x_at_rest = 0.0;
  // Let the reset's frame pass, then hit at any phase of the tick.
  const auto settled = Clock::now() + milliseconds(std::uniform_int_distribution<int>(60, 90)(random));
  while (Clock::now() < settled) {
    auto frame = client.next_frame(std::chrono::duration_cast<milliseconds>(settled - Clock::now()) + milliseconds(1));
    if (!frame.ok()) return frame.status();
    if (*frame) x_at_rest = (*frame)->bodies.at(0).positions_m.at(0);
  }
  v1::Impulse impulse;
  impulse.set_world("resting-ball");
  impulse.set_body("ball");
  impulse.mutable_impulse()->set_x(1.0);
  const auto sent = Clock::now();
  if (auto done = client.impulse(impulse); !done.ok()) return done.status();
  while (Clock::now() - sent < seconds(5)) {
    auto frame = client.next_frame(seconds(1));
    if (!frame.ok()) return frame.status();
    if (*frame && std::abs((*frame)->bodies.at(0).positions_m.at(0) - x_at_rest) > 1e-3) {
      return duration<double, std::milli>(Clock::now() - sent).count();
    }
  }
  return base::Status(base::StatusCode::internal, "no frame shows the impulse within 5 s");
}

void impulse_to_frame(benchmark::State& bench) {
  constexpr int hits = 100;
  for ([[maybe_unused]] auto _ : bench) {
    auto server = support::ServerProcess::start();
    if (!server.ok()) return bench.SkipWithError(server.status().message().c_str());
    auto client = client::Client::connect(server->tcp_address());
    if (!client.ok()) return bench.SkipWithError(client.status().message().c_str());
    v1::CreateWorld create;
    create.set_scene_json(resting_ball);
    if (auto done = client->create_world(create); !done.ok())
      return bench.SkipWithError(done.status().message().c_str());
    if (auto stream = client->subscribe("resting-ball", {.max_error_m = 1e-4}); !stream.ok()) {
      return bench.SkipWithError(stream.status().message().c_str());
    }
    std::mt19937 random(1);
    std::vector<double> latencies_ms;
    for (int hit = 0; hit < hits; ++hit) {
      auto latency_ms = hit_and_see(*client, random);
      if (!latency_ms.ok()) return bench.SkipWithError(latency_ms.status().message().c_str());
      latencies_ms.push_back(*latency_ms);
    }
    bench.counters["median_ms"] = percentile(latencies_ms, 0.5);
    bench.counters["p99_ms"] = percentile(latencies_ms, 0.99);
  }
}
BENCHMARK(impulse_to_frame)->Iterations(1)->Unit(benchmark::kMillisecond)->UseRealTime();

[[maybe_unused]] const bool latency_listed = expect(
    {"impulse_to_frame/", "median_ms", Bound::at_most, 25.0, "impulse sent to first frame that shows it, median ms"});

// What --sync costs: a client that hits a kept, paused ball as fast as it is answered.
void sync_cost(benchmark::State& bench, const char* sync) {
  constexpr int hits = 500;
  for ([[maybe_unused]] auto _ : bench) {
    const support::TemporaryFolder folder;
    auto server = support::ServerProcess::start(
        {"--data-dir", folder.path(), "--sync", sync, "--commands-per-s", "1e6", "--commands-burst", "1e6"});
    if (!server.ok()) return bench.SkipWithError(server.status().message().c_str());
    auto client = client::Client::connect(server->tcp_address());
    if (!client.ok()) return bench.SkipWithError(client.status().message().c_str());
    v1::CreateWorld create;
    create.set_scene_json(resting_ball);
    create.set_paused(true);
    if (auto done = client->create_world(create); !done.ok())
      return bench.SkipWithError(done.status().message().c_str());
    v1::Impulse impulse;
    impulse.set_world("resting-ball");
    impulse.set_body("ball");
    impulse.mutable_impulse()->set_x(1e-3);
    std::vector<double> times_ms;
    for (int hit = 0; hit < hits; ++hit) {
      const auto sent = Clock::now();
      if (auto done = client->impulse(impulse); !done.ok()) return bench.SkipWithError(done.status().message().c_str());
      times_ms.push_back(duration<double, std::milli>(Clock::now() - sent).count());
    }
    bench.counters["median_ms"] = percentile(times_ms, 0.5);
    bench.counters["p99_ms"] = percentile(times_ms, 0.99);
  }
}
BENCHMARK_CAPTURE(sync_cost, request, "request")->Iterations(1)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(sync_cost, second, "second")->Iterations(1)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(sync_cost, os, "os")->Iterations(1)->Unit(benchmark::kMillisecond)->UseRealTime();

constexpr int world_count = 20;
constexpr seconds run_time{60};
constexpr seconds warm_up{10};

std::string world_name(int index) {
  return std::string("w").append(std::to_string(index));
}

struct Arrival {
  std::uint64_t tick = 0;
  double time_ms = 0.0;
};

// One client's whole session: every frame's arrival, until the run ends.
base::Result<std::vector<Arrival>> read_frames(const std::string& address, const std::string& world,
                                               Clock::time_point start) {
  auto client = client::Client::connect(address);
  if (!client.ok()) return client.status();
  if (auto stream = client->subscribe(world); !stream.ok()) return stream.status();
  std::vector<Arrival> arrivals;
  while (Clock::now() - start < run_time) {
    auto frame = client->next_frame(milliseconds(500));
    if (!frame.ok()) return frame.status();
    if (*frame) arrivals.push_back({(*frame)->tick, duration<double, std::milli>(Clock::now() - start).count()});
  }
  return arrivals;
}

// How late each frame is against a clock that ticks at the world's rate from the promptest frame on.
void add_lateness_ms(const std::vector<Arrival>& arrivals, std::vector<double>& lateness_ms) {
  constexpr double period_ms = 1000.0 / 60.0;
  double promptest = INFINITY;
  for (const Arrival& arrival : arrivals)
    promptest = std::min(promptest, arrival.time_ms - static_cast<double>(arrival.tick) * period_ms);
  for (const Arrival& arrival : arrivals) {
    lateness_ms.push_back(arrival.time_ms - static_cast<double>(arrival.tick) * period_ms - promptest);
  }
}

// The control: how late a thread wakes that does nothing but sleep to the next 60th of a second beside all this.
std::vector<double> bare_wake_ups_ms(Clock::time_point start) {
  std::vector<double> lateness_ms;
  for (std::uint64_t tick = 1; Clock::now() - start < run_time; ++tick) {
    const auto due =
        start + std::chrono::duration_cast<Clock::duration>(duration<double>(static_cast<double>(tick) / 60.0));
    std::this_thread::sleep_until(due);
    lateness_ms.push_back(duration<double, std::milli>(Clock::now() - due).count());
  }
  return lateness_ms;
}

void twenty_worlds(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    auto server = support::ServerProcess::start();
    if (!server.ok()) return bench.SkipWithError(server.status().message().c_str());
    auto control = client::Client::connect(server->tcp_address());
    if (!control.ok()) return bench.SkipWithError(control.status().message().c_str());
    for (int i = 0; i < world_count; ++i) {
      auto done = control->create_builtin("five-balls", world_name(i));
      if (!done.ok()) return bench.SkipWithError(done.status().message().c_str());
    }
    std::mutex mutex;
    std::string failure;
    std::vector<double> lateness_ms;
    const auto start = Clock::now();
    std::vector<std::jthread> readers;
    for (int i = 0; i < world_count; ++i) {
      readers.emplace_back([&, i] {
        auto arrivals = read_frames(server->tcp_address(), world_name(i), start);
        const std::scoped_lock lock(mutex);
        if (!arrivals.ok()) {
          failure = arrivals.status().message();
        } else {
          add_lateness_ms(*arrivals, lateness_ms);
        }
      });
    }
    std::vector<double> bare_ms;
    std::jthread bare([&] { bare_ms = bare_wake_ups_ms(start); });
    std::this_thread::sleep_until(start + warm_up);
    const double resident_after_warm_up = resident_mib(server->pid());
    double resident_most = resident_after_warm_up;
    while (Clock::now() - start < run_time) {
      std::this_thread::sleep_for(seconds(1));
      resident_most = std::max(resident_most, resident_mib(server->pid()));
      if (auto alive = control->ping(); !alive.ok()) return bench.SkipWithError(alive.status().message().c_str());
    }
    readers.clear();
    bare.join();
    if (!failure.empty()) return bench.SkipWithError(failure.c_str());

    double slowest_ratio = INFINITY;
    double slipped_s = 0.0;
    double tick_late_ms = 0.0;
    for (int i = 0; i < world_count; ++i) {
      auto stats = control->stats(world_name(i));
      if (!stats.ok()) return bench.SkipWithError(stats.status().message().c_str());
      slowest_ratio = std::min(slowest_ratio, stats->time_ratio());
      slipped_s += stats->slipped_s();
      tick_late_ms = std::max(tick_late_ms, stats->due_error_ms_p99());
    }
    bench.counters["frames"] = static_cast<double>(lateness_ms.size());
    bench.counters["within_5ms_percent"] = 100.0 * share_within(lateness_ms, 5.0);
    bench.counters["bare_thread_percent"] = 100.0 * share_within(bare_ms, 5.0);
    bench.counters["p50_late_ms"] = percentile(lateness_ms, 0.5);
    bench.counters["p99_late_ms"] = percentile(lateness_ms, 0.99);
    bench.counters["tick_p99_late_ms"] = tick_late_ms;
    bench.counters["slowest_time_ratio"] = slowest_ratio;
    bench.counters["slipped_s"] = slipped_s;
    bench.counters["resident_mib"] = resident_most;
    bench.counters["growth_mib"] = resident_most - resident_after_warm_up;
  }
}
BENCHMARK(twenty_worlds)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

[[maybe_unused]] const bool twenty_listed =
    expect({"twenty_worlds/", "within_5ms_percent", Bound::at_least, 99.0,
            "20 worlds, 20 clients, 60 s: % of frames within 5 ms of due"}) &&
    expect({"twenty_worlds/", "slowest_time_ratio", Bound::at_least, 0.99,
            "20 worlds: simulated over real time of the slowest"}) &&
    expect({"twenty_worlds/", "slipped_s", Bound::at_most, 0.0, "20 worlds: real time fallen behind in all, s"}) &&
    expect({"twenty_worlds/", "growth_mib", Bound::at_most, 1.0,
            "20 worlds: resident memory gained after the first 10 s, MiB"});

constexpr std::size_t crowd_size = 500;

void five_hundred_clients(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    auto alone = watch_five_balls(0, false, seconds(5));
    if (!alone.ok()) return bench.SkipWithError(alone.status().message().c_str());
    auto run = watch_five_balls(crowd_size - 1, false, seconds(12));
    if (!run.ok()) return bench.SkipWithError(run.status().message().c_str());
    bench.counters["encode_us_of_1"] = alone->encode_us;
    bench.counters["encode_us"] = run->encode_us;
    bench.counters["encode_ratio"] = run->encode_us / alone->encode_us;
    bench.counters["frames"] = static_cast<double>(run->ages_ms.size());
    bench.counters["p50_age_ms"] = percentile(run->ages_ms, 0.5);
    bench.counters["p99_age_ms"] = percentile(run->ages_ms, 0.99);
    bench.counters["tick_p99_late_ms"] = run->tick_late_ms;
    bench.counters["slipped_s"] = run->slipped_s;
  }
}
BENCHMARK(five_hundred_clients)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

// In turns, so that what else the machine does falls on both alike.
void two_slow_of_a_hundred(benchmark::State& bench) {
  constexpr int turns = 11;
  for ([[maybe_unused]] auto _ : bench) {
    std::vector<double> alone_ms;
    std::vector<double> beside_ms;
    for (int turn = 0; turn < turns; ++turn) {
      for (const bool slow : {false, true}) {
        auto run = watch_five_balls(97, slow, seconds(5));
        if (!run.ok()) return bench.SkipWithError(run.status().message().c_str());
        (slow ? beside_ms : alone_ms).push_back(percentile(run->ages_ms, 0.99));
      }
    }
    bench.counters["alone_p99_age_ms"] = percentile(alone_ms, 0.5);
    bench.counters["beside_p99_age_ms"] = percentile(beside_ms, 0.5);
    bench.counters["p99_ratio"] = percentile(beside_ms, 0.5) / percentile(alone_ms, 0.5);
  }
}
BENCHMARK(two_slow_of_a_hundred)->Iterations(1)->Unit(benchmark::kSecond)->UseRealTime();

[[maybe_unused]] const bool crowd_listed =
    expect({"five_hundred_clients/", "p99_age_ms", Bound::at_most, 20.0,
            "500 clients at 30 Hz, server on one core: p99 age of a frame, ms"}) &&
    expect({"five_hundred_clients/", "encode_ratio", Bound::at_most, 1.2,
            "500 clients: time to encode a frame, over that for 1 client"}) &&
    expect({"two_slow_of_a_hundred/", "p99_ratio", Bound::at_most, 1.1,
            "98 clients' p99 age beside two that hardly read, over without"});

}  // namespace

}  // namespace pneuma::bench
