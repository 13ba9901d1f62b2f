// Scenes in other units, and far away: in single precision, nothing depends on either.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <sstream>

#include "numerics/extremes/bullet.h"
#include "numerics/extremes/cases.h"
#include "numerics/extremes/run.h"

namespace pneuma::extremes {

namespace {

using physics::Integrator;
using physics::Scene;
using physics::Vec3d;

constexpr const char* units_scene = "16-units.json";
constexpr const char* far_scene = "17-far-away.json";

// How many of the scene's units one of SI's is.
struct Units {
  double length = 1.0;
  double mass = 1.0;
  double time = 1.0;
};

// The same motion in other units, of a ball that breathes and turns in place. The scene's error target is so tight that
// where the implicit solvers stop makes no difference.
Scene in_units(Scene scene, const Units& units) {
  const double stiffness = units.mass / (units.time * units.time);
  scene.stepping.rate_hz /= units.time;
  for (physics::SoftBody& body : scene.soft_bodies) {
    std::vector<Vec3d> positions_m = body.mesh->positions_m;
    for (Vec3d& x : positions_m) x *= units.length;
    body.mesh = *physics::make_mesh(std::move(positions_m), body.mesh->faces);
    body.position *= units.length;
    body.angular_velocity /= units.time;
    body.mass_kg *= units.mass;
    body.springs.stiffness_n_m *= stiffness;
    body.springs.damping_n_s_m *= units.mass / units.time;
    body.gas->moles *= stiffness * units.length * units.length;  // energy over RT
  }
  return scene;
}

// Explicit Euler is left out, and the page says so: its 68,000 steps a second add up to a rounding of 5e-5 in any
// units.
constexpr std::array<Integrator, 7> few_step_integrators{
    Integrator::automatic, Integrator::implicit_euler,  Integrator::tr_bdf2, Integrator::xpbd, Integrator::midpoint,
    Integrator::rk4,       Integrator::symplectic_euler};

// The rate has limits of its own, so that time comes in a narrower range.
constexpr std::array<Units, 8> other_units{{{.length = 1e-3},
                                            {.length = 1e3},
                                            {.mass = 1e-3},
                                            {.mass = 1e3},
                                            {.time = 0.1},
                                            {.time = 10.0},
                                            {.length = 1e-3, .mass = 1e-3, .time = 0.1},
                                            {.length = 1e3, .mass = 1e3, .time = 10.0}}};

Result scaled(bool quick) {
  constexpr double error_max = 1e-5;
  const double seconds = quick ? 0.5 : 1.0;
  double worst = 0.0;
  std::string worst_by;
  for (const Integrator integrator : few_step_integrators) {
    const Scene scene = with_integrator(scene_of(units_scene), integrator);
    Run in_si(scene);
    in_si.seconds(seconds);
    const std::vector<Vec3d> expected_m = in_si.positions_m();
    for (const Units& units : other_units) {
      Run run(in_units(scene, units));
      if (!run.refusal().empty()) return {false, method_name(integrator) + " refused: " + run.refusal()};
      run.seconds(seconds * units.time);
      std::vector<Vec3d> positions_m = run.positions_m();
      for (Vec3d& x : positions_m) x /= units.length;
      const double error = distance_m(positions_m, expected_m) / radius_m(expected_m);
      if (worst_by.empty() || !(error <= worst)) {
        worst = error;
        worst_by = method_name(integrator);
      }
    }
  }
  return {worst <= error_max, "off by at most " + brief(worst) + " of the radius, " + worst_by};
}

// The place where the body is, in its own precision, against the same body at the origin. "refused" where it is.
Result far_away(bool quick) {
  constexpr double error_max = 1e-3;
  bool holds = true;
  std::ostringstream text;
  using physics::Precision;
  for (const Precision precision : {Precision::single_precision, Precision::double_precision}) {
    text << (precision == Precision::single_precision ? "single precision " : ", double ");
    double worst = 0.0;
    bool refused = false;
    for (const Integrator integrator : every_integrator) {
      Scene scene = with_integrator(scene_of(far_scene), integrator);
      scene.stepping.precision = precision;
      Run far(scene);
      refused = refused || !far.refusal().empty();
      if (refused) continue;
      const Vec3d place = scene.soft_bodies[0].position;
      scene.soft_bodies[0].position.setZero();
      Run near(scene);
      for (Run* run : {&far, &near}) run->seconds(quick ? 1.0 : 10.0);
      std::vector<Vec3d> positions_m = far.positions_m();
      for (Vec3d& x : positions_m) x -= place;
      worst = std::max(worst, distance_m(positions_m, near.positions_m()) / radius_m(near.positions_m()));
    }
    holds = holds && !refused && worst <= error_max;
    if (refused) {
      text << "refused";
    } else {
      text << "off by at most " << brief(worst) << " of the radius";
    }
  }
  return {holds, text.str()};
}

// Single precision, as Debian has it.
std::string far_away_in_bullet() {
  const physics::SoftBody far = scene_of(far_scene).soft_bodies[0];
  physics::SoftBody near = far;
  near.position.setZero();
  const auto after_a_second_m = [](const physics::SoftBody& body) {
    bench::BulletBall peer = bullet_ball(body, 1.0 / 60.0, {.link_stiffness = 1.0});
    for (int i = 0; i < 60; ++i) peer.step();
    std::vector<Vec3d> positions_m = peer.positions_m();
    for (Vec3d& x : positions_m) x -= body.position;
    return positions_m;
  };
  const std::vector<Vec3d> expected_m = after_a_second_m(near);
  const double error = distance_m(after_a_second_m(far), expected_m) / radius_m(expected_m);
  return "off by " + percent(error) + " of the radius after a second";
}

}  // namespace

std::vector<ExtremeCase> scale_cases() {
  return {{.number = 16,
           .name = "units a thousandth to a thousand times SI's, in single precision",
           .scene = units_scene,
           .criterion = "the same motion to 1e-5 of the radius, but by explicit Euler, whose many steps round more",
           .run = scaled,
           .bullet = nullptr},
          {.number = 17,
           .name = "a million metres from the origin",
           .scene = far_scene,
           .criterion = "the same motion to 1e-3 of the radius, in either precision",
           .run = far_away,
           .bullet = far_away_in_bullet}};
}

}  // namespace pneuma::extremes
