#include "physics/choice/stability.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/limits.h"
#include "physics/forces/force_terms.h"
#include "physics/state/vertex_masses.h"

namespace pneuma::physics {

namespace {

// Power iteration comes from below; 40 rounds are within a few per cent on every mesh tried, and this covers the rest.
constexpr int power_iterations = 40;
constexpr double estimate_margin = 1.05;

using Points = std::vector<Vec3d>;

double sum_of_products(const Points& a, const Points& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

double norm(const Points& a) {
  return std::sqrt(sum_of_products(a, a));
}

Points volume_gradient_m2(const Mesh& mesh) {
  Points gradient(mesh.positions_m.size(), Vec3d::Zero());
  for (const auto& [a, b, c] : mesh.faces) {
    const std::vector<Vec3d>& x = mesh.positions_m;
    const Vec3d share = (x[b] - x[a]).cross(x[c] - x[a]) / 6.0;
    for (const std::uint32_t vertex : {a, b, c}) gradient[vertex] += share;
  }
  return gradient;
}

// The vertices' masses over their mean.
class Shares {
 public:
  explicit Shares(std::vector<double> shares) : shares_(std::move(shares)) {}

  [[nodiscard]] double of(std::size_t vertex) const { return shares_.empty() ? 1.0 : shares_[vertex]; }
  // To coordinates in which every vertex has the mean mass go a force or a gradient by over_roots, a displacement by
  // times_roots, and K as over_roots(K over_roots(u)).
  [[nodiscard]] Points over_roots(Points u) const {
    for (std::size_t i = 0; i < shares_.size(); ++i) u[i] /= std::sqrt(shares_[i]);
    return u;
  }
  [[nodiscard]] Points times_roots(Points u) const {
    for (std::size_t i = 0; i < shares_.size(); ++i) u[i] *= std::sqrt(shares_[i]);
    return u;
  }

 private:
  std::vector<double> shares_;
};

// Uniform scaling about the centre of mass, as displacement.
Points breathing(const Mesh& mesh, const Shares& shares) {
  Vec3d centre = Vec3d::Zero();
  for (std::size_t i = 0; i < mesh.positions_m.size(); ++i) centre += shares.of(i) * mesh.positions_m[i];
  centre /= static_cast<double>(mesh.positions_m.size());
  Points u;
  u.reserve(mesh.positions_m.size());
  for (const Vec3d& x : mesh.positions_m) u.emplace_back(x - centre);
  return u;
}

// The same of the softest vertices, the others as much less as their stiffest spring is stiffer.
Points breathing_of_softest(const Mesh& mesh, const Springs& springs, const Shares& shares) {
  std::vector<double> stiffest(mesh.positions_m.size(), 0.0);
  for (const Edge& edge : mesh.edges) {
    for (const std::uint32_t i : edge) stiffest[i] = std::max(stiffest[i], springs.stiffness_scale(edge));
  }
  const double softest = *std::ranges::min_element(stiffest);
  Points u = breathing(mesh, shares);
  for (std::size_t i = 0; i < u.size(); ++i) {
    if (stiffest[i] > softest) u[i] *= softest / stiffest[i];
  }
  return u;
}

// K u of a skin at the start, in coordinates in which every vertex has the mean mass: sum over edges of
// (k n n^T + k (1 - L0 / L) (1 - n n^T)) (u_a - u_b), and bending.
class SkinStiffness {
 public:
  SkinStiffness(const Mesh& mesh, const Springs& springs, const Shares& shares) : mesh_(mesh), shares_(shares) {
    directions_.reserve(mesh.edges.size());
    for (const auto& [a, b] : mesh.edges) {
      directions_.emplace_back((mesh.positions_m[b] - mesh.positions_m[a]).normalized());
    }
    ForceTerms::for_each([&]<class Term>() {
      if constexpr (!term_parts::NoSkin<Term>) Term::add_to_skin(mesh, springs, skin_);
    });
  }

  [[nodiscard]] const SpringTerms& stiffness() const { return skin_.stiffness; }
  [[nodiscard]] const SpringTerms& damping() const { return skin_.damping; }
  [[nodiscard]] bool bends() const { return !skin_.undamped_bends.empty(); }

  enum class Part { springs, bending, both };

  // The same sum gives D.
  [[nodiscard]] Points apply(const Points& u, const SpringTerms& spring, Part part) const {
    const Points moved = shares_.over_roots(u);
    Points result(u.size(), Vec3d::Zero());
    if (part != Part::bending) add_springs(moved, spring, result);
    if (part != Part::springs) add_bending(moved, result);
    return shares_.over_roots(std::move(result));
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
    std::vector<double> scale_sums(mesh_.positions_m.size(), 0.0);
    for (const Edge& edge : mesh_.edges) {
      for (const std::uint32_t vertex : edge) scale_sums[vertex] += spring.scale(edge);
    }
    return 2.0 * spring.along * largest_over_mass(scale_sums);
  }
  [[nodiscard]] double bending_bound() const {
    if (!bends()) return 0.0;
    std::vector<double> stiffness_n_m(mesh_.positions_m.size(), 0.0);
    for (const FourPointTangent& bend : skin_.undamped_bends) {
      double squares = 0.0;
      for (const Vec3d& gradient : bend.gradient) squares += gradient.squaredNorm();
      for (const std::uint32_t vertex : bend.vertices) stiffness_n_m[vertex] += bend.stiffness * squares;
    }
    return largest_over_mass(stiffness_n_m);
  }

 private:
  void add_springs(const Points& u, const SpringTerms& spring, Points& result) const {
    for (std::size_t i = 0; i < mesh_.edges.size(); ++i) {
      const Edge& edge = mesh_.edges[i];
      const auto [a, b] = edge;
      const Vec3d& n = directions_[i];
      const Vec3d apart = spring.scale(edge) * (u[b] - u[a]);
      const Vec3d pull = spring.across * apart + (spring.along - spring.across) * n.dot(apart) * n;
      result[a] -= pull;
      result[b] += pull;
    }
  }

  void add_bending(const Points& u, Points& result) const {
    for (const FourPointTangent& bend : skin_.undamped_bends) {
      double angle = 0.0;
      for (std::size_t i = 0; i < 4; ++i) angle += bend.gradient[i].dot(u[bend.vertices[i]]);
      for (std::size_t i = 0; i < 4; ++i) result[bend.vertices[i]] += bend.stiffness * angle * bend.gradient[i];
    }
  }

  [[nodiscard]] double largest_over_mass(std::span<const double> of_vertices) const {
    double largest = 0.0;
    for (std::size_t i = 0; i < of_vertices.size(); ++i) largest = std::max(largest, of_vertices[i] / shares_.of(i));
    return largest;
  }

  const Mesh& mesh_;
  const Shares& shares_;
  Points directions_;  // one an edge
  SkinMotion skin_;
};

// How a vertex's drag grows with its speed, where the area around it is largest for its share of the mass.
double drag_n_s_m(const SoftBody& body, const Shares& shares, const Atmosphere& atmosphere) {
  std::vector<double> areas_m2(body.mesh->positions_m.size(), 0.0);
  for (const Face& face : body.mesh->faces) {
    const auto [a, b, c] = face;
    const std::vector<Vec3d>& x = body.mesh->positions_m;
    const double area_m2 = 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
    for (const std::uint32_t vertex : face) areas_m2[vertex] += area_m2 / 3.0;
  }
  double largest_m2 = 0.0;
  for (std::size_t i = 0; i < areas_m2.size(); ++i) largest_m2 = std::max(largest_m2, areas_m2[i] / shares.of(i));
  double sum_n_s_m = 0.0;
  ForceTerms::for_each([&]<class Term>() {
    if constexpr (!term_parts::NoDragAtRest<Term>) sum_n_s_m += Term::drag_at_rest_n_s_m(body, atmosphere, largest_m2);
  });
  return sum_n_s_m;
}

double mean_mass_kg(const SoftBody& body) {
  return body.mass_kg / static_cast<double>(body.mesh->positions_m.size());
}

// Along the springs D is at least d / k_max times K, and so is each motion's decay. Bending and the pull across springs
// that start stretched have no damping to count on. With springs that are alike the fastest motion has all of D's
// largest eigenvalue.
double lacking_damping_n_s_m(const Mesh& mesh, const Springs& springs, const SkinModes& modes) {
  double scale_max = 0.0;
  for (const Edge& edge : mesh.edges) scale_max = std::max(scale_max, springs.stiffness_scale(edge));
  const double stiffness_max_n_m = springs.stiffness_n_m * scale_max;
  if (!(stiffness_max_n_m > 0.0)) return 0.0;
  const double across_n_m = std::max(0.0, 1.0 - springs.rest_scale) * modes.fastest_n_m;
  const double along_n_m = std::max(0.0, modes.fastest_n_m - modes.bending_n_m - across_n_m);
  return std::max(0.0, modes.damping_n_s_m - springs.damping_n_s_m / stiffness_max_n_m * along_n_m);
}

SkinModes make_modes(const Mesh& mesh, const Springs& springs, const Shares& shares) {
  const SkinStiffness skin(mesh, springs, shares);
  using Part = SkinStiffness::Part;
  SkinModes modes;
  modes.volume_m3 = signed_volume_m3(mesh.positions_m, mesh.faces);
  modes.fastest_n_m = skin.largest_eigenvalue(skin.stiffness(), Part::both);
  SpringTerms stretched = skin.stiffness();
  stretched.across = stretched.along;
  modes.stretched_n_m = skin.largest_eigenvalue(stretched, Part::springs);
  modes.damping_n_s_m = skin.largest_eigenvalue(skin.damping(), Part::springs);
  if (skin.bends()) modes.bending_n_m = skin.largest_eigenvalue({}, Part::bending);
  const Points gradient = shares.over_roots(volume_gradient_m2(mesh));
  const Points pull = skin.apply(gradient, skin.stiffness(), Part::both);
  modes.gradient_m4 = sum_of_products(gradient, gradient);
  modes.gradient_n_m3 = sum_of_products(gradient, pull);
  modes.gradient_n2_m2 = sum_of_products(pull, pull);
  const auto quotient_n_m = [&](const Points& u) {
    return sum_of_products(u, skin.apply(u, skin.stiffness(), Part::both)) / sum_of_products(u, u);
  };
  Points scaling = shares.times_roots(breathing(mesh, shares));
  if (!springs.vertex_stiffness_scale.empty()) {
    modes.lacking_n_s_m = lacking_damping_n_s_m(mesh, springs, modes);
    Points of_softest = shares.times_roots(breathing_of_softest(mesh, springs, shares));
    if (quotient_n_m(of_softest) < quotient_n_m(scaling)) scaling = std::move(of_softest);
  }
  modes.scaling_m2 = sum_of_products(scaling, scaling);
  modes.scaling_j = sum_of_products(scaling, skin.apply(scaling, skin.stiffness(), Part::both));
  modes.scaling_j_s = sum_of_products(scaling, skin.apply(scaling, skin.damping(), Part::springs));
  modes.scaling_m3 = sum_of_products(scaling, gradient);
  return modes;
}

double volume_stiffness_pa_m3(const SoftBody& body, double volume_m3) {
  double sum = 0.0;
  ForceTerms::for_each([&]<class Term>() {
    if constexpr (!term_parts::NoRestVolumeStiffness<Term>) sum += Term::rest_volume_stiffness_pa_m3(body, volume_m3);
  });
  return sum;
}

// The largest eigenvalue of A + c g g^T, from above. It solves 1 = c g^T (x - A)^-1 g, and the Gauss-Radau rule with a
// node at A's largest eigenvalue b is above that integral over A's spectrum: a weight at b, and one at the node t that
// the moments of A about g fix. So A may be the diagonal of t and b (Golub and Meurant, Matrices, Moments and
// Quadrature, chapter 6).
double largest_with_gas_n_m(const SkinModes& modes, double gas_pa_m3) {
  const double b = modes.fastest_n_m;
  const double below = b * modes.gradient_m4 - modes.gradient_n_m3;
  if (!(gas_pa_m3 > 0.0)) return b;
  if (!(below > 0.0)) return b + gas_pa_m3 * modes.gradient_m4;
  const double t = std::max(0.0, (b * modes.gradient_n_m3 - modes.gradient_n2_m2) / below);
  const double weight_at_t = below / (b - t);
  const double weight_at_b = std::max(0.0, modes.gradient_m4 - weight_at_t);
  const double at_t = t + gas_pa_m3 * weight_at_t;
  const double at_b = b + gas_pa_m3 * weight_at_b;
  const double between = gas_pa_m3 * std::sqrt(weight_at_t * weight_at_b);
  return 0.5 * (at_t + at_b) + std::hypot(0.5 * (at_t - at_b), between);
}

Frequencies frequencies_of(const SoftBody& body, const Shares& shares, const Atmosphere& atmosphere,
                           const SkinModes& modes) {
  const double vertex_kg = mean_mass_kg(body);
  const double gas_pa_m3 = volume_stiffness_pa_m3(body, modes.volume_m3);
  Frequencies result;
  result.fastest_rad_s = std::sqrt(largest_with_gas_n_m(modes, gas_pa_m3) / vertex_kg);
  result.fastest_decay_1_s = (modes.damping_n_s_m + drag_n_s_m(body, shares, atmosphere)) / vertex_kg;
  result.decay_lacking_1_s = modes.lacking_n_s_m / vertex_kg;
  result.stretched_rad_s = std::sqrt(modes.stretched_n_m / vertex_kg);
  result.bending_rad_s = std::sqrt(modes.bending_n_m / vertex_kg);
  result.gas_give_m4_kg = modes.gradient_m4 / vertex_kg;
  result.gas_rad_s = std::sqrt(gas_pa_m3 * result.gas_give_m4_kg);
  const double restoring_j = modes.scaling_j + gas_pa_m3 * modes.scaling_m3 * modes.scaling_m3;
  result.breathing_rad_s = std::sqrt(std::max(restoring_j, 0.0) / (vertex_kg * modes.scaling_m2));
  result.breathing_decay_1_s = modes.scaling_j_s / (vertex_kg * modes.scaling_m2);
  return result;
}

}  // namespace

Frequencies estimate_frequencies(const SoftBody& body, const Atmosphere& atmosphere) {
  return FrequencyTable().estimate({&body, 1}, atmosphere).front();
}

bool FrequencyTable::Entry::is_of(const SoftBody& body) const {
  return mesh == body.mesh && springs == body.springs && vertex_mass_scale == body.vertex_mass_scale;
}

Frequencies FrequencyTable::estimate_in(std::vector<Entry>& entries, const SoftBody& body,
                                        const Atmosphere& atmosphere) {
  const auto alike = [&body](const Entry& entry) { return entry.is_of(body); };
  const Shares shares(mass_shares(body));
  auto entry = std::ranges::find_if(entries, alike);
  if (entry == entries.end()) {
    if (const auto known = std::ranges::find_if(entries_, alike); known != entries_.end()) {
      entries.push_back(*known);
    } else {
      entries.push_back(
          {body.mesh, body.springs, body.vertex_mass_scale, make_modes(*body.mesh, body.springs, shares)});
      ++skins_found_;
    }
    entry = entries.end() - 1;
  }
  return frequencies_of(body, shares, atmosphere, entry->modes);
}

Frequencies FrequencyTable::estimate_another(const SoftBody& body, const Atmosphere& atmosphere) {
  if (entries_.size() > base::world_bodies_max) entries_.clear();
  return estimate_in(entries_, body, atmosphere);
}

std::vector<Frequencies> FrequencyTable::estimate(std::span<const SoftBody> bodies, const Atmosphere& atmosphere) {
  std::vector<Entry> entries;
  std::vector<Frequencies> result;
  for (const SoftBody& body : bodies) result.push_back(estimate_in(entries, body, atmosphere));
  entries_ = std::move(entries);
  return result;
}

Frequencies bound_frequencies(const SoftBody& body, const Atmosphere& atmosphere) {
  const Shares shares(mass_shares(body));
  const SkinStiffness skin(*body.mesh, body.springs, shares);
  const double vertex_mass = mean_mass_kg(body);
  const double bending = skin.bending_bound();
  const Points gradient = shares.over_roots(volume_gradient_m2(*body.mesh));
  const double volume_m3 = signed_volume_m3(body.mesh->positions_m, body.mesh->faces);
  const double gas = volume_stiffness_pa_m3(body, volume_m3) * sum_of_products(gradient, gradient);
  const double springs = skin.spring_bound(skin.stiffness());
  const double all = springs + bending + gas;
  Frequencies result;
  result.fastest_rad_s = std::sqrt(all / vertex_mass);
  result.fastest_decay_1_s = (skin.spring_bound(skin.damping()) + drag_n_s_m(body, shares, atmosphere)) / vertex_mass;
  result.stretched_rad_s = std::sqrt(springs / vertex_mass);
  result.gas_rad_s = std::sqrt(gas / vertex_mass);
  result.bending_rad_s = std::sqrt(bending / vertex_mass);
  result.breathing_rad_s = result.fastest_rad_s;
  return result;
}

}  // namespace pneuma::physics
