// Cases of surfaces and joints: a chain of light links, a heap, a skin without gas, a hit at 1,000 m/s, an overlap.
#include <algorithm>
#include <cmath>

#include "numerics/extremes/cases.h"
#include "numerics/extremes/run.h"
#include "numerics/extremes/variants.h"
#include "support/crossings.h"

namespace pneuma::extremes {
namespace {

using physics::Scene;
using physics::Vec3d;

// Pairs of triangles that run through each other: of two bodies, and of those that are not to cross themselves.
std::size_t crossings_of(const Run& run) {
  std::vector<std::vector<Vec3d>> places;
  for (std::size_t i = 0; i < run.world().soft_body_count(); ++i) places.push_back(run.positions_m(i));
  const auto mesh_of = [&](std::size_t i) {
    return support::TriangleMesh{places[i], run.world().soft_body(i).mesh->faces};
  };
  std::size_t count = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (run.world().soft_body(i).collision.self) count += support::count_self_crossings(mesh_of(i));
    for (std::size_t j = i + 1; j < places.size(); ++j) count += support::count_crossings(mesh_of(i), mesh_of(j));
  }
  return count;
}

std::string crossings_text(std::size_t count) {
  return count == 0 ? "no crossing" : std::to_string(count).append(" crossings");
}

// Looks at the world `looks` times in so many seconds.
std::size_t crossings_over(Run& run, double seconds, int looks) {
  std::size_t count = 0;
  for (int look = 0; look < looks && !run.has_frozen() && run.is_finite(); ++look) {
    run.seconds(seconds / looks);
    count += crossings_of(run);
  }
  return count;
}

Result run_light_chain(bool quick) {
  Run run(scene_of("22-light-chain.json"));
  constexpr double length_m = 5.3;
  double furthest_m = 0.0;
  const int ticks = quick ? 120 : 1'800;
  for (int tick = 0; tick < ticks; ++tick) {
    run.tick();
    furthest_m = std::max(furthest_m, run.world().rigid_bodies().back().position.norm());
  }
  const double stretch = furthest_m / length_m - 1.0;
  return {std::isfinite(furthest_m) && std::abs(stretch) < 1e-3,
          std::string("stretched by at most ").append(stretch < 1e-3 ? "0.1 %" : brief(100.0 * stretch).append(" %"))};
}

Result run_poured_heap(bool quick) {
  Run run(scene_of("23-poured-heap.json"));
  const double before_j = run.energy_j();
  const std::size_t count = crossings_over(run, quick ? 2.0 : 20.0, quick ? 6 : 60);
  const bool settles = run.energy_j() < before_j;
  return {count == 0 && settles && run.is_finite() && !run.has_frozen(),
          crossings_text(count).append(settles ? ", energy falls" : ", energy rises")};
}

Result run_crumple(bool quick) {
  Run run(scene_of("24-crumple.json"));
  const std::size_t count = crossings_over(run, quick ? 3.0 : 20.0, quick ? 6 : 60);
  return {count == 0 && run.is_finite() && !run.has_frozen(), crossings_text(count)};
}

Result run_two_at_1000(bool) {
  Run run(scene_of("25-two-at-1000.json"));
  const double before_j = run.energy_j();
  double most = 0.0;
  std::size_t count = 0;
  for (int tick = 0; tick < 12 && run.is_finite(); ++tick) {
    run.tick();
    most = std::max(most, run.energy_j() / before_j);
    count += crossings_of(run);
  }
  return {count == 0 && most < 1.01 && run.is_finite(),
          crossings_text(count).append(most < 1.01 ? ", no energy gained" : ", energy gained")};
}

// By every method: parted within a second, and no faster than they were moved apart.
Result run_overlapping_start(bool quick) {
  const double seconds = quick ? 1.0 : 10.0;
  constexpr double speed_max_m_s = 4.0;
  std::size_t count = 0;
  double fastest_m_s = 0.0;
  bool finite = true;
  for (const physics::Integrator integrator :
       {physics::Integrator::automatic, physics::Integrator::implicit_euler, physics::Integrator::xpbd}) {
    Scene scene = scene_of("26-overlapping-start.json");
    scene.stepping.integrator = integrator;
    Run run(std::move(scene));
    run.seconds(seconds);
    count += crossings_of(run);
    finite = finite && run.is_finite() && !run.has_frozen();
    for (std::size_t i = 0; i < run.world().soft_body_count(); ++i) {
      fastest_m_s = std::max(fastest_m_s, run.world().measure(i).momentum.norm());  // of 1 kg each
    }
  }
  return {count == 0 && finite && fastest_m_s < speed_max_m_s,
          crossings_text(count).append(fastest_m_s < speed_max_m_s ? ", slow" : ", fast")};
}

}  // namespace

std::vector<ExtremeCase> meeting_cases() {
  return {{.number = 22,
           .name = "50 links of 1 g, 50 kg at the end",
           .scene = "22-light-chain.json",
           .criterion = "swings, stretched by at most 0.1 %",
           .run = run_light_chain,
           .bullet = nullptr},
          {.number = 23,
           .name = "balls poured into a narrow box",
           .scene = "23-poured-heap.json",
           .criterion = "no triangle through another, energy falls",
           .run = run_poured_heap,
           .bullet = nullptr},
          {.number = 24,
           .name = "a ball that loses its gas",
           .scene = "24-crumple.json",
           .criterion = "folds, no triangle through another",
           .run = run_crumple,
           .bullet = nullptr},
          {.number = 25,
           .name = "two balls of 1,000,000 N/m at 1,000 m/s",
           .scene = "25-two-at-1000.json",
           .criterion = "finite, no triangle through another, no energy gained",
           .run = run_two_at_1000,
           .bullet = nullptr},
          {.number = 26,
           .name = "balls that begin across each other, three askew and two in one place",
           .scene = "26-overlapping-start.json",
           .criterion = "apart within a second, none faster than 4 m/s; by AUTO, implicit Euler and XPBD",
           .run = run_overlapping_start,
           .bullet = nullptr}};
}

}  // namespace pneuma::extremes
