// Too much gas, and none.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "numerics/extremes/bullet.h"
#include "numerics/extremes/cases.h"
#include "numerics/extremes/run.h"

namespace pneuma::extremes {

namespace {

constexpr const char* inflated_scene = "08-pressure.json";
constexpr const char* empty_scene = "09-no-gas.json";

Result inflated(bool quick) {
  const physics::Scene scene = scene_of(inflated_scene);
  const double expected_m = rest_radius_m(scene.soft_bodies[0]);
  Survey survey(0.02);
  survey.add_all(scene, [&](Run& run) {
    run.seconds(quick ? 3.0 : 20.0);
    return std::abs(radius_m(run.positions_m()) / expected_m - 1.0);
  });
  return survey.result("radius off by", percent);
}

std::string inflated_in_bullet() {
  const physics::SoftBody ball = scene_of(inflated_scene).soft_bodies[0];
  std::ostringstream text;
  text << "radius off by";
  for (const int iterations : {5, 50}) {
    bench::BulletBall peer = bullet_ball(ball, 1.0 / 60.0, {.iterations = iterations, .link_stiffness = 1.0});
    for (int i = 0; i < 600; ++i) peer.step();
    text << (iterations == 5 ? " " : ", ")
         << percent(std::abs(radius_m(peer.positions_m()) / rest_radius_m(ball) - 1.0)) << " at " << iterations
         << " iterations";
  }
  return text.str();
}

// Its skin sinks onto the floor, into a heap with next to nothing inside.
Result empty(bool quick) {
  constexpr double crumpled_share = 0.1;
  constexpr double below_floor_max_m = 1e-3;
  const physics::Scene scene = scene_of(empty_scene);
  const physics::SoftBody& ball = scene.soft_bodies[0];
  const double full_m3 = physics::signed_volume_m3(ball.mesh->positions_m, ball.mesh->faces);
  Survey survey(crumpled_share);
  survey.add_all(scene, [&](Run& run) {
    run.seconds(quick ? 4.0 : 30.0);
    for (const physics::Vec3d& x : run.positions_m()) {
      if (x.y() < -below_floor_max_m) return std::numeric_limits<double>::infinity();
    }
    return std::abs(run.world().measure(0).volume_m3) / full_m3;
  });
  return survey.result("volume left", percent);
}

std::string empty_in_bullet() {
  constexpr double dt_s = 1.0 / 60.0;
  constexpr double floor_m = 10.0;
  const physics::Scene scene = scene_of(empty_scene);
  const physics::SoftBody& ball = scene.soft_bodies[0];
  const double vertex_mass_kg = ball.mass_kg / static_cast<double>(ball.mesh->positions_m.size());
  const bench::BulletSettings soft_links{
      .iterations = 1, .link_stiffness = link_stiffness_of(ball.springs.stiffness_n_m, vertex_mass_kg, dt_s)};
  bench::BulletWorld world(scene.gravity.y());
  world.add_ball(*ball.mesh, {.mass_kg = ball.mass_kg, .nrt_j = 0.0}, soft_links, ball.position, ball.velocity);
  world.add_box({floor_m, floor_m, floor_m}, 0.0, {0.0, -floor_m, 0.0});
  for (int i = 0; i < 1800; ++i) world.step(dt_s);
  const std::vector<physics::Vec3d> positions_m = world.ball_m(0);
  const double full_m3 = physics::signed_volume_m3(ball.mesh->positions_m, ball.mesh->faces);
  const double left = std::abs(physics::signed_volume_m3(positions_m, ball.mesh->faces)) / full_m3;
  double lowest_m = std::numeric_limits<double>::infinity();
  for (const physics::Vec3d& x : positions_m) lowest_m = std::min(lowest_m, x.y());
  return "volume left: " + percent(left) + ", lowest at " + brief(lowest_m) + " m";
}

}  // namespace

std::vector<ExtremeCase> gas_cases() {
  return {{.number = 8,
           .name = "nRT times a thousand",
           .scene = inflated_scene,
           .criterion = "radius within 2 % of the closed form",
           .run = inflated,
           .bullet = inflated_in_bullet},
          {.number = 9,
           .name = "no gas, on a floor",
           .scene = empty_scene,
           .criterion = "finite, crumples to under 10 % of its volume, above the floor",
           .run = empty,
           .bullet = empty_in_bullet}};
}

}  // namespace pneuma::extremes
