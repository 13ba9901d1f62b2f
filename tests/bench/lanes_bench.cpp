// An explicit substep in lanes against its peers, taking turns in one run: Bullet, a plain scalar kernel, and a program
// written by hand for just one scene. Springs with damping, exact volume, pressure, integration; no contact.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <functional>
#include <string>
#include <unordered_map>

#include <benchmark/benchmark.h>
#include <malloc.h>

#include "bench/figures.h"
#include "bench/median.h"
#include "bench/peers.h"
#include "physics/choice/step_plan.h"
#include "physics/forces/soft_setup.h"
#include "physics/lanes/isa.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::bench {

namespace {

using physics::Isa;

constexpr int rounds = 15;
constexpr std::uint32_t substeps = 64;
// Of contenders on several threads: in their turn before last the others slept, and take milliseconds to come.
constexpr double threads_turn_s = 0.04;

physics::World balls_world(const std::shared_ptr<const physics::Mesh>& mesh, std::size_t count,
                           physics::Precision precision = physics::Precision::single_precision) {
  physics::Scene scene = ball_scene(mesh, BallCase{}, count, substeps);
  scene.stepping.precision = precision;
  return std::move(*physics::World::create(std::move(scene)));
}

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}
double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Something to time: `run` does `count` vertex-substeps (or vertex-iterations).
struct Contender {
  std::function<void()> run;
  double count = 0.0;
};

/// Nanoseconds a count of each, the median of rounds in which they take turns of `turn_s`.
std::vector<double> race_ns(const std::vector<Contender>& contenders, double (*clock_s)(), double turn_s = 0.004) {
  std::vector<std::vector<double>> times(contenders.size());
  for (const Contender& contender : contenders) contender.run();
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t i = 0; i < contenders.size(); ++i) {
      const double start = clock_s();
      int runs = 0;
      do {
        contenders[i].run();
        ++runs;
      } while (clock_s() - start < turn_s);
      times[i].push_back((clock_s() - start) * 1e9 / (runs * contenders[i].count));
    }
  }
  std::vector<double> medians;
  for (const auto& all : times) medians.push_back(median(all));
  return medians;
}

/// `count` balls, a vertex a substep.
Contender ours(physics::World& world, physics::Workers& workers) {
  double vertices = 0.0;
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    vertices += static_cast<double>(world.soft_body(i).mesh->positions_m.size());
  }
  return {[&] { world.step_tick(workers); }, vertices * substeps};
}

// Args: balls, subdivisions, instruction set.
void substep_against_peers(benchmark::State& bench) {
  const auto count = static_cast<std::size_t>(bench.range(0));
  const auto isa = static_cast<Isa>(bench.range(2));
  if (!physics::has_isa(isa)) return bench.SkipWithError("this processor lacks the instruction set");
  const Isa before = physics::isa_in_use();
  (void)physics::use_isa(physics::isa_names[static_cast<std::size_t>(isa)]);
  const auto mesh = *physics::make_icosphere(static_cast<std::uint32_t>(bench.range(1)), 0.5);
  const double vertices = static_cast<double>(mesh->positions_m.size() * count);
  const BallCase ball;
  physics::World world = balls_world(mesh, count);
  std::vector<PlainBall> plain(count, PlainBall(*mesh, ball));
  std::vector<BulletBall> bullet;
  for (std::size_t i = 0; i < count; ++i) bullet.emplace_back(*mesh, ball);
  physics::Workers one(1);
  physics::Workers another(1);
  physics::Workers two(2);
  for ([[maybe_unused]] auto _ : bench) {
    const auto step_all = [](auto& balls) {
      return [&balls] {
        for (auto& each : balls) each.step();
      };
    };
    const std::vector<double> ns = race_ns(
        {ours(world, one), {step_all(plain), vertices}, {step_all(bullet), vertices * BulletSettings{}.iterations}},
        cpu_s);
    bench.counters["ns_per_vertex"] = ns[0];
    bench.counters["plain_ns"] = ns[1];
    bench.counters["bullet_ns"] = ns[2];
    bench.counters["over_plain"] = ns[1] / ns[0];
    bench.counters["over_bullet"] = ns[2] / ns[0];
    if (count == 1 && mesh->positions_m.size() > 10'000) {
      // What the machine allows just then: two worlds that share nothing.
      physics::World other = balls_world(mesh, count);
      const auto step_both = [&] {
        two.for_each(2, [&](std::size_t i) { (i == 0 ? world : other).step_tick(i == 0 ? one : another); });
      };
      const std::vector<double> wall_ns =
          race_ns({ours(world, one), ours(world, two), {step_both, 2.0 * vertices * substeps}}, wall_s, threads_turn_s);
      bench.counters["two_threads"] = wall_ns[0] / wall_ns[1];
      bench.counters["two_apart"] = wall_ns[0] / wall_ns[2];
    }
  }
  (void)physics::use_isa(physics::isa_names[static_cast<std::size_t>(before)]);
}
constexpr auto v3 = static_cast<std::int64_t>(Isa::v3);
constexpr auto v4 = static_cast<std::int64_t>(Isa::v4);
BENCHMARK(substep_against_peers)
    ->ArgNames({"balls", "subdivisions", "isa"})
    ->Args({32, 2, v3})
    ->Args({32, 2, v4})
    ->Args({1, 2, v3})
    ->Args({1, 2, v4})
    ->Args({1, 5, v3})
    ->Args({1, 5, v4})
    ->Iterations(1)
    ->Repetitions(3)
    ->Unit(benchmark::kMillisecond);

std::string against_peers(int balls, int subdivisions, Isa isa) {
  return std::string("substep_against_peers/balls:")
      .append(std::to_string(balls))
      .append("/subdivisions:")
      .append(std::to_string(subdivisions))
      .append("/isa:")
      .append(std::to_string(static_cast<int>(isa)));
}

[[maybe_unused]] const bool peers_listed = [] {
  struct Target {
    int balls;
    int subdivisions;
    double over_bullet;
    double over_plain;
    const char* name;
  };
  for (const Target& target :
       {Target{32, 2, 12.0, 8.0, "32 balls of 162 vertices"}, Target{1, 2, 3.5, 2.5, "one ball of 162 vertices"},
        Target{1, 5, 4.0, 2.5, "one mesh of 10,242 vertices"}}) {
    for (const Isa isa : {Isa::v3, Isa::v4}) {
      const std::string benchmark = against_peers(target.balls, target.subdivisions, isa);
      const std::string name =
          std::string(target.name).append(isa == Isa::v3 ? ", AVX2" : ", AVX-512").append(": substep faster than ");
      expect({benchmark, "over_bullet", Bound::at_least, target.over_bullet, name + "Bullet's iteration"});
      expect({benchmark, "over_plain", Bound::at_least, target.over_plain, name + "plain"});
      if (target.subdivisions == 5) {
        expect({benchmark, "two_threads", Bound::at_least, 1.7, name + "on one thread, by two"});
      }
    }
  }
  return true;
}();

/// Past the limit of a scene's meshes: each face in four, new vertices on the sphere.
std::shared_ptr<const physics::Mesh> large_sphere(std::uint32_t subdivisions) {
  const std::uint32_t made = std::min<std::uint32_t>(subdivisions, 6);
  const auto coarse = *physics::make_icosphere(made, 0.5);
  if (made == subdivisions) return coarse;
  auto mesh = std::make_shared<physics::Mesh>(*coarse);
  for (std::uint32_t i = made; i < subdivisions; ++i) {
    std::unordered_map<std::uint64_t, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const std::uint64_t edge = (std::uint64_t{std::min(a, b)} << 32U) | std::max(a, b);
      const auto [entry, is_new] = middles.try_emplace(edge, static_cast<std::uint32_t>(mesh->positions_m.size()));
      if (is_new) {
        mesh->positions_m.emplace_back((mesh->positions_m[a] + mesh->positions_m[b]).normalized() * 0.5);
      }
      return entry->second;
    };
    std::vector<physics::Face> faces;
    for (const auto& [a, b, c] : mesh->faces) {
      const std::uint32_t ab = middle(a, b);
      const std::uint32_t bc = middle(b, c);
      const std::uint32_t ca = middle(c, a);
      faces.insert(faces.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh->faces = std::move(faces);
  }
  mesh->face_counts.assign(mesh->positions_m.size(), 0);
  mesh->edges.clear();
  mesh->edge_lengths_m.clear();
  for (const auto& [a, b, c] : mesh->faces) {
    for (const std::uint32_t vertex : {a, b, c}) ++mesh->face_counts[vertex];
    for (const auto& [from, to] : {physics::Edge{a, b}, physics::Edge{b, c}, physics::Edge{c, a}}) {
      if (from < to) mesh->edges.push_back({from, to});
    }
  }
  std::ranges::sort(mesh->edges);
  for (const auto& [a, b] : mesh->edges) {
    mesh->edge_lengths_m.push_back((mesh->positions_m[b] - mesh->positions_m[a]).norm());
  }
  return mesh;
}

/// A body below the scene, stepped by as many substeps at a time as make the copying in and out not count.
struct LooseBall {
  explicit LooseBall(std::uint32_t subdivisions)
      : mesh(large_sphere(subdivisions)), state(physics::make_soft_state<float>(soft_ball(mesh, BallCase{}, 0))) {
    lanes.rings = physics::make_rings(*mesh);
    lanes.lengths_m = physics::ring_lengths_m<float>(*mesh, lanes.rings, kernels().slot_of_place);
    const BallCase ball;
    context.integrator = physics::Integrator::symplectic_euler;
    context.surroundings.gravity = {0.0, ball.gravity_m_s2, 0.0};
    context.dt_s = ball.dt_s / std::sqrt(static_cast<double>(state.x.size()) / 162.0);
  }
  static const physics::LaneKernels<float>& kernels() { return physics::lane_kernels<float>(physics::isa_in_use()); }
  void step(physics::Workers* workers = nullptr) {
    std::array<physics::SoftState<float>*, 1> bodies{&state};
    std::array<std::uint8_t, 1> done{};
    physics::step_freely<float>(bodies, {&lanes, &kernels()}, context.of_body(workers, nullptr), substeps, scratch,
                                done);
  }
  std::shared_ptr<const physics::Mesh> mesh;
  physics::SoftState<float> state;
  physics::LaneMesh<float> lanes;
  physics::SubstepContext context;
  physics::LaneScratch<float> scratch;
};

void substep_by_size(benchmark::State& bench) {
  std::vector<LooseBall> balls;
  std::vector<Contender> contenders;
  for (std::uint32_t subdivisions = 2; subdivisions <= 8; ++subdivisions) balls.emplace_back(subdivisions);
  for (LooseBall& ball : balls) {
    contenders.push_back({[&ball] { ball.step(); }, static_cast<double>(ball.state.x.size()) * substeps});
  }
  for ([[maybe_unused]] auto _ : bench) {
    const std::vector<double> ns = race_ns(contenders, cpu_s);
    for (std::size_t i = 0; i < balls.size(); ++i) {
      bench.counters[std::string("ns_").append(std::to_string(balls[i].state.x.size()))] = ns[i];
    }
    bench.counters["growth"] = ns.back() / ns.front();
    physics::Workers two(2);
    Contender by_two{[&] { balls.back().step(&two); }, contenders.back().count};
    const std::vector<double> wall_ns = race_ns({contenders.front(), by_two}, wall_s);
    bench.counters["growth_by_two"] = wall_ns[1] / wall_ns[0];
  }
}
BENCHMARK(substep_by_size)->Iterations(1)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool growth_listed =
    expect({"substep_by_size/", "growth", Bound::at_most, 1.5, "ns a vertex: 655,362 vertices over 162"}) &&
    expect({"substep_by_size/", "growth_by_two", Bound::at_most, 1.5, "the same, 655,362 by two threads, wall clock"});

// What a vertex costs in worlds of one ball each, and in one world of as many balls.
void worlds_apart(benchmark::State& bench) {
  constexpr std::size_t count = 32;
  const auto mesh = *physics::make_icosphere(2, 0.5);
  std::vector<physics::World> apart;
  for (std::size_t i = 0; i < count; ++i) apart.push_back(balls_world(mesh, 1));
  physics::World together = balls_world(mesh, count);
  physics::Workers one(1);
  const auto step_apart = [&] {
    for (physics::World& world : apart) world.step_tick(one);
  };
  for ([[maybe_unused]] auto _ : bench) {
    const std::vector<double> ns = race_ns({{step_apart, 162.0 * count * substeps}, ours(together, one)}, cpu_s);
    bench.counters["apart_ns"] = ns[0];
    bench.counters["together_ns"] = ns[1];
  }
}
BENCHMARK(worlds_apart)->Iterations(1)->Repetitions(3)->Unit(benchmark::kMillisecond);

void scene_against_hand_written(benchmark::State& bench) {
  const auto mesh = *physics::make_icosphere(2, 0.5);
  HandWrittenBall by_hand(*mesh, BallCase{});
  physics::World world = balls_world(mesh, 1);
  physics::Workers one(1);
  for ([[maybe_unused]] auto _ : bench) {
    by_hand.step(substeps);
    world.step_tick(one);
    bench.counters["same_bits"] = by_hand.is_where(world) ? 1.0 : 0.0;
    const std::vector<double> ns =
        race_ns({ours(world, one), {[&] { by_hand.step(substeps); }, 162.0 * substeps}}, cpu_s);
    bench.counters["over_by_hand"] = ns[0] / ns[1];
  }
}
BENCHMARK(scene_against_hand_written)->Iterations(1)->Repetitions(5)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool hand_listed =
    expect({"scene_against_hand_written/", "over_by_hand", Bound::at_most, 1.03, "a scene's step over hand-written"}) &&
    expect({"scene_against_hand_written/", "same_bits", Bound::at_least, 1.0, "the same bits as hand-written"});

double heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

// Args: precision. A world of one mesh of 10,242 vertices, that mesh and what a step leaves behind.
void memory(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    physics::Workers one(1);
    const double before = heap_bytes();
    physics::World world =
        balls_world(*physics::make_icosphere(5, 0.5), 1, static_cast<physics::Precision>(bench.range(0)));
    world.step_tick(one);
    bench.counters["bytes_per_vertex"] = (heap_bytes() - before) / 10'242.0;
  }
}
BENCHMARK(memory)->ArgName("double")->Arg(0)->Arg(1)->Iterations(1);

[[maybe_unused]] const bool memory_listed =
    expect({"memory/double:0", "bytes_per_vertex", Bound::at_most, 400.0, "bytes a vertex, single precision"}) &&
    expect({"memory/double:1", "bytes_per_vertex", Bound::at_most, 400.0, "bytes a vertex, double precision"});

}  // namespace

}  // namespace pneuma::bench
