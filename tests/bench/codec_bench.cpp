// What frames cost: bits a vertex of recorded built-in scenes at 60 Hz with all that a frame takes on the wire, beside
// peers on the same motion at the same bound, and the time to write and read them; and the same of streams that are
// predicted by their bodies' mechanics, where these are told.
#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "app/mechanics.h"
#include "bench/figures.h"
#include "bench/frame_costs.h"
#include "codec/frame_codec.h"
#include "support/recording.h"

namespace pneuma::bench {

namespace {

using support::Recording;

constexpr std::size_t ticks = 300;

struct Case {
  const char* scene;
  std::vector<std::string> assignments;
  double max_error_m;
};

/// One a body.
std::vector<std::optional<codec::Mechanics>> mechanics_of(const physics::World& world, double max_error_m) {
  app::MechanicsTerms terms{.frame_s = world.tick_period_s(),
                            .grid_step_m = codec::grid_step_m(max_error_m),
                            .work_left = app::offered_work_max};
  std::vector<std::optional<codec::Mechanics>> all;
  for (std::size_t body = 0; body < world.soft_body_count(); ++body) {
    const auto order = support::order_of(*world.soft_body(body).mesh);
    all.push_back(app::mechanics_of(world, body, *order, terms));
  }
  return all;
}

void frames(benchmark::State& bench, const Case& chosen) {
  physics::World world = support::world_of(chosen.scene, chosen.assignments);
  const auto mechanics = mechanics_of(world, chosen.max_error_m);
  const Recording recording = support::record(std::move(world), ticks);
  FrameCost cost;
  for ([[maybe_unused]] auto _ : bench) cost = frame_cost(recording, chosen.max_error_m);
  const PeerBits peers = peer_bits(recording, chosen.max_error_m);
  bench.counters["bits"] = cost.bits;
  bench.counters["zstd_bits"] = peers.zstd;
  bench.counters["meshoptimizer_bits"] = peers.meshoptimizer;
  bench.counters["draco_bits"] = peers.draco;
  bench.counters["over_best_peer"] = cost.bits / peers.least();
  bench.counters["write_ns"] = cost.write_ns;
  bench.counters["read_ns"] = cost.read_ns;
  if (std::ranges::none_of(mechanics, [](const auto& own) { return own.has_value(); })) return;
  const FrameCost simulated = frame_cost(recording, chosen.max_error_m, mechanics);
  bench.counters["simulated_bits"] = simulated.bits;
  bench.counters["simulated_write_ns"] = simulated.write_ns;
  bench.counters["simulated_read_ns"] = simulated.read_ns;
}

void resting_body(benchmark::State& bench) {
  Recording recording = support::record(support::world_of("bouncing-ball"), 1);
  for (std::size_t tick = 2; tick < ticks; ++tick) recording.frames_m.push_back(recording.frames_m.back());
  codec::FrameWriter writer(recording.orders, 1e-3);
  writer.place_body(0, recording.frames_m[0][0]);
  std::size_t most = 0;
  for ([[maybe_unused]] auto _ : bench) {
    for (std::size_t tick = 2; tick < recording.frames_m.size(); ++tick) {
      writer.begin_delta();
      writer.move_body(0, recording.frames_m[tick][0]);
      std::string payload;
      writer.take_delta(payload);
      if (tick > 2) most = std::max(most, payload.size());
    }
  }
  bench.counters["bytes"] = static_cast<double>(most);
}

// Half a millimetre of a ball of 2 m, and a fifth of that: on a ball of that size, and as large a share of the built-in
// one, which is 1 m across and bounces faster for its size. Of the hand, 0.1 %.
const std::vector<std::string> ball_of_2_m{"meshes[0].icosphere.radius_m=1"};
const std::vector<std::string> ball_of_2562{"meshes[0].icosphere.subdivisions=4", "stepping.substeps=0"};
BENCHMARK_CAPTURE(frames, ball_162_coarse, Case{"bouncing-ball", {}, 0.25e-3})
    ->Name("codec/ball_162_coarse")
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, ball_162_fine, Case{"bouncing-ball", {}, 0.05e-3})
    ->Name("codec/ball_162_fine")
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, ball_162_2m_coarse, Case{"bouncing-ball", ball_of_2_m, 0.5e-3})
    ->Name("codec/ball_162_2m_coarse")
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, ball_162_2m_fine, Case{"bouncing-ball", ball_of_2_m, 0.1e-3})
    ->Name("codec/ball_162_2m_fine")
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, ball_2562, Case{"bouncing-ball", ball_of_2562, 0.1e-3})
    ->Name("codec/ball_2562")
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, hand, Case{"hand", {}, 0.2e-3})
    ->Name("codec/hand")
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(frames, five_balls, Case{"five-balls", {}, 0.5e-3})
    ->Name("codec/five_balls")
    ->Iterations(3)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(resting_body)->Name("codec_resting_body");

bool expect_simulated(const std::string& name, const std::string& meaning, double bits) {
  return expect(
      {"codec/" + name + "/", "simulated_bits", Bound::at_most, bits, meaning + ", simulated: bits a vertex a frame"});
}
bool expect_case(const std::string& name, const std::string& meaning, double bits) {
  const std::string benchmark = "codec/" + name + "/";
  if (bits > 0.0) expect({benchmark, "bits", Bound::at_most, bits, meaning + ": bits a vertex a frame"});
  return expect({benchmark, "over_best_peer", Bound::at_most, 0.65, meaning + ": over the best peer's"}) &&
         expect({benchmark, "write_ns", Bound::at_most, 15.0, meaning + ": written, ns a vertex"}) &&
         expect({benchmark, "read_ns", Bound::at_most, 10.0, meaning + ": read, ns a vertex"});
}
[[maybe_unused]] const bool codec_listed =
    expect_case("ball_162_coarse", "ball of 162, 0.25 mm of 1 m", 9.5) &&
    expect_case("ball_162_fine", "ball of 162, 0.05 mm of 1 m", 14.0) &&
    expect_case("ball_162_2m_coarse", "ball of 162, 0.5 mm of 2 m", 9.5) &&
    expect_case("ball_162_2m_fine", "ball of 162, 0.1 mm of 2 m", 14.0) &&
    expect_case("ball_2562", "ball of 2,562, 0.1 mm of 1 m", 10.0) && expect_case("hand", "hand, 0.2 mm", 8.0) &&
    expect_case("five_balls", "five balls, 0.5 mm of 1 m", 0.0) &&
    expect_simulated("ball_162_coarse", "ball of 162, 0.25 mm of 1 m", 9.5) &&
    expect_simulated("ball_162_fine", "ball of 162, 0.05 mm of 1 m", 14.0) &&
    expect_simulated("ball_162_2m_coarse", "ball of 162, 0.5 mm of 2 m", 9.5) &&
    expect_simulated("ball_162_2m_fine", "ball of 162, 0.1 mm of 2 m", 14.0) &&
    expect_simulated("ball_2562", "ball of 2,562, 0.1 mm of 1 m", 10.0) &&
    expect({"codec_resting_body/", "bytes", Bound::at_most, 2.0, "a resting body: bytes of its frame's payload"});

}  // namespace

}  // namespace pneuma::bench
