#include "numerics/extremes/run.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <limits>
#include <sstream>
#include <utility>

#include "physics/choice/step_choice.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::extremes {

using physics::Scene;
using physics::Vec3d;

base::Result<physics::Scene> load(const std::string& file) {
  const base::Result<v1::Scene> scene = scene_io::load_scene(scene_path(file));
  if (!scene.ok()) return scene.status();
  return scene_io::to_physics(*scene);
}

physics::Scene scene_of(const std::string& file) {
  base::Result<physics::Scene> scene = load(file);
  if (!scene.ok()) {
    std::cerr << scene.status().message() << '\n';
    std::abort();
  }
  return std::move(*scene);
}

Run::Run(physics::Scene scene) {
  base::Result<physics::World> world = physics::World::create(std::move(scene));
  if (world.ok()) {
    world_.emplace(std::move(*world));
  } else {
    refusal_ = world.status().message();
  }
}

void Run::seconds(double seconds) {
  const auto ticks = static_cast<std::uint64_t>(std::lround(seconds / world_->tick_period_s()));
  for (std::uint64_t i = 0; i < ticks; ++i) tick();
}

void Run::tick() {
  world_->step_tick(workers_);
  for (const physics::FrozenBody& body : world_->take_frozen()) reporters_.push_back(body.name);
  for (const physics::BodyGasEvent& event : world_->take_gas_events()) reporters_.push_back(event.name);
}

bool Run::has_reported(const std::string& body) const {
  return std::ranges::find(reporters_, body) != reporters_.end();
}

bool Run::has_frozen() const {
  for (std::size_t i = 0; i < world_->soft_body_count(); ++i) {
    if (world_->is_frozen(i)) return true;
  }
  return false;
}

bool Run::is_finite() const {
  for (std::size_t i = 0; i < world_->soft_body_count(); ++i) {
    const physics::BodyMeasures measures = world_->measure(i);
    if (!std::isfinite(measures.volume_m3 + measures.pressure_pa + measures.kinetic_j + measures.elastic_j))
      return false;
    if (!std::ranges::all_of(positions_m(i), [](const Vec3d& x) { return x.allFinite(); })) return false;
  }
  return true;
}

std::vector<Vec3d> Run::positions_m(std::size_t body) const {
  std::vector<double> coordinates(3 * world_->soft_body(body).mesh->positions_m.size());
  world_->copy_positions(body, coordinates);
  std::vector<Vec3d> positions;
  for (std::size_t i = 0; i < coordinates.size(); i += 3) {
    positions.emplace_back(coordinates[i], coordinates[i + 1], coordinates[i + 2]);
  }
  return positions;
}

double Run::energy_j() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < world_->soft_body_count(); ++i) {
    const physics::BodyMeasures measures = world_->measure(i);
    sum += measures.kinetic_j + measures.elastic_j + measures.gas_j + measures.gravity_j;
  }
  return sum;
}

double radius_m(std::span<const Vec3d> positions_m) {
  const auto count = static_cast<double>(positions_m.size());
  Vec3d mean = Vec3d::Zero();
  for (const Vec3d& x : positions_m) mean += x / count;
  double sum = 0.0;
  for (const Vec3d& x : positions_m) sum += (x - mean).norm();
  return sum / count;
}

double nrt_j(const physics::SoftBody& body) {
  return body.gas ? body.gas->moles * physics::gas_constant_j_mol_k * body.gas->temperature_k : 0.0;
}

double rest_radius_m(const physics::SoftBody& ball) {
  double squares_m2 = 0.0;
  for (const double length_m : ball.mesh->edge_lengths_m) squares_m2 += length_m * length_m;
  const double rest_scale = ball.springs.rest_scale;
  const double spring_j = ball.springs.stiffness_n_m * squares_m2 * rest_scale * rest_scale;
  const double scale = (1.0 + std::sqrt(1.0 + 12.0 * nrt_j(ball) / spring_j)) / 2.0;
  return scale * rest_scale * radius_m(ball.mesh->positions_m);
}

double distance_m(std::span<const Vec3d> a, std::span<const Vec3d> b) {
  double squares = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += (a[i] - b[i]).squaredNorm();
  return std::sqrt(squares / static_cast<double>(a.size()));
}

void Survey::add(Scene scene, const std::string& name, bool may_fail, const Error& error) {
  const physics::Integrator asked = scene.stepping.integrator;
  Run run(std::move(scene));
  if (!run.refusal().empty()) {
    ++refused_;
    holds_ = holds_ && may_fail;
    return;
  }
  double value = error(run);
  if (run.has_frozen()) {
    ++reported_;
    holds_ = holds_ && may_fail;
    return;
  }
  if (!run.is_finite() || std::isnan(value)) value = std::numeric_limits<double>::infinity();
  if (asked == physics::Integrator::automatic) automatic_ = std::max(automatic_.value_or(value), value);
  holds_ = holds_ && value <= error_max_;
  if (value > worst_) {
    worst_ = value;
    worst_by_ = name;
  }
}

void Survey::add_all(const Scene& scene, const Error& error) {
  for (const physics::Integrator integrator : every_integrator) {
    add(with_integrator(scene, integrator), method_name(integrator), physics::is_explicit(integrator), error);
  }
}

Result Survey::result(const std::string& what, Format format) const {
  std::ostringstream text;
  text << what << ": AUTO " << (automatic_ ? format(*automatic_) : "gave no answer");
  if (!worst_by_.empty()) text << ", worst " << worst_by_ << ' ' << format(worst_);
  if (refused_ > 0) text << ", " << refused_ << " refused";
  if (reported_ > 0) text << ", " << reported_ << " frozen and reported";
  return {holds_, text.str()};
}

std::string method_name(physics::Integrator integrator) {
  return std::string(physics::name_of(integrator));
}

Scene with_integrator(Scene scene, physics::Integrator integrator) {
  scene.stepping.integrator = integrator;
  return scene;
}

std::string percent(double share) {
  const double value = 100.0 * share;
  if (std::abs(value) < 0.01) return "under 0.01 %";
  constexpr double many = 1000.0;
  if (value >= many) return brief(share) + " times";
  std::ostringstream text;
  if (std::abs(value) < 9.95) {
    text << std::setprecision(2) << value << " %";
  } else {
    text << std::fixed << std::setprecision(0) << value << " %";
  }
  return text.str();
}

std::string brief(double value) {
  std::ostringstream text;
  if (std::abs(value) >= 99.5 && std::abs(value) < 1e6) {
    text << std::fixed << std::setprecision(0);
  } else {
    text << std::setprecision(2);
  }
  text << value;
  return text.str();
}

}  // namespace pneuma::extremes
