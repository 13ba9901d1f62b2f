#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "bench/peers.h"
#include "numerics/report/part.h"
#include "numerics/report/timing.h"
#include "physics/mesh/mesh_builders.h"
#include "scene_io/load.h"
#include "scene_io/set_path.h"
#include "scene_io/translate.h"
#include "support/crossings.h"

namespace pneuma::report {
namespace {

using physics::Vec3d;
using Places = std::vector<std::vector<Vec3d>>;  // of each ball's vertices, m

constexpr double rate_hz = 60.0;
constexpr int frames_a_look = 10;
constexpr double contact_span_s = 1.5;  // of which the time in contact is the median

/// What a run is asked for at each frame.
struct Stage {
  std::function<void()> step;
  std::function<Places()> places;
  std::function<std::optional<double>()> energy_j;
};

struct Watched {
  std::size_t looks = 0;
  std::size_t looks_with_crossings = 0;
  std::size_t crossings_max = 0;  // pairs of triangles in one look
  double energy_start_j = 0.0;
  double energy_most_j = 0.0;
  bool has_energy = false;
  std::vector<double> frames_ms;

  [[nodiscard]] double median_ms(double from_s, double to_s) const {
    const auto from = static_cast<std::size_t>(std::lround(from_s * rate_hz));
    const auto to = static_cast<std::size_t>(std::lround(to_s * rate_hz));
    if (from >= to || to > frames_ms.size()) throw std::logic_error("the run is shorter than what is asked of it");
    std::vector<double> some(frames_ms.begin() + static_cast<std::ptrdiff_t>(from),
                             frames_ms.begin() + static_cast<std::ptrdiff_t>(to));
    const auto middle = some.begin() + static_cast<std::ptrdiff_t>(some.size() / 2);
    std::ranges::nth_element(some, middle);
    return *middle;
  }
};

struct ContactScene {
  std::string name;
  double radius_m = 0.0;
  Vec3d half_room_m = Vec3d::Zero();
  Vec3d room_at_m = Vec3d::Zero();
  double flight_s = 0.0;   // until then nothing touches
  double contact_s = 0.0;  // from then on all do
  double full_s = 0.0;
  bool comes_to_rest = false;  // and nothing drives it: its energy may only fall
};

struct Method {
  std::string name;
  std::vector<std::string> settings;
};

std::size_t crossings_among(const Places& places, const physics::Mesh& mesh) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t j = i + 1; j < places.size(); ++j) {
      count += support::count_crossings({places[i], mesh.faces}, {places[j], mesh.faces});
    }
  }
  return count;
}

Watched watch(const Stage& stage, const physics::Mesh& mesh, double seconds) {
  Watched seen;
  if (const auto energy_j = stage.energy_j()) {
    seen.has_energy = true;
    seen.energy_start_j = seen.energy_most_j = *energy_j;
  }
  const auto frames = static_cast<int>(std::lround(seconds * rate_hz));
  for (int frame = 1; frame <= frames; ++frame) {
    const double start_s = cpu_time_s();
    stage.step();
    seen.frames_ms.push_back(1e3 * (cpu_time_s() - start_s));
    if (const auto energy_j = stage.energy_j()) seen.energy_most_j = std::max(seen.energy_most_j, *energy_j);
    if (frame % frames_a_look != 0) continue;
    const std::size_t crossings = crossings_among(stage.places(), mesh);
    ++seen.looks;
    seen.looks_with_crossings += crossings > 0 ? 1 : 0;
    seen.crossings_max = std::max(seen.crossings_max, crossings);
  }
  return seen;
}

Stage stage_of(physics::World& world) {
  return {.step = [&world, worker = std::make_shared<physics::Workers>(1)] { world.step_tick(*worker); },
          .places =
              [&world] {
                Places places(world.soft_body_count());
                std::vector<double> flat;
                for (std::size_t i = 0; i < places.size(); ++i) {
                  places[i].resize(world.soft_body(i).mesh->positions_m.size());
                  flat.resize(3 * places[i].size());
                  world.copy_positions(i, flat);
                  for (std::size_t k = 0; k < places[i].size(); ++k) {
                    places[i][k] = {flat[3 * k], flat[3 * k + 1], flat[3 * k + 2]};
                  }
                }
                return places;
              },
          .energy_j = [&world]() -> std::optional<double> {
            double sum_j = 0.0;
            for (std::size_t i = 0; i < world.soft_body_count(); ++i) {
              const physics::BodyMeasures of = world.measure(i);
              sum_j += of.kinetic_j + of.elastic_j + of.gas_j + of.gravity_j;
            }
            return sum_j;
          }};
}

physics::World world_of(const ContactScene& scene, const Method& method) {
  auto loaded = *scene_io::load_scene(scene.name);
  for (const std::string& setting : method.settings) {
    if (const auto status = scene_io::set_path(loaded, setting); !status.ok()) {
      throw std::runtime_error(setting + ": cannot be set");
    }
  }
  auto world = physics::World::create(*scene_io::to_physics(loaded));
  if (!world.ok()) throw std::runtime_error(scene.name + ": is no world");
  return std::move(*world);
}

// As many balls, as heavy and as fine, in a room as wide, with Bullet's contact of vertices and faces. Its room does
// not turn, and its springs have no stiffness in N/m.
void fill(bench::BulletWorld& bullet, const physics::World& ours, const physics::Mesh& mesh, const Vec3d& half_m,
          const Vec3d& middle_m) {
  bench::BallCase ball;
  for (std::size_t i = 0; i < ours.soft_body_count(); ++i) {
    ball.mass_kg = ours.soft_body(i).mass_kg;
    ball.nrt_j = ours.soft_body(i).gas->moles * physics::gas_constant_j_mol_k * 293.15;
    bullet.add_ball(mesh, ball, {}, ours.soft_body(i).position, Vec3d::Zero());
  }
  for (const double side : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d wall_m = half_m + Vec3d::Constant(1.0);
      wall_m[axis] = 0.5;
      bullet.add_box(wall_m, 0.0, middle_m + side * (half_m[axis] + 0.5) * Vec3d::Unit(axis));
    }
  }
}

Stage stage_of(bench::BulletWorld& bullet, std::size_t balls) {
  return {.step = [&bullet] { bullet.step(1.0 / rate_hz); },
          .places =
              [&bullet, balls] {
                Places places;
                for (std::size_t i = 0; i < balls; ++i) places.push_back(bullet.ball_m(i));
                return places;
              },
          .energy_j = [] { return std::nullopt; }};
}

// A millionth of it is rounding: the gas counts from far below.
std::string energy_rise(const Watched& seen, bool may_only_fall) {
  if (!seen.has_energy || !may_only_fall) return "-";
  const double rise_j = seen.energy_most_j - seen.energy_start_j;
  return rise_j <= 1e-6 * std::abs(seen.energy_start_j) ? "none" : number(rise_j).append(" J");
}

std::vector<std::string> row_of(const ContactScene& scene, const std::string& method, const Watched& seen,
                                double seconds) {
  const std::string crossed = std::to_string(seen.looks_with_crossings)
                                  .append(" of ")
                                  .append(std::to_string(seen.looks))
                                  .append(" (")
                                  .append(std::to_string(seen.crossings_max))
                                  .append(")");
  const bool rests = scene.comes_to_rest && seconds >= scene.full_s;
  return {std::string("`").append(scene.name).append("`"),
          method,
          crossed,
          energy_rise(seen, scene.comes_to_rest),
          number(seen.median_ms(0.0, scene.flight_s)),
          number(seen.median_ms(scene.contact_s, scene.contact_s + contact_span_s)),
          rests ? number(seen.median_ms(seconds - 1.0, seconds)) : "-"};
}

void run_contact(Context& context) {
  context.page.heading("Contact");
  context.page.paragraph(
      "Soft bodies that meet by their surfaces, by several methods, and Bullet's at the same work. Every tenth frame "
      "is "
      "searched for triangles of two balls that cross, by an oracle that does not round. The table gives the frames "
      "with "
      "a crossing, and the most pairs in one. The energy column is the most that the balls' energy rose above its "
      "start; "
      "a room that turns drives its balls, so it says nothing there. Times are medians, in milliseconds of one thread "
      "for "
      "a frame at 60 Hz, with every body kept awake.");
  const std::vector<ContactScene> scenes{{.name = "five-balls",
                                          .radius_m = 0.5,
                                          .half_room_m = {1.6, 1.6, 1.6},
                                          .flight_s = 0.1,
                                          .contact_s = 2.0,
                                          .full_s = 20.0},
                                         {.name = "ball-pit",
                                          .radius_m = 0.25,
                                          .half_room_m = {0.7, 2.0, 0.7},
                                          .room_at_m = {0.0, 2.0, 0.0},
                                          .flight_s = 0.1,
                                          .contact_s = 1.0,
                                          .full_s = 12.0,
                                          .comes_to_rest = true}};
  std::vector<Method> methods{{"AUTO", {"stepping.sleep=false"}},
                              {"IMPLICIT_EULER, 1 substep",
                               {"stepping.sleep=false", "stepping.integrator=IMPLICIT_EULER", "stepping.substeps=1"}}};
  if (!context.quick) {
    methods.push_back(
        {"TR_BDF2, 1 substep", {"stepping.sleep=false", "stepping.integrator=TR_BDF2", "stepping.substeps=1"}});
  }
  Csv csv = context.csv("contact", {"scene", "method", "looks", "looks_with_crossings", "crossings_max",
                                    "energy_start_j", "energy_most_j", "flight_ms", "contact_ms"});
  std::vector<std::vector<std::string>> rows;
  double done = 0.0;
  for (const ContactScene& scene : scenes) {
    const double seconds = context.quick ? scene.contact_s + contact_span_s : scene.full_s;
    const auto mesh = *physics::make_icosphere(2, scene.radius_m);
    const auto add = [&](const std::string& method, const Watched& seen) {
      rows.push_back(row_of(scene, method, seen, seconds));
      csv.row({scene.name, method, static_cast<double>(seen.looks), static_cast<double>(seen.looks_with_crossings),
               static_cast<double>(seen.crossings_max), seen.has_energy ? number(seen.energy_start_j, 9) : "",
               seen.has_energy ? number(seen.energy_most_j, 9) : "", seen.median_ms(0.0, scene.flight_s),
               seen.median_ms(scene.contact_s, scene.contact_s + contact_span_s)});
      done += 1.0 / static_cast<double>(scenes.size() * (methods.size() + 1));
      context.progress.advance(done);
    };
    for (const Method& method : methods) {
      physics::World world = world_of(scene, method);
      const Watched seen = watch(stage_of(world), *mesh, seconds);
      add(method.name, seen);
      const std::string row = std::string("contact ").append(scene.name).append(" ").append(method.name);
      context.outcomes.push_back({row + " crossings", std::to_string(seen.crossings_max)});
      if (scene.comes_to_rest) context.outcomes.push_back({row + " energy rises by", energy_rise(seen, true)});
      if (seen.crossings_max > 0) context.faults.push_back(row + ": surfaces cross");
    }
    const physics::World ours = world_of(scene, methods[0]);
    bench::BulletWorld bullet(-9.81);
    fill(bullet, ours, *mesh, scene.half_room_m, scene.room_at_m);
    add("Bullet", watch(stage_of(bullet, ours.soft_body_count()), *mesh, seconds));
  }
  context.page.table({"scene", "method", "frames with crossings (most pairs)", "energy above the start", "flight (ms)",
                      "contact (ms)", "rest (ms)"},
                     rows);
}

}  // namespace

Part contact() {
  return {.name = "contact", .title = "Contact", .quick_s = 12.0, .full_s = 60.0, .run = run_contact};
}

}  // namespace pneuma::report
