#include "physics/implicit/implicit_matrix.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "physics/mesh/hinge.h"

namespace pneuma::physics {

namespace {

using Triplet = Eigen::Triplet<double>;

// A third of the faces around each vertex, at rest.
std::vector<double> vertex_areas_m2(const Mesh& mesh) {
  std::vector<double> areas_m2(mesh.positions_m.size(), 0.0);
  for (const auto& [a, b, c] : mesh.faces) {
    const std::vector<Vec3d>& x = mesh.positions_m;
    const double share_m2 = (x[b] - x[a]).cross(x[c] - x[a]).norm() / 6.0;
    for (const std::uint32_t vertex : {a, b, c}) areas_m2[vertex] += share_m2;
  }
  return areas_m2;
}

// Rounded up to a power of two, so that the matrix that depends on it is rarely factored anew.
template <class Real>
double bounding_drag_n_s_m3(const SoftState<Real>& body, const Atmosphere& atmosphere) {
  if (!has_wind(body.body, atmosphere)) return 0.0;
  double squared_max = 1.0;
  for (const Vec3<Real>& v : body.v) squared_max = std::max(squared_max, static_cast<double>(v.squaredNorm()));
  int exponent = 0;
  const bool is_power = std::frexp(squared_max, &exponent) == 0.5;
  const double speed_m_s = atmosphere.wind.norm() + std::ldexp(1.0, (is_power ? exponent : exponent + 1) / 2);
  return atmosphere.density_kg_m3 * std::max(body.body.drag.normal, body.body.drag.tangential) * speed_m_s;
}

// To a power of four; 0 where it is little beside the springs.
double rounded_up(double pressure_stiffness_n_m, double stiffness_n_m) {
  constexpr double little = 0.05;
  if (!(pressure_stiffness_n_m > little * stiffness_n_m)) return 0.0;
  int exponent = 0;
  (void)std::frexp(pressure_stiffness_n_m, &exponent);
  return std::ldexp(1.0, 2 * ((exponent + 1) / 2));
}

Eigen::SparseMatrix<double> assemble(const ImplicitConstants& constants, std::span<const double> diagonal,
                                     std::span<const Hinge> hinges) {
  const Mesh& mesh = *constants.mesh;
  const std::size_t count = mesh.positions_m.size();
  const double s = constants.s;
  std::vector<Triplet> entries;
  entries.reserve(count + 4 * mesh.edges.size() + 16 * hinges.size());
  const auto is_pinned = [&](std::uint32_t i) { return !constants.pinned.empty() && constants.pinned[i] != 0; };
  const auto add = [&](std::uint32_t i, std::uint32_t j, double value) {
    if (i == j || (!is_pinned(i) && !is_pinned(j))) {
      entries.emplace_back(static_cast<int>(i), static_cast<int>(j), value);
    }
  };
  for (std::uint32_t i = 0; i < count; ++i) add(i, i, diagonal[i]);
  const std::vector<double>& scale = constants.vertex_stiffness_scale;
  for (const auto& [a, b] : mesh.edges) {
    const double stiffness_n_m = (scale.empty() ? 1.0 : 0.5 * (scale[a] + scale[b])) * constants.stiffness_n_m;
    const double spring = s * (constants.damping_n_s_m + s * (stiffness_n_m + constants.pressure_stiffness_n_m));
    add(a, a, spring);
    add(b, b, spring);
    add(a, b, -spring);
    add(b, a, -spring);
  }
  for (const Hinge& hinge : hinges) {
    // At rest all four gradients are near one line: their lengths, with signs, are the row of a Laplacian.
    std::array<Vec3d, 4> corners;
    for (std::size_t i = 0; i < 4; ++i) corners[i] = mesh.positions_m[hinge.vertices[i]];
    const auto angle = hinge_angle(corners);
    if (!angle) continue;
    const double stiffness = s * s * constants.bend_stiffness_n_m * hinge.weight;
    std::array<double, 4> lengths{};
    for (std::size_t i = 0; i < 4; ++i) {
      lengths[i] = std::copysign(angle->gradient[i].norm(), angle->gradient[i].dot(angle->gradient[2]));
    }
    lengths[0] = -(lengths[1] + lengths[2] + lengths[3]);  // a move of the whole is none
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) {
        add(hinge.vertices[i], hinge.vertices[j], stiffness * lengths[i] * lengths[j]);
      }
    }
  }
  if (constants.drag_n_s_m3 > 0.0) {
    const std::vector<double> areas_m2 = vertex_areas_m2(mesh);
    for (std::uint32_t i = 0; i < count; ++i) add(i, i, s * constants.drag_n_s_m3 * areas_m2[i]);
  }
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(count), static_cast<Eigen::Index>(count));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

template <class Real>
ImplicitMatrixPtr make_matrix(ImplicitConstants constants, const SoftState<Real>& body) {
  auto matrix = std::make_shared<ImplicitMatrix>();
  const double s = constants.s;
  matrix->diagonal.assign(constants.mesh->positions_m.size(), constants.vertex_mass_kg);
  for (std::size_t i = 0; i < constants.mass_shares.size(); ++i) {
    matrix->diagonal[i] *= constants.mass_shares[i];
    matrix->least_share = std::min(matrix->least_share, constants.mass_shares[i]);
  }
  for (const Grab& grab : body.grabs) {
    matrix->diagonal[grab.vertex] += s * (grab.damping_n_s_m + s * grab.stiffness_n_m);
  }
  if (!matrix->factor.factor(assemble(constants, matrix->diagonal, body.hinges))) return nullptr;
  if (constants.mesh->closed) matrix->opposite = opposite_vertices(*constants.mesh);
  matrix->constants = std::move(constants);
  matrix->inverse = std::make_unique<InverseColumns>(matrix->factor, matrix->constants.pinned);
  return matrix;
}

}  // namespace

template <class Real>
ImplicitConstants ImplicitConstants::of(const SoftState<Real>& body, const Surroundings& surroundings, double s,
                                        double pressure_stiffness_n_m) {
  const Springs& springs = body.body.springs;
  ImplicitConstants constants{body.body.mesh,
                              s,
                              static_cast<double>(body.vertex_mass_kg),
                              springs.stiffness_n_m,
                              springs.damping_n_s_m,
                              springs.bend_stiffness_n_m,
                              rounded_up(pressure_stiffness_n_m, springs.stiffness_n_m),
                              springs.vertex_stiffness_scale,
                              bounding_drag_n_s_m3(body, surroundings.atmosphere),
                              {},
                              body.pinned,
                              body.mass_shares};
  for (const Grab& grab : body.grabs) {
    constants.grabs.insert(constants.grabs.end(),
                           {static_cast<double>(grab.vertex), grab.stiffness_n_m, grab.damping_n_s_m});
  }
  return constants;
}

bool ImplicitConstants::operator==(const ImplicitConstants& other) const {
  const auto numbers = [](const ImplicitConstants& of) {
    return std::tie(of.s, of.vertex_mass_kg, of.stiffness_n_m, of.damping_n_s_m, of.bend_stiffness_n_m,
                    of.pressure_stiffness_n_m, of.drag_n_s_m3, of.grabs, of.pinned, of.vertex_stiffness_scale,
                    of.mass_shares);
  };
  return numbers(*this) == numbers(other) && same_mesh(*mesh, *other.mesh);
}

std::size_t ImplicitMatrix::bytes() const {
  return factor.bytes() + inverse->bytes() + diagonal.capacity() * sizeof(double) +
         opposite.capacity() * sizeof(opposite[0]) +
         (constants.grabs.capacity() + constants.vertex_stiffness_scale.capacity() + constants.mass_shares.capacity()) *
             sizeof(double) +
         constants.pinned.capacity();
}

ImplicitMatrixPtr ImplicitMatrices::find(const ImplicitConstants& constants) const {
  for (const auto& weak : matrices_) {
    ImplicitMatrixPtr matrix = weak.lock();
    if (matrix && matrix->constants == constants) return matrix;
  }
  return nullptr;
}

template <class Real>
void ImplicitMatrices::update(ImplicitMatrixPtr& held, const SoftState<Real>& body, const Surroundings& surroundings,
                              double s, double pressure_stiffness_n_m) {
  ImplicitConstants constants = ImplicitConstants::of(body, surroundings, s, pressure_stiffness_n_m);
  if (held && held->constants == constants) return;
  held = nullptr;
  // The lock is kept while the matrix is made: bodies that are alike come one after another, and want the same.
  const std::lock_guard lock(mutex_);
  held = find(constants);
  if (held) return;
  held = make_matrix(std::move(constants), body);
  std::erase_if(matrices_, [](const auto& weak) { return weak.expired(); });
  if (held) add(held);
}

template <class Real>
void ImplicitMatrices::take_over(HeldMatrices& held, const SoftState<Real>& body, const Surroundings& surroundings,
                                 std::span<const HeldMatrices> others) {
  ImplicitConstants constants = ImplicitConstants::of(body, surroundings, 0.0);
  const auto found = std::ranges::find_if(others, [&](const HeldMatrices& other) {
    // Told at a glance, and so that later comparisons are too.
    if (!other.steps || other.steps->constants.mesh != constants.mesh) return false;
    constants.s = other.steps->constants.s;
    return constants == other.steps->constants;
  });
  if (found == others.end()) return;
  held = *found;
  const std::lock_guard lock(mutex_);
  add(held.steps);
  if (held.touching) add(held.touching);
  if (held.first_order) add(held.first_order);
}

void ImplicitMatrices::add(const ImplicitMatrixPtr& matrix) {
  const auto is_it = [&](const auto& weak) { return weak.lock() == matrix; };
  if (std::ranges::none_of(matrices_, is_it)) matrices_.push_back(matrix);
}

std::size_t ImplicitMatrices::bytes() const {
  const std::lock_guard lock(mutex_);
  std::size_t sum = 0;
  for (const auto& weak : matrices_) {
    if (const ImplicitMatrixPtr matrix = weak.lock()) sum += matrix->bytes();
  }
  return sum;
}

template void ImplicitMatrices::take_over<float>(HeldMatrices&, const SoftState<float>&, const Surroundings&,
                                                 std::span<const HeldMatrices>);
template void ImplicitMatrices::take_over<double>(HeldMatrices&, const SoftState<double>&, const Surroundings&,
                                                  std::span<const HeldMatrices>);
template void ImplicitMatrices::update<float>(ImplicitMatrixPtr&, const SoftState<float>&, const Surroundings&, double,
                                              double);
template void ImplicitMatrices::update<double>(ImplicitMatrixPtr&, const SoftState<double>&, const Surroundings&,
                                               double, double);

}  // namespace pneuma::physics
