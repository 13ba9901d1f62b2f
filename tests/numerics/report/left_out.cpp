#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string_view>

#include "bench/peers.h"
#include "numerics/known_scenes.h"
#include "numerics/report/part.h"
#include "numerics/report/timing.h"
#include "physics/machine/profile.h"
#include "physics/mesh/mesh_builders.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::report {
namespace {

constexpr double seconds_to_sleep_max = 30.0;

struct LeftOutCase {
  std::string name;
  physics::Scene scene;
  bool to_sleep = false;  // profiled once all of it sleeps
  bool grabbed = false;   // a hand holds a vertex of its first body
};

physics::Scene builtin(const std::string& name) {
  const auto message = scene_io::builtin_scene(name);
  if (!message.ok()) throw std::runtime_error(message.status().message());
  auto scene = scene_io::to_physics(*message);
  if (!scene.ok()) throw std::runtime_error(scene.status().message());
  return std::move(*scene);
}

/// Rows of balls on a floor, where they fall asleep, or in the void, where they are kept awake.
physics::Scene balls(int count, bool floor) {
  physics::Scene scene;
  scene.stepping.sleep = floor;
  scene.stepping.integrator = physics::Integrator::symplectic_euler;
  scene.stepping.precision = physics::Precision::single_precision;
  const auto mesh = *physics::make_icosphere(2, 0.5);
  for (int i = 0; i < count; ++i) {
    physics::SoftBody ball;
    ball.name = std::string("ball-").append(std::to_string(i));
    ball.mesh = mesh;
    const int row = i / 4;
    ball.position = {1.5 * (i % 4), 0.5, 1.5 * row};
    ball.springs = {.stiffness_n_m = 1000.0, .damping_n_s_m = 5.0};
    ball.gas = physics::Gas{.moles = 0.028};
    ball.surface.friction = 0.3;
    scene.soft_bodies.push_back(ball);
  }
  if (!floor) return scene;
  scene.gravity = {0.0, -9.81, 0.0};
  physics::Collider plane;
  plane.name = "floor";
  plane.shape = physics::PlaneShape{};
  scene.colliders.push_back(plane);
  return scene;
}

physics::Scene pinned_cloth() {
  physics::Scene scene = builtin("wind-cloth");
  scene.atmosphere = {};
  return scene;
}

physics::Scene bending_cloth() {
  physics::Scene scene = pinned_cloth();
  scene.soft_bodies[0].springs.bend_stiffness_n_m = 0.002;
  return scene;
}

std::vector<LeftOutCase> left_out_cases() {
  std::vector<LeftOutCase> cases;
  for (const std::string& name : scene_io::builtin_scene_names()) cases.push_back({name, builtin(name)});
  cases.push_back({"pinned cloth, no wind", pinned_cloth()});
  cases.push_back({"pinned cloth that bends", bending_cloth()});
  cases.push_back({"one ball in vacuum", balls(1, false)});
  cases.push_back({.name = "one ball, held by a hand", .scene = balls(1, false), .grabbed = true});
  cases.push_back({"16 balls in vacuum", balls(16, false)});
  cases.push_back({"16 balls asleep on a floor", balls(16, true), true});
  return cases;
}

/// Drawn out along x, so that springs alone move it: its rest lengths are the sphere's.
std::shared_ptr<const physics::Mesh> drawn_out_ball() {
  auto mesh = std::make_shared<physics::Mesh>(**physics::make_icosphere(2, 0.5));
  for (physics::Vec3d& position : mesh->positions_m) position.x() *= 1.1;
  return mesh;
}

bool all_asleep(const physics::World& world) {
  for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
    if (!world.is_asleep(i)) return false;
  }
  return true;
}

physics::Profile profile_of(const LeftOutCase& each, std::uint64_t ticks) {
  physics::World world = physics::make_world(each.scene);
  physics::Workers one_thread(1);
  if (each.grabbed) {
    const std::string& name = each.scene.soft_bodies[0].name;
    const physics::Vec3d up = each.scene.soft_bodies[0].position + physics::Vec3d::UnitY();
    if (!world.add_grab(1, name, std::uint32_t{0}, {up}).ok()) throw std::logic_error("a grab is refused");
  }
  world.step_tick(one_thread);  // makes room
  while (each.to_sleep && !all_asleep(world) && world.time_s() < seconds_to_sleep_max) world.step_tick(one_thread);
  world.set_profiling(true);
  for (std::uint64_t tick = 0; tick < ticks; ++tick) world.step_tick(one_thread);
  return world.profile();
}

/// "20 / 32 / 9.7"; a dash where the stage is not there.
std::string cell_of(const physics::StageRow& row, std::uint64_t ticks) {
  if (row.calls == 0 && row.bytes == 0) return "-";
  const double per_tick = 1.0 / static_cast<double>(ticks);
  return number(1e-3 * static_cast<double>(row.time.count()) * per_tick, 2)
      .append(" / ")
      .append(number(static_cast<double>(row.calls) * per_tick, 4))
      .append(" / ")
      .append(number(static_cast<double>(row.bytes) / 1024.0, 2));
}

/// Three scenes a table: more are too wide for a phone.
void write_stages(Page& page, const std::vector<LeftOutCase>& cases, const std::vector<physics::Profile>& profiles,
                  std::uint64_t ticks) {
  constexpr std::size_t scenes_a_table = 3;
  for (std::size_t first = 0; first < cases.size(); first += scenes_a_table) {
    const std::size_t end = std::min(cases.size(), first + scenes_a_table);
    std::vector<std::string> columns{"stage"};
    for (std::size_t i = first; i < end; ++i) columns.push_back(cases[i].name);
    std::vector<std::vector<std::string>> rows;
    for (std::size_t stage = 0; stage < physics::stage_count; ++stage) {
      std::vector<std::string>& row = rows.emplace_back(1, std::string(physics::stage_names[stage]));
      for (std::size_t i = first; i < end; ++i) row.push_back(cell_of(profiles[i][stage], ticks));
    }
    page.table(columns, rows);
  }
}

void add_stages(Context& context) {
  const std::vector<LeftOutCase> cases = left_out_cases();
  const std::uint64_t ticks = context.quick ? 10 : 60;
  std::vector<physics::Profile> profiles;
  Csv csv = context.csv("left-out-stages", {"scene", "stage", "time_us_per_tick", "calls_per_tick", "bytes"});
  for (const LeftOutCase& each : cases) {
    const physics::Profile& profile = profiles.emplace_back(profile_of(each, ticks));
    std::string used;
    for (std::size_t stage = 0; stage < physics::stage_count; ++stage) {
      const physics::StageRow& row = profile[stage];
      csv.row({each.name, std::string(physics::stage_names[stage]),
               1e-3 * static_cast<double>(row.time.count()) / static_cast<double>(ticks),
               static_cast<double>(row.calls) / static_cast<double>(ticks), static_cast<double>(row.bytes)});
      if (row.calls > 0) used.append(used.empty() ? "" : " ").append(physics::stage_names[stage]);
    }
    context.outcomes.push_back({std::string("stages of ").append(each.name), used});
    context.progress.advance(0.6 * static_cast<double>(profiles.size()) / static_cast<double>(cases.size()));
  }
  write_stages(context.page, cases, profiles, ticks);
}

struct Features {
  std::string name;
  bench::BallCase ball;
};

void add_hand_written(Context& context) {
  constexpr std::uint32_t substeps = 64;
  const int ticks = 100;  // a contender's turn
  const std::shared_ptr<const physics::Mesh> mesh = drawn_out_ball();
  std::vector<std::vector<std::string>> rows;
  Csv csv = context.csv("left-out-by-hand", {"features", "scene_us_per_step", "by_hand_us_per_step", "ratio"});
  const std::array<Features, 4> sets{
      {{"springs", {.damping_n_s_m = 0.0, .nrt_j = 0.0, .gravity_m_s2 = 0.0}},
       {"springs, gas", {.damping_n_s_m = 0.0, .gravity_m_s2 = 0.0}},
       {"springs, gas, damping", {.gravity_m_s2 = 0.0}},
       {"springs, gas, damping, bending", {.bend_stiffness_n_m = 0.01, .gravity_m_s2 = 0.0}}}};
  for (std::size_t i = 0; i < sets.size(); ++i) {
    const auto& [name, ball] = sets[i];
    bench::HandWrittenBall by_hand(*mesh, ball);
    physics::Scene scene = bench::ball_scene(mesh, ball, 1, substeps);
    scene.stepping.sleep = false;
    physics::World world = physics::make_world(std::move(scene));
    physics::Workers one_thread(1);
    const std::vector<double> times_s = race_s({[&] {
                                                  for (int tick = 0; tick < ticks; ++tick) world.step_tick(one_thread);
                                                },
                                                [&] { by_hand.step(ticks * substeps); }},
                                               context.quick ? 9 : 41);
    const bool same_bits = by_hand.is_where(world);  // both have gone as far
    const double steps = static_cast<double>(ticks) * substeps;
    const double scene_us = 1e6 * times_s[0] / steps;
    const double by_hand_us = 1e6 * times_s[1] / steps;
    csv.row({name, scene_us, by_hand_us, scene_us / by_hand_us});
    rows.push_back(
        {name, number(scene_us), number(by_hand_us), fixed(scene_us / by_hand_us, 2), same_bits ? "yes" : "no"});
    context.outcomes.push_back({std::string("as by hand: ").append(name), same_bits ? "same bits" : "other bits"});
    context.progress.advance(0.6 + 0.4 * static_cast<double>(i + 1) / static_cast<double>(sets.size()));
  }
  context.page.table(
      {"features", "scene, a step (\u00b5s)", "by hand, a step (\u00b5s)", "scene over hand", "same bits"}, rows);
}

void run_left_out(Context& context) {
  context.page.heading("What a scene leaves out");
  context.page.paragraph(
      "A scene is compiled to the stages that it needs. Each scene below ran on one thread, its stages counted. A "
      "cell: "
      "\u00b5s a tick / calls a tick / KiB held; a dash: the stage is not there. So a cloth without gas pays for no "
      "volume "
      "and no pressure, a body alone for no contact, still air for no wind; balls asleep keep their memory and cost no "
      "stage at all. Exact volume and pressure are found in the springs' own pass; their rows are what is left to add "
      "up. Times include the counting.");
  add_stages(context);
  context.page.subheading("Against a program written by hand");
  context.page.paragraph(
      "A ball of 162 vertices, by symplectic Euler in single precision, as a scene and as a program that calls "
      "only the kernels which these features need, in turns. The ball is let go drawn out by a tenth. A ratio of 1 "
      "says that what is general about the engine costs nothing where it is not used. The last column: whether all "
      "vertices end at the same bits.");
  add_hand_written(context);
}

}  // namespace

Part left_out() {
  return {.name = "left-out", .title = "What a scene leaves out", .quick_s = 6.0, .full_s = 15.0, .run = run_left_out};
}

}  // namespace pneuma::report
