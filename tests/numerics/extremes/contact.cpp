// Cases of contact: a hit too fast for any step, a load a thousand times as heavy, bodies that begin within each other.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "bench/peers.h"
#include "numerics/extremes/cases.h"
#include "numerics/extremes/variants.h"
#include "physics/choice/stability.h"
#include "physics/choice/step_choice.h"

namespace pneuma::extremes {
namespace {

using physics::Precision;
using physics::Quatd;
using physics::Scene;
using physics::Vec3d;
using physics::World;

/// What of the scene was behind a wall at some time.
struct Passage {
  bool soft = false;
  bool ball = false;
  bool slab = false;
  std::size_t frozen = 0;
};

// Of round-off in single precision, tens of metres away.
constexpr double past_min_m = 1e-3;

Passage run_wall(const Scene& scene) {
  World world = make_world(scene);
  physics::Workers workers(1);
  const auto half_m = [](const physics::Shape& shape) { return std::get<physics::BoxShape>(shape).half_extents_m; };
  const physics::ColliderState& wall = world.colliders()[0];
  const Vec3d wall_m = half_m(wall.collider.shape);
  const auto past_m = [&](const Vec3d& x) { return (wall.orientation.conjugate() * (x - wall.position)).x(); };
  Passage passage;
  for (int tick = 0; tick < 12; ++tick) {
    world.step_tick(workers);
    passage.frozen += world.take_frozen().size();
    for (const Vec3d& x : positions_of(world, 0)) {
      passage.soft |= !x.allFinite() || past_m(x) > past_min_m - wall_m.x();
    }
    const physics::RigidState& plate = world.rigid_bodies()[2];
    const Vec3d plate_m = half_m(plate.body.shape);
    for (const Vec3d& x : positions_of(world, 1)) {
      const Vec3d local = plate.orientation.conjugate() * (x - plate.position);
      const bool within = std::abs(local.y()) < plate_m.y() && std::abs(local.z()) < plate_m.z();
      passage.soft |= !x.allFinite() || (within && local.x() > past_min_m - plate_m.x());
    }
    passage.ball |= !(past_m(world.rigid_bodies()[0].position) < 0.0);
    passage.slab |= !(past_m(world.rigid_bodies()[1].position) < 0.0);
  }
  return passage;
}

std::string of(std::size_t count, std::size_t all) {
  return std::to_string(count).append(" of ").append(std::to_string(all));
}

Result run_thin_wall(bool) {
  const std::vector<Variant> variants = every_variant();
  std::size_t runs = 0;
  std::size_t soft = 0;
  std::size_t ball = 0;
  std::size_t slab = 0;
  std::size_t frozen = 0;
  for (const Variant& variant : variants) {
    for (const double angle_rad : {0.0, 0.3, 0.6}) {
      Scene scene = with(scene_of("13-thin-wall.json"), variant);
      scene.colliders[0].orientation = Eigen::AngleAxisd(angle_rad, Vec3d(0.1, 0.2, 1.0).normalized());
      const Passage passage = run_wall(scene);
      ++runs;
      soft += passage.soft ? 1 : 0;
      ball += passage.ball ? 1 : 0;
      slab += passage.slab ? 1 : 0;
      frozen += passage.frozen > 0 ? 1 : 0;
    }
  }
  return {soft + ball + slab == 0, std::string("through: a soft ball in ")
                                       .append(of(soft, runs))
                                       .append(" runs, a rigid ball in ")
                                       .append(std::to_string(ball))
                                       .append(", a rigid slab in ")
                                       .append(std::to_string(slab))
                                       .append("; a soft ball tore and froze in ")
                                       .append(std::to_string(frozen))};
}

// Of the ball's height of 1 m, below a load that stands on it.
constexpr double ball_left_m = 0.25;

Result run_heavy_on_light(bool quick) {
  const int seconds = quick ? 6 : 60;
  std::size_t runs = 0;
  std::size_t stood = 0;
  std::string falls;
  for (const Variant& variant : every_variant()) {
    // Explicit Euler would need more substeps a tick here than there may be.
    if (variant.integrator == physics::Integrator::explicit_euler) continue;
    Scene scene = with(scene_of("14-heavy-on-light.json"), variant);
    World world = make_world(scene);
    physics::Workers workers(1);
    const physics::RigidState& load = world.rigid_bodies()[0];
    const double half_m = std::get<physics::BoxShape>(load.body.shape).half_extents_m.y();
    const auto stands = [&] {
      const bool is_up = (load.orientation * Vec3d::UnitY()).y() > 0.9;
      return is_up && load.position.y() - half_m > ball_left_m && !world.is_frozen(0);
    };
    int second = 0;
    for (; second < seconds && stands(); ++second) {
      for (int tick = 0; tick < 60; ++tick) world.step_tick(workers);
    }
    ++runs;
    stood += stands() ? 1 : 0;
    if (!stands()) {
      falls.append(falls.empty() ? "; falls by " : ", by ").append(name_of(variant));
      falls.append(" within ").append(std::to_string(second)).append(" s");
    }
  }
  return {stood == runs, std::string("stands in ").append(of(stood, runs)).append(" runs").append(falls)};
}

/// One length of overlap in a period of the ball's own breathing: what presses it out is its skin and its gas.
double exit_bound_m_s(const physics::SoftBody& body, double overlap_m) {
  return overlap_m * physics::estimate_frequencies(body, {}).breathing_rad_s / (2.0 * std::numbers::pi);
}

/// How far the ball, of that radius, is from out of what it begins in: another ball, or the collider's box.
double overlap_m(const Scene& scene, std::size_t ball, double radius_m) {
  const auto sphere_m = [&](const Vec3d& centre_m, double other_radius_m) {
    return radius_m + other_radius_m - (scene.soft_bodies[ball].position - centre_m).norm();
  };
  const physics::RigidBody& stone = scene.rigid_bodies[0];
  double deepest_m = sphere_m(stone.position, std::get<physics::SphereShape>(stone.shape).radius_m);
  for (std::size_t other = 0; other < scene.soft_bodies.size(); ++other) {
    if (other != ball) deepest_m = std::max(deepest_m, sphere_m(scene.soft_bodies[other].position, radius_m));
  }
  const physics::Collider& box = scene.colliders[0];
  const Vec3d half_m = std::get<physics::BoxShape>(box.shape).half_extents_m;
  const Vec3d from_box_m = scene.soft_bodies[ball].position - box.position;
  return std::max(deepest_m, radius_m + (half_m - from_box_m.cwiseAbs()).minCoeff());
}

Result run_deep_overlap(bool quick) {
  const int ticks = quick ? 15 : 120;  // they part within a tenth of a second
  double furthest = 0.0;
  double fastest_m_s = 0.0;
  bool finite = true;
  for (const Variant& variant : every_variant()) {
    Scene scene = with(scene_of("15-deep-overlap.json"), variant);
    std::vector<double> overlaps_m;
    for (std::size_t ball = 0; ball < scene.soft_bodies.size(); ++ball) {
      overlaps_m.push_back(overlap_m(scene, ball, radius_m(scene.soft_bodies[ball].mesh->positions_m)));
    }
    World world = make_world(scene);
    physics::Workers workers(1);
    for (int tick = 0; tick < ticks; ++tick) {
      world.step_tick(workers);
      for (std::size_t body = 0; body < world.soft_body_count(); ++body) {
        const double speed_m_s = world.measure(body).momentum.norm() / scene.soft_bodies[body].mass_kg;
        fastest_m_s = std::max(fastest_m_s, speed_m_s);
        furthest = std::max(furthest, speed_m_s / exit_bound_m_s(scene.soft_bodies[body], overlaps_m[body]));
        finite &= std::isfinite(speed_m_s) && !world.is_frozen(body);
      }
    }
  }
  return {finite && furthest < 1.0, std::string("fastest ")
                                        .append(brief(fastest_m_s))
                                        .append(" m/s, ")
                                        .append(brief(furthest))
                                        .append(" of the bound")};
}

constexpr double bullet_step_s = 1.0 / 480.0;

void add_to(bench::BulletWorld& world, const physics::SoftBody& body) {
  const bench::BallCase ball{.mass_kg = body.mass_kg, .nrt_j = nrt_j(body)};
  world.add_ball(*body.mesh, ball, {}, body.position, body.velocity);
}

std::string bullet_thin_wall() {
  const Scene scene = scene_of("13-thin-wall.json");
  bench::BulletWorld world(0.0);
  add_to(world, scene.soft_bodies[0]);
  world.add_box(std::get<physics::BoxShape>(scene.colliders[0].shape).half_extents_m, 0.0, Vec3d::Zero());
  for (int step = 0; step < 96; ++step) world.step(bullet_step_s);
  const std::vector<Vec3d> positions = world.ball_m(0);
  const auto past = std::ranges::count_if(positions, [](const Vec3d& x) { return !(x.x() <= past_min_m); });
  return of(static_cast<std::size_t>(past), positions.size()).append(" vertices through");
}

std::string bullet_heavy_on_light() {
  const Scene scene = scene_of("14-heavy-on-light.json");
  const physics::RigidBody& load = scene.rigid_bodies[0];
  const Vec3d half_m = std::get<physics::BoxShape>(load.shape).half_extents_m;
  bench::BulletWorld world(scene.gravity.y());
  add_to(world, scene.soft_bodies[0]);
  world.add_box(half_m, load.mass_kg, load.position);
  world.add_box({10.0, 1.0, 10.0}, 0.0, {0.0, -1.0, 0.0});
  double time_s = 0.0;
  for (; time_s < 60.0 && world.box_m(0).y() - half_m.y() > ball_left_m; time_s += bullet_step_s) {
    world.step(bullet_step_s);
  }
  return time_s < 60.0 ? std::string("the load is down after ").append(brief(time_s)).append(" s") : "stands";
}

std::string bullet_deep_overlap() {
  const Scene scene = scene_of("15-deep-overlap.json");
  bench::BulletWorld world(0.0);
  for (int i = 0; i < 2; ++i) add_to(world, scene.soft_bodies[static_cast<std::size_t>(i)]);
  const auto centre_m = [&] {
    Vec3d sum = Vec3d::Zero();
    const std::vector<Vec3d> positions = world.ball_m(0);
    for (const Vec3d& x : positions) sum += x / static_cast<double>(positions.size());
    return sum;
  };
  double fastest_m_s = 0.0;
  for (int step = 0; step < 960; ++step) {
    const Vec3d before = centre_m();
    world.step(bullet_step_s);
    fastest_m_s = std::max(fastest_m_s, (centre_m() - before).norm() / bullet_step_s);
  }
  return std::string("two of the balls: ").append(brief(fastest_m_s)).append(" m/s");
}

}  // namespace

std::vector<ExtremeCase> contact_cases() {
  return {{.number = 13,
           .name = "1,000 m/s at a wall of 1 cm",
           .scene = "13-thin-wall.json",
           .criterion = "nothing through, straight or slanting: a rigid ball or slab at a fixed wall, a soft ball at "
                        "that or a rigid plate; a soft ball may tear and freeze",
           .run = run_thin_wall,
           .bullet = bullet_thin_wall},
          {.number = 14,
           .name = "1,000 kg on a ball of 1 kg",
           .scene = "14-heavy-on-light.json",
           .criterion = "the load stands for 60 s, upright, the ball whole below it; by all but explicit Euler, which "
                        "asks for more substeps than there may be",
           .run = run_heavy_on_light,
           .bullet = bullet_heavy_on_light},
          {.number = 15,
           .name = "bodies that begin within each other",
           .scene = "15-deep-overlap.json",
           .criterion = "no faster out than the overlap in one breathing period",
           .run = run_deep_overlap,
           .bullet = bullet_deep_overlap}};
}

}  // namespace pneuma::extremes
