// Scenes whose answers are known in closed form, and ways to run and read a world; for tests and the report alike.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "physics/mesh/mesh_builders.h"
#include "physics/world.h"

namespace pneuma::physics {

inline constexpr std::array<Integrator, 7> every_integrator{
    Integrator::explicit_euler, Integrator::midpoint, Integrator::rk4, Integrator::symplectic_euler,
    Integrator::implicit_euler, Integrator::tr_bdf2,  Integrator::xpbd};

/// Of the error after a given time, in the step.
inline double order_of(Integrator integrator) {
  switch (integrator) {
    case Integrator::midpoint:
    case Integrator::tr_bdf2:
      return 2.0;
    case Integrator::rk4:
      return 4.0;
    default:
      return 1.0;
  }
}

/// A world that must come to be. Throws std::runtime_error with the reason where it does not.
inline World make_world(Scene scene) {
  base::Result<World> world = World::create(std::move(scene));
  if (!world.ok()) throw std::runtime_error(world.status().message());
  return std::move(*world);
}

inline void run_ticks(World& world, std::uint64_t ticks, std::size_t threads = 1) {
  Workers workers(threads);
  for (std::uint64_t i = 0; i < ticks; ++i) world.step_tick(workers);
}

inline std::vector<Vec3d> positions_of(const World& world, std::size_t body = 0) {
  std::vector<double> coordinates(3 * world.soft_body(body).mesh->positions_m.size());
  world.copy_positions(body, coordinates);
  std::vector<Vec3d> positions;
  for (std::size_t i = 0; i < coordinates.size(); i += 3) {
    positions.emplace_back(coordinates[i], coordinates[i + 1], coordinates[i + 2]);
  }
  return positions;
}

/// Root of the mean square distance between the vertices of two configurations.
inline double distance_m(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
  double squares = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += (a[i] - b[i]).squaredNorm();
  return std::sqrt(squares / static_cast<double>(a.size()));
}

/// Steps past stability are taken as asked, down to the last trembling.
inline Stepping steps_as_asked(Integrator integrator, double rate_hz, std::uint32_t substeps) {
  return {.rate_hz = rate_hz,
          .substeps = substeps,
          .integrator = integrator,
          .on_unstable = OnUnstable::allow,
          .sleep = false};
}

/// A spring skin with gas in a vacuum, and the closed forms of its breathing motion. K = sum k l0^2:
/// the scale at rest is s = (1 + sqrt(1 + 12 nRT / K)) / 2, and there w^2 = (K + 3 nRT / s^2) / (N m R^2).
/// On the icosahedron all edges and vertices are alike, so both are exact.
struct BreathingBall {
  std::uint32_t subdivisions = 0;
  double radius_m = 0.5;  // at rest lengths
  double mass_kg = 1.2;
  double stiffness_n_m = 100.0;
  double damping_n_s_m = 0.0;
  double nrt_j = 400.0;

  [[nodiscard]] std::shared_ptr<const Mesh> mesh(double scale) const {
    return *make_icosphere(subdivisions, scale * radius_m);
  }
  [[nodiscard]] double spring_energy_scale_j() const {
    const std::shared_ptr<const Mesh> rest = mesh(1.0);
    double squares_m2 = 0.0;
    for (const double length_m : rest->edge_lengths_m) squares_m2 += length_m * length_m;
    return stiffness_n_m * squares_m2;
  }
  [[nodiscard]] double equilibrium_scale() const {
    return (1.0 + std::sqrt(1.0 + 12.0 * nrt_j / spring_energy_scale_j())) / 2.0;
  }
  [[nodiscard]] double frequency_rad_s() const {
    const double scale = equilibrium_scale();
    return std::sqrt((spring_energy_scale_j() + 3.0 * nrt_j / (scale * scale)) / (mass_kg * radius_m * radius_m));
  }
  [[nodiscard]] SoftBody body(double scale) const {
    SoftBody body;
    body.name = "ball";
    body.mesh = mesh(scale);
    body.mass_kg = mass_kg;
    body.springs = {stiffness_n_m, damping_n_s_m, 1.0 / scale};
    body.gas = Gas{.moles = nrt_j / (gas_constant_j_mol_k * 293.15)};
    return body;
  }
  /// Alone in the void, at rest, `scale` times as large as its rest lengths.
  [[nodiscard]] Scene scene(double scale, Integrator integrator, double rate_hz, std::uint32_t substeps) const {
    Scene scene;
    scene.stepping = steps_as_asked(integrator, rate_hz, substeps);
    scene.soft_bodies.push_back(body(scale));
    return scene;
  }
};

/// One free vertex between two pinned ones (a triangle of springs): two springs at an angle to the line of motion.
/// The pins are at (0, 0, -+half_base), the free vertex at (0, -height, 0).
struct HungVertex {
  double half_base_m = 0.3;
  double height_m = 0.4;
  double stiffness_n_m = 50.0;
  double damping_n_s_m = 0.0;
  double vertex_mass_kg = 0.2;
  double rest_scale = 1.0;

  [[nodiscard]] double spring_m() const { return std::hypot(half_base_m, height_m); }
  [[nodiscard]] double slope() const { return height_m / spring_m(); }
  [[nodiscard]] Scene scene(Integrator integrator, double rate_hz, std::uint32_t substeps) const {
    Scene scene;
    scene.stepping = steps_as_asked(integrator, rate_hz, substeps);
    SoftBody body;
    body.name = "hung";
    body.mesh = *make_mesh({{0, 0, -half_base_m}, {0, 0, half_base_m}, {0, -height_m, 0}}, {{0, 1, 2}});
    body.mass_kg = 3.0 * vertex_mass_kg;
    body.springs = {stiffness_n_m, damping_n_s_m, rest_scale};
    body.pins = {0, 1};
    scene.soft_bodies.push_back(body);
    return scene;
  }
};

/// Every force at once on a damped ball that turns: gravity, wind, an outside pressure, bending, adiabatic gas, a pin.
inline Scene all_forces_scene() {
  Scene scene =
      BreathingBall{.subdivisions = 1, .damping_n_s_m = 0.3, .nrt_j = 50.0}.scene(0.9, Integrator::rk4, 30, 1);
  scene.gravity = {0.5, -9.81, 0};
  scene.atmosphere = {.pressure_pa = 20.0, .density_kg_m3 = 1.2, .wind = {12.0, 3.0, 1.0}};
  SoftBody& ball = scene.soft_bodies[0];
  ball.drag = {.normal = 0.5, .tangential = 0.1};
  ball.springs.bend_stiffness_n_m = 0.5;
  ball.gas->law = GasLaw::adiabatic;
  ball.angular_velocity = {1.0, -2.0, 0.5};
  ball.pins = {3};
  return scene;
}

/// The vertices 1/30 s on, by an integrator in so many substeps. What a linear solve leaves is not to be seen.
inline std::vector<Vec3d> after_a_thirtieth(Scene scene, Integrator integrator, std::uint32_t substeps) {
  scene.stepping.rate_hz = 30;
  scene.stepping.error_target = 1e-9;
  scene.stepping.integrator = integrator;
  scene.stepping.substeps = substeps;
  World world = make_world(std::move(scene));
  run_ticks(world, 1);
  return positions_of(world);
}

/// The times at which a sampled signal crosses 0 upwards, by straight lines between samples dt_s apart.
inline std::vector<double> upward_crossings_s(const std::vector<double>& samples, double dt_s) {
  std::vector<double> times_s;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    if (samples[i - 1] < 0.0 && samples[i] >= 0.0) {
      times_s.push_back((static_cast<double>(i) - samples[i] / (samples[i] - samples[i - 1])) * dt_s);
    }
  }
  return times_s;
}

}  // namespace pneuma::physics
