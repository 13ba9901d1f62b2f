// What contact costs: processor time of one core for a frame at 60 Hz, all included. The five balls that tumble in a
// room stand beside Bullet's, frame by frame in turns. What a case must do besides, such as carry a weight or bounce
// to a height, is counted with it.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "bench/figures.h"
#include "bench/median.h"
#include "bench/peers.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"
#include "scene_io/load.h"
#include "scene_io/set_path.h"
#include "scene_io/translate.h"

namespace pneuma::bench {

namespace {

using physics::Vec3d;

// Of this thread: other programs do not count.
double processor_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

physics::World make_world(physics::Scene scene) {
  auto world = physics::World::create(std::move(scene));
  if (!world.ok()) std::abort();
  return std::move(*world);
}

physics::World load_world(const char* name, const std::vector<std::string>& settings = {}) {
  auto scene = *scene_io::load_scene(name);
  for (const std::string& setting : settings) {
    if (!scene_io::set_path(scene, setting).ok()) std::abort();
  }
  return make_world(*scene_io::to_physics(scene));
}

/// A world on one thread, and what its frames took.
class Run {
 public:
  explicit Run(physics::World world) : world_(std::move(world)) {}

  void step() {
    const double start_ms = processor_ms();
    world_.step_tick(worker_);
    frames_ms_.push_back(processor_ms() - start_ms);
  }
  void run_until(double time_s) {
    while (world_.time_s() < time_s) step();
  }
  [[nodiscard]] double mean_ms() const {
    double sum_ms = 0.0;
    for (const double ms : frames_ms_) sum_ms += ms;
    return sum_ms / static_cast<double>(frames_ms_.size());
  }
  [[nodiscard]] double quantile_ms(double share) const {
    std::vector<double> sorted = frames_ms_;
    std::ranges::sort(sorted);
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
  [[nodiscard]] double seconds_a_second() const { return 1e-3 * mean_ms() / world_.tick_period_s(); }
  [[nodiscard]] physics::World& world() { return world_; }

 private:
  physics::World world_;
  physics::Workers worker_{1};
  std::vector<double> frames_ms_;
};

physics::SoftBody ball_body(const std::shared_ptr<const physics::Mesh>& mesh, double stiffness_n_m, double nrt_j,
                            const Vec3d& position_m, std::size_t index) {
  physics::SoftBody body;
  body.name = "ball-" + std::to_string(index);
  body.mesh = mesh;
  body.position = position_m;
  body.springs = {.stiffness_n_m = stiffness_n_m, .damping_n_s_m = 1.0};
  body.gas = physics::Gas{.moles = nrt_j / (physics::gas_constant_j_mol_k * 293.15)};
  body.surface.friction = 0.5;
  return body;
}

physics::Scene empty_scene() {
  physics::Scene scene;
  scene.gravity = {0.0, -9.81, 0.0};
  scene.stepping = {.integrator = physics::Integrator::automatic, .precision = physics::Precision::single_precision};
  return scene;
}

void add_floor(physics::Scene& scene) {
  physics::Collider floor;
  floor.name = "floor";
  floor.shape = physics::PlaneShape{};
  floor.surface.friction = 0.5;
  scene.colliders.push_back(floor);
}

void add_walls(physics::Scene& scene, double half_m) {
  for (const double side : {-1.0, 1.0}) {
    for (const bool along_x : {true, false}) {
      physics::Collider wall;
      wall.name = "wall-" + std::to_string(scene.colliders.size());
      wall.shape = physics::BoxShape{along_x ? Vec3d(0.5, 50.0, half_m + 1.0) : Vec3d(half_m + 1.0, 50.0, 0.5)};
      wall.position = side * (half_m + 0.5) * (along_x ? Vec3d::UnitX() : Vec3d::UnitZ()) + Vec3d(0.0, 45.0, 0.0);
      wall.surface.friction = 0.5;
      scene.colliders.push_back(wall);
    }
  }
}

// As many, as heavy and as fine as those of the scene, in a room as wide, with Bullet's contact of vertices and faces.
// It is no equal: Bullet has no springs by N/m and no room that turns, and its balls run into each other by half their
// size.
class BulletBalls {
 public:
  BulletBalls() {
    const auto mesh = *physics::make_icosphere(2, 0.5);
    BallCase ball;
    ball.nrt_j = 0.028 * physics::gas_constant_j_mol_k * 293.15;
    const std::array<Vec3d, 5> places{
        {{-0.9, -0.6, -0.3}, {0.2, -0.7, 0.6}, {0.9, -0.5, -0.5}, {-0.3, 0.6, 0.2}, {0.7, 0.7, 0.5}}};
    for (const Vec3d& place : places) world_.add_ball(*mesh, ball, {}, place, Vec3d::Zero());
    for (const double side : {-1.0, 1.0}) {
      for (int axis = 0; axis < 3; ++axis) {
        Vec3d half = Vec3d::Constant(2.6);
        half[axis] = 0.5;
        world_.add_box(half, 0.0, side * 2.1 * Vec3d::Unit(axis));
      }
    }
  }
  void step() {
    const double start_ms = processor_ms();
    world_.step(1.0 / 60.0);
    sum_ms_ += processor_ms() - start_ms;
    ++frames_;
  }
  [[nodiscard]] double mean_ms() const { return sum_ms_ / frames_; }

 private:
  BulletWorld world_{-9.81};
  double sum_ms_ = 0.0;
  double frames_ = 0.0;
};

void five_balls(benchmark::State& bench) {
  constexpr int frames = 1'200;
  for ([[maybe_unused]] auto _ : bench) {
    Run ours(load_world("five-balls"));
    Run stiff(load_world("five-balls",
                         {"soft_bodies[0].springs.stiffness_n_m=1e6", "soft_bodies[1].springs.stiffness_n_m=1e6",
                          "soft_bodies[2].springs.stiffness_n_m=1e6", "soft_bodies[3].springs.stiffness_n_m=1e6",
                          "soft_bodies[4].springs.stiffness_n_m=1e6"}));
    BulletBalls bullet;
    for (int frame = 0; frame < frames; ++frame) {
      ours.step();
      bullet.step();
      if (frame < frames / 4) stiff.step();
    }
    bench.counters["ms"] = ours.mean_ms();
    bench.counters["bullet_ms"] = bullet.mean_ms();
    bench.counters["of_bullet"] = ours.mean_ms() / bullet.mean_ms();
    bench.counters["stiff_ms"] = stiff.mean_ms();
    bench.counters["substeps"] = ours.world().substeps();
  }
}
BENCHMARK(five_balls)->Name("contact/five_balls")->Iterations(1)->Repetitions(5)->Unit(benchmark::kMillisecond);

void guided_load(benchmark::State& bench) {
  constexpr double span_s = 20.0;
  for ([[maybe_unused]] auto _ : bench) {
    for (const auto& [stiffness, name] : {std::pair("1e4", "soft"), std::pair("1e6", "stiff")}) {
      Run run(load_world("balloon-under-load",
                         {std::string("soft_bodies[0].springs.stiffness_n_m=") + stiffness, "stepping.sleep=false"}));
      // It swings for long, so its heights tell its acceleration over as long.
      std::array<double, 3> heights_m{};
      for (std::size_t i = 0; i < heights_m.size(); ++i) {
        run.run_until(span_s * static_cast<double>(i + 1));
        heights_m[i] = run.world().rigid_bodies()[0].position.y();
      }
      const double gained_m_s2 = (heights_m[2] - 2.0 * heights_m[1] + heights_m[0]) / (span_s * span_s);
      bench.counters[std::string(name) + "_ms"] = run.mean_ms();
      bench.counters[std::string(name) + "_height_m"] = heights_m[2];
      bench.counters[std::string(name) + "_weight_missed"] = std::abs(gained_m_s2) / 9.81;
    }
  }
}
BENCHMARK(guided_load)->Name("contact/guided_load")->Iterations(1)->Unit(benchmark::kMillisecond);

struct Bounce {
  double share = 0.0;  // of the height that the restitution promises
  double frame_ms = 0.0;
};

Bounce bounce(double restitution) {
  constexpr double drop_m = 2.0;
  physics::Scene scene = empty_scene();
  scene.stepping.precision = physics::Precision::double_precision;
  add_floor(scene);
  const auto mesh = *physics::make_icosphere(2, 0.5);
  scene.soft_bodies.push_back(ball_body(mesh, 1e6, 100.0, {0.0, 0.5 + drop_m, 0.0}, 0));
  scene.soft_bodies[0].surface = {.restitution = restitution, .friction = 0.5};
  Run run(make_world(std::move(scene)));
  const auto above_m = [&] { return run.world().measure(0).centre_of_mass.y() - 0.5; };
  const double fall_s = std::sqrt(2.0 * drop_m / 9.81);
  run.run_until(fall_s + 0.05);
  double highest_m = 0.0;
  while (run.world().time_s() < fall_s * (1.0 + 1.9 * restitution)) {
    run.step();
    highest_m = std::max(highest_m, above_m());
  }
  return {highest_m / (restitution * restitution * drop_m), run.mean_ms()};
}

void stiff_bounce(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    const Bounce half = bounce(0.5);
    const Bounce high = bounce(0.9);
    bench.counters["of_height_at_0.5"] = half.share;
    bench.counters["of_height_at_0.9"] = high.share;
    bench.counters["ms"] = std::max(half.frame_ms, high.frame_ms);
  }
}
BENCHMARK(stiff_bounce)->Name("contact/stiff_bounce")->Iterations(1)->Unit(benchmark::kMillisecond);

/// A closed body of 2,562 vertices on four legs, 1.3 m high.
std::shared_ptr<const physics::Mesh> make_legged() {
  const auto sphere = *physics::make_icosphere(4, 1.0);
  std::vector<Vec3d> positions_m;
  for (const Vec3d& x : sphere->positions_m) {
    double radius_m = 0.45;
    for (const double side : {-1.0, 1.0}) {
      for (const double end : {-1.0, 1.0}) {
        const double off_axis =
            std::acos(std::clamp(x.dot(Vec3d(0.6 * side, -1.0, 0.6 * end).normalized()), -1.0, 1.0));
        radius_m += 0.55 * std::exp(-off_axis * off_axis / 0.03);
      }
    }
    positions_m.emplace_back(radius_m * x);
  }
  return *physics::make_mesh(std::move(positions_m), sphere->faces);
}

void legged_lands(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    physics::Scene scene = empty_scene();
    add_floor(scene);
    scene.soft_bodies.push_back(ball_body(make_legged(), 1e4, 500.0, {0.0, 1.5, 0.0}, 0));
    Run run(make_world(std::move(scene)));
    run.run_until(5.0);
    bench.counters["s_a_s"] = run.seconds_a_second();
    bench.counters["substeps"] = run.world().substeps();
  }
}
BENCHMARK(legged_lands)->Name("contact/legged_lands")->Iterations(1)->Unit(benchmark::kMillisecond);

physics::Scene poured(std::size_t count, std::size_t a_row, double half_m) {
  physics::Scene scene = empty_scene();
  add_floor(scene);
  add_walls(scene, half_m);
  const auto mesh = *physics::make_icosphere(2, 0.25);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at = [&](std::size_t k) {
      return 0.6 * (static_cast<double>(k) - 0.5 * static_cast<double>(a_row - 1));
    };
    const double askew = 0.02 * std::sin(static_cast<double>(i));
    const std::size_t layer = i / (a_row * a_row);
    const Vec3d place(at(i % a_row) + askew, 0.4 + 0.6 * static_cast<double>(layer), at(i / a_row % a_row) - askew);
    scene.soft_bodies.push_back(ball_body(mesh, 500.0, 70.0, place, i));
  }
  return scene;
}

void poured_balls(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    Run run(make_world(poured(100, 4, 1.25)));
    run.run_until(6.0);
    bench.counters["median_ms"] = run.quantile_ms(0.5);
    bench.counters["worst_ms"] = run.quantile_ms(1.0);
    bench.counters["substeps"] = run.world().substeps();
  }
}
BENCHMARK(poured_balls)->Name("contact/poured_balls")->Iterations(1)->Unit(benchmark::kMillisecond);

void crumple(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    Run run(load_world("crumple"));
    run.run_until(10.0);
    bench.counters["p95_ms"] = run.quantile_ms(0.95);
  }
}
BENCHMARK(crumple)->Name("contact/crumple")->Iterations(1)->Unit(benchmark::kMillisecond);

// Jolt's stress sample: a box falls on each of 121 balls.
void boxes_on_balls(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    physics::Scene scene = empty_scene();
    add_floor(scene);
    const auto mesh = *physics::make_icosphere(2, 0.5);
    for (std::size_t i = 0; i < 121; ++i) {
      const std::size_t row = i / 11;
      const Vec3d place(4.0 * static_cast<double>(i % 11) - 20.0, 0.5, 4.0 * static_cast<double>(row) - 20.0);
      scene.soft_bodies.push_back(ball_body(mesh, 1e4, 2'000.0, place, i));
      physics::RigidBody box;
      box.name = "box-" + std::to_string(i);
      box.shape = physics::BoxShape{Vec3d::Constant(1.0)};
      box.mass_kg = 100.0;
      box.position = place + Vec3d(0.0, 4.5, 0.0);
      box.surface.friction = 0.5;
      scene.rigid_bodies.push_back(box);
    }
    Run run(make_world(std::move(scene)));
    run.run_until(2.0);
    bench.counters["mean_ms"] = run.mean_ms();
    bench.counters["worst_ms"] = run.quantile_ms(1.0);
    bench.counters["substeps"] = run.world().substeps();
  }
}
BENCHMARK(boxes_on_balls)->Name("contact/boxes_on_balls")->Iterations(1)->Unit(benchmark::kMillisecond);

// How much of a step is spent to find who may meet whom.
void thousand_balls(benchmark::State& bench) {
  for ([[maybe_unused]] auto _ : bench) {
    Run run(make_world(poured(1'000, 10, 3.1)));
    run.world().set_profiling(true);
    run.run_until(0.5);
    const auto seconds_of = [](const physics::StageRow& row) {
      return std::chrono::duration<double>(row.time).count();
    };
    double all_s = 0.0;
    const physics::Profile profile = run.world().profile();
    for (const physics::StageRow& row : profile) all_s += seconds_of(row);
    bench.counters["broad_share"] = seconds_of(profile[static_cast<std::size_t>(physics::Stage::broad_phase)]) / all_s;
    bench.counters["mean_ms"] = run.mean_ms();
  }
}
BENCHMARK(thousand_balls)->Name("contact/thousand_balls")->Iterations(1)->Unit(benchmark::kMillisecond);

[[maybe_unused]] const bool contact_listed =
    expect({"contact/five_balls/", "ms", Bound::at_most, 0.15, "five-balls by surfaces, AUTO: ms a frame"}) &&
    expect({"contact/five_balls/", "of_bullet", Bound::at_most, 0.67, "the same over Bullet's time for such balls"}) &&
    expect({"contact/five_balls/", "stiff_ms", Bound::at_most, 0.4, "the same, k = 1e6 N/m: ms a frame"}) &&
    expect({"contact/guided_load/", "soft_ms", Bound::at_most, 0.4,
            "1,000 kg guided on a balloon of 1 kg, k = 1e4 N/m: ms a frame"}) &&
    expect({"contact/guided_load/", "soft_weight_missed", Bound::at_most, 1e-3, "of its weight not carried"}) &&
    expect({"contact/guided_load/", "stiff_ms", Bound::at_most, 0.4, "the same, k = 1e6 N/m: ms a frame"}) &&
    expect({"contact/guided_load/", "stiff_weight_missed", Bound::at_most, 1e-3, "of its weight not carried"}) &&
    expect({"contact/stiff_bounce/", "of_height_at_0.5", Bound::at_least, 0.98,
            "stiff ball dropped 2 m, e = 0.5: of the height e^2 h"}) &&
    expect({"contact/stiff_bounce/", "of_height_at_0.9", Bound::at_least, 0.98, "the same, e = 0.9"}) &&
    expect({"contact/stiff_bounce/", "ms", Bound::at_most, 0.1, "the same: ms a frame"}) &&
    expect({"contact/legged_lands/", "s_a_s", Bound::at_most, 0.3,
            "2,562 vertices on four legs land: processor seconds a second"}) &&
    expect({"contact/poured_balls/", "worst_ms", Bound::at_most, 16.0, "100 balls poured: the longest frame, ms"}) &&
    expect(
        {"contact/crumple/", "p95_ms", Bound::at_most, 16.0, "a ball of 642 vertices crumples: ms, 95th percentile"}) &&
    expect({"contact/boxes_on_balls/", "mean_ms", Bound::at_most, 4.0, "121 boxes fall on 121 balls: ms a frame"}) &&
    expect({"contact/thousand_balls/", "broad_share", Bound::at_most, 0.05, "1,000 balls: broad phase, of the step"});

}  // namespace

}  // namespace pneuma::bench
