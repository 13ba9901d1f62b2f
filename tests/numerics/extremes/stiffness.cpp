// Springs, masses, dampings and steps far from the usual.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "numerics/extremes/bullet.h"
#include "numerics/extremes/cases.h"
#include "numerics/extremes/run.h"
#include "numerics/extremes/uneven_bullet.h"

namespace pneuma::extremes {

namespace {

using physics::Integrator;
using physics::Scene;
using physics::Vec3d;

constexpr const char* stiff_scene = "01-stiffness.json";
constexpr const char* unlike_scene = "02-stiffness-ratio.json";
constexpr const char* heavy_scene = "03-mass-ratio.json";
constexpr const char* long_step_scene = "04-long-step.json";
constexpr const char* damped_scene = "05-damping.json";
constexpr double radius_error_max = 0.02;

Survey::Error radius_error_after(const Scene& scene, double seconds) {
  return [expected_m = rest_radius_m(scene.soft_bodies[0]), seconds](Run& run) {
    run.seconds(seconds);
    return std::abs(radius_m(run.positions_m()) / expected_m - 1.0);
  };
}

Result stiff(bool quick) {
  const Scene scene = scene_of(stiff_scene);
  Survey survey(radius_error_max);
  survey.add_all(scene, radius_error_after(scene, quick ? 2.0 : 10.0));
  return survey.result("radius off by", percent);
}

// Where Bullet's ball is after ten seconds.
std::string radius_in_bullet(const char* file, double dt_s) {
  const physics::SoftBody ball = scene_of(file).soft_bodies[0];
  bench::BulletBall peer = bullet_ball(ball, dt_s, {.link_stiffness = 1.0});
  for (int i = 0; i < static_cast<int>(10.0 / dt_s); ++i) peer.step();
  const double error = std::abs(radius_m(peer.positions_m()) / rest_radius_m(ball) - 1.0);
  return "radius off by " + percent(error) + " (stiffest links, 5 iterations)";
}

/// Of the edges that only stiff vertices have.
double overstretch_of_stiff(const Run& run) {
  const physics::SoftBody& cloth = run.world().soft_body(0);
  const std::vector<double>& factors = cloth.springs.vertex_stiffness_scale;
  const std::vector<Vec3d> x = run.positions_m();
  double most = 0.0;
  for (std::size_t i = 0; i < cloth.mesh->edges.size(); ++i) {
    const auto [a, b] = cloth.mesh->edges[i];
    if (std::min(factors[a], factors[b]) == 1.0) continue;
    most = std::max(most, (x[b] - x[a]).norm() / cloth.mesh->edge_lengths_m[i] - 1.0);
  }
  return most;
}

/// The springs to each soft row of a hanging sheet from the one above carry the weight of what is below: by which share
/// of it they are off, at most.
double load_off(const Run& run, double gravity_m_s2) {
  const physics::SoftBody& cloth = run.world().soft_body(0);
  const std::vector<Vec3d> x = run.positions_m();
  const std::size_t row_vertices = cloth.pins.size();
  const std::size_t rows = x.size() / row_vertices;
  std::vector<double> loads_n(rows, 0.0);  // upwards, of each row by the one above
  for (std::size_t i = 0; i < cloth.mesh->edges.size(); ++i) {
    const physics::Edge& edge = cloth.mesh->edges[i];
    const auto [a, b] = edge;
    if (a / row_vertices == b / row_vertices) continue;
    const Vec3d up = x[a] - x[b];
    const double stretch_m = up.norm() - cloth.mesh->edge_lengths_m[i];
    loads_n[b / row_vertices] +=
        cloth.springs.stiffness_n_m * cloth.springs.stiffness_scale(edge) * stretch_m * up.normalized().y();
  }
  double most = 0.0;
  for (std::size_t row = 1; row < rows; ++row) {
    if (cloth.springs.vertex_stiffness_scale[(row - 1) * row_vertices] != 1.0) continue;
    const double weight_n = cloth.mass_kg * gravity_m_s2 * static_cast<double>(rows - row) / static_cast<double>(rows);
    most = std::max(most, std::abs(loads_n[row] / weight_n - 1.0));
  }
  return most;
}

// XPBD's one pass a substep does not carry the load from the free end to the pins: it is given more substeps than it
// chooses for itself.
Result unlike_springs(bool quick) {
  constexpr std::uint32_t xpbd_substeps = 60;
  const Scene scene = scene_of(unlike_scene);
  const auto worst = [&](Run& run) {
    double most = 0.0;
    for (int i = 0; i < (quick ? 300 : 600); ++i) {
      run.tick();
      most = std::max(most, overstretch_of_stiff(run));
    }
    return std::max(most, load_off(run, scene.gravity.norm()));
  };
  Survey survey(0.01);
  for (const Integrator integrator : every_integrator) {
    Scene by_it = with_integrator(scene, integrator);
    if (integrator == Integrator::xpbd) by_it.stepping.substeps = xpbd_substeps;
    survey.add(by_it, method_name(integrator), physics::is_explicit(integrator), worst);
  }
  return survey.result("length of stiff springs or load of soft ones off by", percent);
}

// About the centre of mass: nearly all of it is that of the light vertices, which swing about the heavy one.
Vec3d spin(const physics::BodyMeasures& sums) {
  return sums.angular_momentum - sums.centre_of_mass.cross(sums.momentum);
}

// Symplectic Euler, and so AUTO, which chooses it, keeps angular momentum to round-off; the others to their order.
Result heavy(bool quick) {
  constexpr double kept_spin_max = 1e-7;
  constexpr double spin_max = 0.005;
  double kept_spin_lost = -1.0;  // no run of such a method yet
  double spin_lost = 0.0;
  Survey survey(1e-12);
  survey.add_all(scene_of(heavy_scene), [&](Run& run) {
    const physics::BodyMeasures start = run.world().measure(0);
    double& most = run.world().integrator() == Integrator::symplectic_euler ? kept_spin_lost : spin_lost;
    double lost = 0.0;
    for (int i = 0; i < (quick ? 60 : 1200); ++i) {
      run.tick();
      const physics::BodyMeasures sums = run.world().measure(0);
      lost = std::max(lost, (sums.momentum - start.momentum).norm());
      most = std::max(most, (spin(sums) - spin(start)).norm() / spin(start).norm());
    }
    return lost / start.momentum.norm();
  });
  Result result = survey.result("momentum lost", brief);
  result.holds = result.holds && kept_spin_lost >= 0.0 && kept_spin_lost < kept_spin_max && spin_lost < spin_max;
  result.figure.append("; spin lost: SYMPLECTIC_EULER ").append(brief(kept_spin_lost));
  result.figure.append(", others up to ").append(percent(spin_lost));
  return result;
}

// At a tenth of the rate, with substeps left open, and with those that the method has at the whole rate. XPBD may be
// refused these too; ALLOW asks for what comes of it, which by an explicit method is a report.
Result long_step(bool quick) {
  using physics::OnUnstable;
  const Scene scene = scene_of(long_step_scene);
  const Survey::Error error = radius_error_after(scene, quick ? 10.0 : 60.0);
  Survey survey(radius_error_max);
  survey.add_all(scene, error);
  for (const Integrator integrator : every_integrator) {
    Scene usual = with_integrator(scene, integrator);
    usual.stepping.rate_hz *= 10.0;
    const Run chosen(usual);
    if (!chosen.refusal().empty()) continue;
    Scene given = with_integrator(scene, integrator);
    given.stepping.substeps = chosen.world().substeps();
    const bool has_limit = physics::is_explicit(integrator) || integrator == Integrator::xpbd;
    for (const OnUnstable answer : {OnUnstable::refuse, OnUnstable::substep, OnUnstable::allow}) {
      if (answer == OnUnstable::allow && integrator == Integrator::xpbd) continue;
      given.stepping.on_unstable = answer;
      survey.add(given, method_name(integrator) + " given its substeps", has_limit, error);
    }
  }
  return survey.result("radius off by", percent);
}

Result damped(bool quick) {
  Survey survey(1e-3);
  survey.add_all(scene_of(damped_scene), [quick](Run& run) {
    const physics::BodyMeasures start = run.world().measure(0);
    const double at_start_j = run.energy_j();
    double most_j = at_start_j;
    for (int i = 0; i < (quick ? 300 : 3600); ++i) {
      run.tick();
      most_j = std::max(most_j, run.energy_j());
    }
    const double energy_gained = (most_j - at_start_j) / (start.kinetic_j + start.elastic_j);
    const Vec3d momentum_lost = run.world().measure(0).momentum - start.momentum;
    return std::max(energy_gained, momentum_lost.norm() / start.momentum.norm());
  });
  return survey.result("energy gained or momentum lost", percent);
}

// Its damping ends at 1, and is of all motion.
std::string damped_in_bullet() {
  const physics::SoftBody ball = scene_of(damped_scene).soft_bodies[0];
  bench::BulletBall peer = bullet_ball(ball, 1.0 / 60.0, {.link_stiffness = 1.0, .damping = 1.0});
  const auto centre = [&peer] {
    const std::vector<Vec3d> x = peer.positions_m();
    Vec3d sum = Vec3d::Zero();
    for (const Vec3d& point : x) sum += point;
    return Vec3d(sum / static_cast<double>(x.size()));
  };
  const Vec3d before = centre();
  for (int i = 0; i < 60; ++i) peer.step();
  const double went = (centre() - before).norm() / ball.velocity.norm();
  return "at its highest damping the whole body is braked: in a second it goes " + percent(went) + " of its way";
}

}  // namespace

std::vector<ExtremeCase> stiff_cases() {
  return {{.number = 1,
           .name = "stiffness times a million",
           .scene = stiff_scene,
           .criterion = "radius within 2 % of the closed form",
           .run = stiff,
           .bullet = [] { return radius_in_bullet(stiff_scene, 1.0 / 60.0); }},
          {.number = 2,
           .name = "springs of one mesh that differ a million times",
           .scene = unlike_scene,
           .criterion = "of a cloth that hangs by a stiff half, no stiff spring ever 1 % too long; in the end the soft "
                        "ones carry what is below within 1 %; XPBD given 60 substeps",
           .run = unlike_springs,
           .bullet = [] { return overstretch_in_bullet(scene_of(unlike_scene)); }},
          {.number = 3,
           .name = "one vertex a million times heavier",
           .scene = heavy_scene,
           .criterion = "momentum kept to 1e-12; spin to 1e-7 by SYMPLECTIC_EULER, within 0.5 % by the others",
           .run = heavy,
           .bullet = [] { return momentum_lost_in_bullet(scene_of(heavy_scene)); }},
          {.number = 4,
           .name = "steps ten times as long",
           .scene = long_step_scene,
           .criterion = "radius within 2 %, or refused, or frozen and reported",
           .run = long_step,
           .bullet = [] { return radius_in_bullet(long_step_scene, 1.0 / 6.0); }},
          {.number = 5,
           .name = "damping times ten thousand",
           .scene = damped_scene,
           .criterion = "energy never 0.1 % past the start's, momentum kept",
           .run = damped,
           .bullet = damped_in_bullet}};
}

}  // namespace pneuma::extremes
