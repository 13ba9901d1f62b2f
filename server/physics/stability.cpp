#include "physics/stability.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "base/limits.h"
#include "physics/gas.h"

namespace pneuma::physics {

namespace {

// Power iteration comes from below; 40 rounds are within a few per cent on every mesh tried, and this covers the rest.
constexpr int power_iterations = 40;
constexpr double estimate_margin = 1.05;

// The fastest growth that we accept of a motion that a method cannot damp (explicit Euler and midpoint grow at any
// step).
constexpr double growth_max_1_s = 0.01;

using Points = std::vector<Vec3d>;

// K u at the rest shape: sum over edges of k n n^T (u_a - u_b), and the gas's stiffness along gradV.
class RestStiffness {
 public:
  explicit RestStiffness(const SoftBody& body)
      : mesh_(*body.mesh), volume_gradient_(mesh_.positions_m.size(), Vec3d::Zero()) {
    if (!body.gas) return;
    for (const Face& face : mesh_.faces) {
      const Vec3d share = (mesh_.positions_m[face[1]] - mesh_.positions_m[face[0]])
                              .cross(mesh_.positions_m[face[2]] - mesh_.positions_m[face[0]]) /
                          6.0;
      for (const std::uint32_t vertex : face) volume_gradient_[vertex] += share;
    }
    const double volume = signed_volume_m3(mesh_.positions_m, mesh_.faces);
    const double pressure = gas_pressure_pa(make_gas_state(*body.gas, volume), *body.gas, volume);
    const double exponent = body.gas->law == GasLaw::adiabatic ? body.gas->heat_capacity_ratio : 1.0;
    gas_stiffness_ = exponent * pressure / volume;
  }

  // Springs and gas; `spring` scales the first, so that the same sum gives D.
  [[nodiscard]] Points apply(const Points& u, double spring, bool with_gas) const {
    Points result(u.size(), Vec3d::Zero());
    for (const auto& [a, b] : mesh_.edges) {
      const Vec3d n = (mesh_.positions_m[b] - mesh_.positions_m[a]).normalized();
      const Vec3d pull = spring * n.dot(u[b] - u[a]) * n;
      result[a] -= pull;
      result[b] += pull;
    }
    if (with_gas && gas_stiffness_ > 0.0) {
      double along = 0.0;
      for (std::size_t i = 0; i < u.size(); ++i) along += volume_gradient_[i].dot(u[i]);
      for (std::size_t i = 0; i < u.size(); ++i) result[i] += gas_stiffness_ * along * volume_gradient_[i];
    }
    return result;
  }

  [[nodiscard]] double largest_eigenvalue(double spring, bool with_gas) const {
    // A start that no symmetry of a mesh shares: Weyl's golden-ratio sequence.
    Points u(mesh_.positions_m.size());
    double phase = 0.0;
    for (Vec3d& component : u) {
      for (int axis = 0; axis < 3; ++axis) component[axis] = std::fmod(phase += std::numbers::phi, 1.0) - 0.5;
    }
    double eigenvalue = 0.0;
    for (int round = 0; round < power_iterations; ++round) {
      const double length = norm(u);
      if (!(length > 0.0)) return 0.0;
      for (Vec3d& component : u) component /= length;
      u = apply(u, spring, with_gas);
      eigenvalue = norm(u);
    }
    return estimate_margin * eigenvalue;
  }

  // Uniform scaling about the mesh's centre, as displacement.
  [[nodiscard]] Points breathing() const {
    Vec3d centre = Vec3d::Zero();
    for (const Vec3d& x : mesh_.positions_m) centre += x;
    centre /= static_cast<double>(mesh_.positions_m.size());
    Points u;
    u.reserve(mesh_.positions_m.size());
    for (const Vec3d& x : mesh_.positions_m) u.emplace_back(x - centre);
    return u;
  }

  static double dot(const Points& a, const Points& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
  }
  static double norm(const Points& a) { return std::sqrt(dot(a, a)); }

 private:
  const Mesh& mesh_;
  Points volume_gradient_;
  double gas_stiffness_ = 0.0;
};

// How a vertex's drag grows with its speed: the derivative rho C A |u| of 1/2 rho C A u |u|, where the area around it
// is largest.
double wind_drag_n_s_m(const SoftBody& body, const Atmosphere& atmosphere) {
  std::vector<double> areas_m2(body.mesh->positions_m.size(), 0.0);
  for (const Face& face : body.mesh->faces) {
    const auto [a, b, c] = face;
    const std::vector<Vec3d>& x = body.mesh->positions_m;
    const double area_m2 = 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
    for (const std::uint32_t vertex : face) areas_m2[vertex] += area_m2 / 3.0;
  }
  const double drag = std::max(body.drag.normal, body.drag.tangential);
  return atmosphere.density_kg_m3 * drag * *std::ranges::max_element(areas_m2) * atmosphere.wind.norm();
}

// The step at which one motion (frequency w, decay c) stops being damped. From each method's amplification factor:
double longest_stable_step_s(Integrator integrator, double w, double c) {
  const double unlimited = std::numeric_limits<double>::infinity();
  const double by_decay = c > 0.0 ? 1.0 / c : unlimited;  // half of what the real axis allows (2/c)
  if (!(w > 0.0)) return by_decay;
  switch (integrator) {
    case Integrator::explicit_euler:  // |1 + iwh|: grows at w^2 h / 2, damping takes c / 2
      return std::min(by_decay, (c + 2.0 * growth_max_1_s) / (w * w));
    case Integrator::midpoint:  // grows at w (wh)^3 / 8
      return std::min({by_decay, 0.5 / w, std::cbrt(8.0 * (0.5 * c + growth_max_1_s) / w) / w});
    case Integrator::rk4:
      return std::min(by_decay, 2.0 / w);  // limit 2.83 / w
    case Integrator::symplectic_euler:
      return std::min(by_decay, 1.0 / w);  // limit 2 / w
  }
  return unlimited;
}

// The step at which a period of frequency w is off by `error`, from the leading term of each method's phase or
// amplitude error.
double longest_accurate_step_s(Integrator integrator, double w, double error) {
  if (!(w > 0.0)) return std::numeric_limits<double>::infinity();
  const double turn = 2.0 * std::numbers::pi;
  switch (integrator) {
    case Integrator::explicit_euler:
      return 2.0 * error / turn / w;
    case Integrator::midpoint:
      return std::sqrt(6.0 * error / turn) / w;
    case Integrator::rk4:
      return std::sqrt(std::sqrt(120.0 * error / turn)) / w;
    case Integrator::symplectic_euler:
      return std::sqrt(24.0 * error / turn) / w;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

Frequencies estimate_frequencies(const SoftBody& body, const Atmosphere& atmosphere) {
  const RestStiffness stiffness(body);
  const double vertex_mass = body.mass_kg / static_cast<double>(body.mesh->positions_m.size());
  Frequencies result;
  result.fastest_rad_s = std::sqrt(stiffness.largest_eigenvalue(body.springs.stiffness_n_m, true) / vertex_mass);
  result.fastest_decay_1_s = stiffness.largest_eigenvalue(body.springs.damping_n_s_m, false) / vertex_mass;
  result.fastest_decay_1_s += wind_drag_n_s_m(body, atmosphere) / vertex_mass;
  const Points scaling = stiffness.breathing();
  const double inertia = vertex_mass * RestStiffness::dot(scaling, scaling);
  const double restoring = RestStiffness::dot(scaling, stiffness.apply(scaling, body.springs.stiffness_n_m, true));
  result.breathing_rad_s = std::sqrt(std::max(restoring, 0.0) / inertia);
  return result;
}

double longest_step_s(Integrator integrator, const Frequencies& frequencies, double error_target) {
  return std::min(longest_stable_step_s(integrator, frequencies.fastest_rad_s, frequencies.fastest_decay_1_s),
                  longest_accurate_step_s(integrator, frequencies.breathing_rad_s, error_target));
}

base::Result<SubstepChoice> choose_substeps(const Scene& scene) {
  if (scene.stepping.substeps > 0) return SubstepChoice{scene.stepping.substeps, "as the scene says"};
  const double period_s = 1.0 / scene.stepping.rate_hz;
  SubstepChoice choice{1, "no body asks for more"};
  for (std::size_t i = 0; i < scene.soft_bodies.size(); ++i) {
    const SoftBody& body = scene.soft_bodies[i];
    const Frequencies frequencies = estimate_frequencies(body, scene.atmosphere);
    const double step_s = longest_step_s(scene.stepping.integrator, frequencies, scene.stepping.error_target);
    const double needed = std::ceil(period_s / step_s);
    if (!(needed <= base::substeps_max)) {
      std::ostringstream what;
      what << "an explicit step of \"" << body.name << "\" is stable up to " << step_s << " s, which asks for "
           << needed << " substeps a tick; the limit is " << base::substeps_max
           << " (lower stiffness, damping or pressure, more mass, a higher rate_hz, or RK4 helps)";
      return base::Status(base::StatusCode::failed_precondition, what.str(), "soft_bodies[" + std::to_string(i) + "]");
    }
    const auto substeps = static_cast<std::uint32_t>(std::max(needed, 1.0));
    if (substeps > choice.substeps) {
      choice.substeps = substeps;
      std::ostringstream reason;
      reason << '"' << body.name << "\" moves at up to " << frequencies.fastest_rad_s << " rad/s and breathes at "
             << frequencies.breathing_rad_s << " rad/s: a step of at most " << step_s << " s";
      choice.reason = reason.str();
    }
  }
  return choice;
}

}  // namespace pneuma::physics
