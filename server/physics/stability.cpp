#include "physics/stability.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "physics/gas.h"
#include "physics/hinge.h"

namespace pneuma::physics {

namespace {

// Power iteration comes from below; 40 rounds are within a few per cent on every mesh tried, and this covers the rest.
constexpr int power_iterations = 40;
constexpr double estimate_margin = 1.05;

using Points = std::vector<Vec3d>;

// Of each spring, along it and across. Across is the share k (1 - L0 / L) of one that is stretched at the start; a
// slack one pushes its ends aside, which makes no motion faster.
struct SpringTerms {
  double along = 0.0;
  double across = 0.0;
};

SpringTerms stiffness_of(const Springs& springs) {
  return {springs.stiffness_n_m, springs.stiffness_n_m * std::max(0.0, 1.0 - springs.rest_scale)};
}

SpringTerms damping_of(const Springs& springs) {
  return {.along = springs.damping_n_s_m};
}

// K u at the start: sum over edges of (k n n^T + k (1 - L0 / L) (1 - n n^T)) (u_a - u_b), bending, and the gas's
// stiffness along gradV.
class RestStiffness {
 public:
  explicit RestStiffness(const SoftBody& body)
      : mesh_(*body.mesh), volume_gradient_(mesh_.positions_m.size(), Vec3d::Zero()) {
    if (body.springs.bend_stiffness_n_m > 0.0) add_hinges(body.springs.bend_stiffness_n_m);
    if (!body.gas) return;
    for (const Face& face : mesh_.faces) {
      const Vec3d share = (mesh_.positions_m[face[1]] - mesh_.positions_m[face[0]])
                              .cross(mesh_.positions_m[face[2]] - mesh_.positions_m[face[0]]) /
                          6.0;
      for (const std::uint32_t vertex : face) volume_gradient_[vertex] += share;
    }
    const double volume = signed_volume_m3(mesh_.positions_m, mesh_.faces);
    gas_stiffness_ = gas_stiffness_pa_m3(make_gas_state(*body.gas, volume), *body.gas, volume);
  }

  enum class Part { springs, bending, all };

  // The same sum gives D.
  [[nodiscard]] Points apply(const Points& u, const SpringTerms& spring, Part part) const {
    Points result(u.size(), Vec3d::Zero());
    if (part != Part::bending) add_springs(u, spring, result);
    if (part == Part::springs) return result;
    for (const BendStiffness& bend : bends_) {
      double angle = 0.0;
      for (std::size_t i = 0; i < 4; ++i) angle += bend.gradient[i].dot(u[bend.vertices[i]]);
      for (std::size_t i = 0; i < 4; ++i) result[bend.vertices[i]] += bend.stiffness * angle * bend.gradient[i];
    }
    if (part == Part::all && gas_stiffness_ > 0.0) {
      double along = 0.0;
      for (std::size_t i = 0; i < u.size(); ++i) along += volume_gradient_[i].dot(u[i]);
      for (std::size_t i = 0; i < u.size(); ++i) result[i] += gas_stiffness_ * along * volume_gradient_[i];
    }
    return result;
  }

  [[nodiscard]] double largest_eigenvalue(const SpringTerms& spring, Part part) const {
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
      u = apply(u, spring, part);
      eigenvalue = norm(u);
    }
    return estimate_margin * eigenvalue;
  }

  // (a - b)^2 <= 2 (a^2 + b^2) for each spring, whose share across is not above that along it; and the like for a
  // hinge's four.
  [[nodiscard]] double spring_bound(const SpringTerms& spring) const {
    std::vector<std::uint32_t> edge_counts(mesh_.positions_m.size(), 0);
    for (const Edge& edge : mesh_.edges) {
      for (const std::uint32_t vertex : edge) ++edge_counts[vertex];
    }
    return 2.0 * spring.along * *std::ranges::max_element(edge_counts);
  }
  [[nodiscard]] double bending_bound() const {
    if (bends_.empty()) return 0.0;
    std::vector<double> shares(mesh_.positions_m.size(), 0.0);
    for (const BendStiffness& bend : bends_) {
      double squares = 0.0;
      for (const Vec3d& gradient : bend.gradient) squares += gradient.squaredNorm();
      for (const std::uint32_t vertex : bend.vertices) shares[vertex] += bend.stiffness * squares;
    }
    return *std::ranges::max_element(shares);
  }
  [[nodiscard]] double gas_eigenvalue() const { return gas_stiffness_ * dot(volume_gradient_, volume_gradient_); }

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
  struct BendStiffness {
    std::array<std::uint32_t, 4> vertices{};
    std::array<Vec3d, 4> gradient{};
    double stiffness = 0.0;
  };

  void add_springs(const Points& u, const SpringTerms& spring, Points& result) const {
    for (const auto& [a, b] : mesh_.edges) {
      const Vec3d n = (mesh_.positions_m[b] - mesh_.positions_m[a]).normalized();
      const Vec3d apart = u[b] - u[a];
      const Vec3d pull = spring.across * apart + (spring.along - spring.across) * n.dot(apart) * n;
      result[a] -= pull;
      result[b] += pull;
    }
  }

  void add_hinges(double stiffness_n_m) {
    for (const Hinge& hinge : make_hinges(mesh_)) {
      std::array<Vec3d, 4> corners;
      for (std::size_t i = 0; i < 4; ++i) corners[i] = mesh_.positions_m[hinge.vertices[i]];
      if (const auto angle = hinge_angle(corners)) {
        bends_.push_back({hinge.vertices, angle->gradient, stiffness_n_m * hinge.weight});
      }
    }
  }

  const Mesh& mesh_;
  std::vector<BendStiffness> bends_;
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

double vertex_mass_kg(const SoftBody& body) {
  return body.mass_kg / static_cast<double>(body.mesh->positions_m.size());
}

Frequencies estimate_without_wind(const SoftBody& body) {
  const RestStiffness stiffness(body);
  const double vertex_mass = vertex_mass_kg(body);
  Frequencies result;
  result.fastest_rad_s =
      std::sqrt(stiffness.largest_eigenvalue(stiffness_of(body.springs), RestStiffness::Part::all) / vertex_mass);
  result.fastest_decay_1_s =
      stiffness.largest_eigenvalue(damping_of(body.springs), RestStiffness::Part::springs) / vertex_mass;
  if (body.springs.bend_stiffness_n_m > 0.0) {
    result.bending_rad_s = std::sqrt(stiffness.largest_eigenvalue({}, RestStiffness::Part::bending) / vertex_mass);
  }
  result.gas_rad_s = std::sqrt(stiffness.gas_eigenvalue() / vertex_mass);
  const Points scaling = stiffness.breathing();
  const double inertia = vertex_mass * RestStiffness::dot(scaling, scaling);
  const double restoring =
      RestStiffness::dot(scaling, stiffness.apply(scaling, stiffness_of(body.springs), RestStiffness::Part::all));
  result.breathing_rad_s = std::sqrt(std::max(restoring, 0.0) / inertia);
  return result;
}

}  // namespace

Frequencies estimate_frequencies(const SoftBody& body, const Atmosphere& atmosphere) {
  return FrequencyTable().estimate({&body, 1}, atmosphere).front();
}

std::vector<Frequencies> FrequencyTable::estimate(std::span<const SoftBody> bodies, const Atmosphere& atmosphere) {
  std::vector<Entry> entries;
  std::vector<Frequencies> result;
  for (const SoftBody& body : bodies) {
    const auto alike = [&](const Entry& entry) {
      return entry.mesh == body.mesh && entry.mass_kg == body.mass_kg && entry.springs == body.springs &&
             entry.gas == body.gas;
    };
    auto entry = std::ranges::find_if(entries, alike);
    if (entry == entries.end()) {
      const auto known = std::ranges::find_if(entries_, alike);
      entries.push_back(known != entries_.end()
                            ? *known
                            : Entry{body.mesh, body.mass_kg, body.springs, body.gas, estimate_without_wind(body)});
      entry = entries.end() - 1;
    }
    result.push_back(entry->frequencies);
    result.back().fastest_decay_1_s += wind_drag_n_s_m(body, atmosphere) / vertex_mass_kg(body);
  }
  entries_ = std::move(entries);
  return result;
}

Frequencies bound_frequencies(const SoftBody& body, const Atmosphere& atmosphere) {
  const RestStiffness stiffness(body);
  const double vertex_mass = vertex_mass_kg(body);
  const double bending = stiffness.bending_bound();
  const double gas = stiffness.gas_eigenvalue();
  const double all = stiffness.spring_bound(stiffness_of(body.springs)) + bending + gas;
  Frequencies result;
  result.fastest_rad_s = std::sqrt(all / vertex_mass);
  result.fastest_decay_1_s =
      (stiffness.spring_bound(damping_of(body.springs)) + wind_drag_n_s_m(body, atmosphere)) / vertex_mass;
  result.gas_rad_s = std::sqrt(gas / vertex_mass);
  result.bending_rad_s = std::sqrt(bending / vertex_mass);
  result.breathing_rad_s = result.fastest_rad_s;
  return result;
}

}  // namespace pneuma::physics
