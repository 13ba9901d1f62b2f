#include "numerics/report/precision_cases.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "physics/choice/stability.h"
#include "physics/mesh/mesh_builders.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::report::precision {

using physics::Scene;
using physics::SoftBody;

namespace {

constexpr const char* position_label = "RMS position error / body size";
constexpr const char* centre_label = "error of mass centres / body size";

// Trajectories are compared, so nothing may make them forget how they came.
Scene undamped(const std::string& name) {
  const auto message = scene_io::load_scene(name);
  if (!message.ok()) throw std::runtime_error(message.status().message());
  auto scene = scene_io::to_physics(*message);
  if (!scene.ok()) throw std::runtime_error(scene.status().message());
  for (SoftBody& body : scene->soft_bodies) body.springs.damping_n_s_m = 0.0;
  return std::move(*scene);
}

struct Ball {
  std::uint32_t subdivisions = 2;
  double mass_kg = 1.2;
  double radius_m = 0.5;  // of its springs
  double stiffness_n_m = 100.0;
  double nrt_j = 400.0;
};

double squares_m2(const physics::Mesh& mesh) {
  double sum = 0.0;
  for (const double length_m : mesh.edge_lengths_m) sum += length_m * length_m;
  return sum;
}

std::shared_ptr<const physics::Mesh> sphere(std::uint32_t subdivisions, double radius_m) {
  return *physics::make_icosphere(subdivisions, radius_m);
}

double scale_at_rest(const Ball& ball) {
  const double energy_j = ball.stiffness_n_m * squares_m2(*sphere(ball.subdivisions, ball.radius_m));
  return (1.0 + std::sqrt(1.0 + 12.0 * ball.nrt_j / energy_j)) / 2.0;
}

/// At `share` of the size that it would rest at.
SoftBody let_go(const Ball& ball, double share) {
  const double scale = share * scale_at_rest(ball);
  SoftBody body;
  body.name = "ball";
  body.mesh = sphere(ball.subdivisions, scale * ball.radius_m);
  body.mass_kg = ball.mass_kg;
  body.springs = {.stiffness_n_m = ball.stiffness_n_m, .rest_scale = 1.0 / scale};
  body.gas = physics::Gas{.moles = ball.nrt_j / (physics::gas_constant_j_mol_k * 293.15)};
  return body;
}

Case breathing(const std::string& name, const std::string& title, std::uint32_t subdivisions) {
  Case subject{.name = name, .words = "let go at 0.9 of its size at rest", .breathes = true};
  subject.scene.soft_bodies.push_back(let_go({.subdivisions = subdivisions}, 0.9));
  subject.judged = {{name, title, &Errors::position, position_label}};
  return subject;
}

// Where the motion that is seen is slow and the stiffness only costs: it flies and spins.
Case spinning(const std::string& name, const std::string& title, const Ball& ball, double share) {
  Case subject{.name = name, .words = "turns once in 1.7 s", .ticks = 30};
  SoftBody body = let_go(ball, share);
  body.velocity = {1.0, 3.0, 0.0};
  body.angular_velocity = {1.0, 2.0, 3.0};
  subject.scene.gravity = {0.0, -9.81, 0.0};
  subject.scene.soft_bodies.push_back(std::move(body));
  subject.judged = {{name, title, &Errors::position, position_label}};
  return subject;
}

// After it touches the floor only what it does as a whole is compared.
Case landing(const Ball& ball) {
  Case subject = spinning("stiff-ball-landing", "", ball, 1.0);
  subject.words = "spins, and lands on a floor after 0.2 s";
  subject.scene.soft_bodies[0].position.y() = ball.radius_m + 0.2;
  subject.scene.soft_bodies[0].velocity.y() = 0.0;
  physics::Collider floor;
  floor.name = "floor";
  floor.shape = physics::PlaneShape{};
  subject.scene.colliders.push_back(std::move(floor));
  subject.free_ticks = 11;
  subject.judged = {{"stiff-ball-flight", "Stiff ball, before it lands", &Errors::position, position_label},
                    {"stiff-ball-landing", "Stiff ball, with its landing", &Errors::centre, centre_label}};
  return subject;
}

std::vector<Case> motions() {
  std::vector<Case> cases;
  cases.push_back(breathing("icosahedron", "Icosahedron, breathing", 0));
  cases.push_back(breathing("ball", "Ball of 162 vertices, breathing", 2));
  cases.back().in_single_too = true;
  cases.push_back({.name = "hanging-ball",
                   .words = "three balls of different pressure fall into their pins",
                   .scene = undamped("hanging-ball"),
                   .ticks = 60,
                   .in_single_too = true,
                   .judged = {{"hanging-ball", "Hanging balls", &Errors::position, position_label}}});
  cases.push_back(
      {.name = "bouncing-ball",
       .words = "lands after 0.55 s, without damping inside",
       .scene = undamped("bouncing-ball"),
       .ticks = 72,
       .free_ticks = 30,
       .judged = {{"bouncing-ball-flight", "Bouncing ball, before it lands", &Errors::position, position_label},
                  {"bouncing-ball", "Bouncing ball, with its bounce", &Errors::centre, centre_label}}});
  cases.push_back({.name = "wind-cloth",
                   .words = "a sheet held at its edge fills with wind",
                   .scene = undamped("wind-cloth"),
                   .ticks = 30,
                   .judged = {{"wind-cloth", "Cloth in the wind", &Errors::position, position_label}}});
  const Ball stiff_ball{.mass_kg = 1.0, .radius_m = 1.0, .stiffness_n_m = 1e6, .nrt_j = 100.0};
  for (Case stiff : {spinning("stiff-ball", "Ball with k = 1e6 N/m, thrown", stiff_ball, 1.0), landing(stiff_ball)}) {
    stiff.explicit_from = 64;
    stiff.reference_substeps = 4096;
    cases.push_back(std::move(stiff));
  }
  Case full = spinning("full-ball", "Ball at 1,000 times its pressure, thrown",
                       {.mass_kg = 1.0, .radius_m = 1.0, .stiffness_n_m = 1e4, .nrt_j = 1e5}, 1.0);
  full.explicit_from = 16;
  full.reference_substeps = 2048;
  cases.push_back(std::move(full));
  cases.push_back({.name = "hand",
                   .words = "falls into its pins; a ball lands on it",
                   .scene = undamped("hand"),
                   .ticks = 30,
                   .free_ticks = 8,
                   .explicit_from = 16,
                   .reference_substeps = 2048,
                   .judged = {{"hand-free", "Hand, before the ball lands", &Errors::position, position_label},
                              {"hand", "Hand, with the ball", &Errors::centre, centre_label}}});
  return cases;
}

}  // namespace

const std::vector<RestingBall>& resting_balls() {
  static const std::vector<RestingBall> balls{
      {"ball-at-rest", "Ball with k = 1e4 N/m, nRT = 100 J, coming to rest", 1e4, 100.0},
      {"stiff-ball-at-rest", "Ball with k = 1e6 N/m, coming to rest", 1e6, 100.0},
      {"full-ball-at-rest", "Ball at 1,000 times its pressure, coming to rest", 1e4, 1e5}};
  return balls;
}

double closed_form_m3(const RestingBall& ball) {
  const auto mesh = sphere(2, 1.0);
  const double scale = scale_at_rest({.radius_m = 1.0, .stiffness_n_m = ball.stiffness_n_m, .nrt_j = ball.nrt_j});
  return physics::signed_volume_m3(mesh->positions_m, mesh->faces) * scale * scale * scale;
}

Measuring measuring_of(const Case& subject) {
  Measuring measuring{.free_ticks = subject.free_ticks, .rest_ticks = subject.rest_ticks, .tick_s = 1.0 / rate_hz};
  for (const SoftBody& body : subject.scene.soft_bodies) {
    measuring.sizes_m.push_back(size_m(*body.mesh));
    measuring.mass_kg += body.mass_kg;
  }
  if (subject.breathes) {
    const SoftBody& body = subject.scene.soft_bodies.front();
    const auto frequencies = physics::estimate_frequencies(body, subject.scene.atmosphere);
    measuring.period_s = 2.0 * std::numbers::pi / frequencies.breathing_rad_s;
  }
  return measuring;
}

std::vector<Case> all_cases(bool quick) {
  std::vector<Case> cases = motions();
  for (const RestingBall& ball : resting_balls()) {
    Case subject{.name = ball.name, .words = "let go at its springs' rest lengths"};
    subject.ticks = quick ? 60 : 180;
    subject.rest_ticks = 30;
    subject.explicit_from = 64;
    subject.reference_substeps = 1024;
    SoftBody body;
    body.name = "ball";
    body.mesh = sphere(2, 1.0);
    body.springs = {.stiffness_n_m = ball.stiffness_n_m, .damping_n_s_m = 10.0};
    body.gas = physics::Gas{.moles = ball.nrt_j / (physics::gas_constant_j_mol_k * 293.15)};
    subject.scene.soft_bodies.push_back(std::move(body));
    subject.judged = {{ball.name, ball.title, &Errors::volume_at_rest, "error of the volume at rest"}};
    cases.push_back(std::move(subject));
  }
  return cases;
}

}  // namespace pneuma::report::precision
