#include "physics/implicit/implicit_matrix.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "physics/mesh/hinge.h"

namespace pneuma::physics {

namespace {

// To a power of four; 0 where it is little beside the springs.
double rounded_up(double pressure_stiffness_n_m, double stiffness_n_m) {
  constexpr double little = 0.05;
  if (!(pressure_stiffness_n_m > little * stiffness_n_m)) return 0.0;
  int exponent = 0;
  (void)std::frexp(pressure_stiffness_n_m, &exponent);
  return std::ldexp(1.0, 2 * ((exponent + 1) / 2));
}

// The diagonal comes first in each sum.
Eigen::SparseMatrix<double> assemble(const MatrixEntries& entries) {
  std::vector<MatrixEntries::Entry> all;
  all.reserve(entries.diagonal.size() + entries.entries.size());
  for (std::uint32_t i = 0; i < entries.diagonal.size(); ++i) all.push_back({i, i, entries.diagonal[i]});
  all.insert(all.end(), entries.entries.begin(), entries.entries.end());
  const auto size = static_cast<Eigen::Index>(entries.diagonal.size());
  Eigen::SparseMatrix<double> matrix(size, size);
  matrix.setFromTriplets(all.begin(), all.end());
  return matrix;
}

void place(const Mesh& mesh, ImplicitMatrix& matrix) {
  const std::span<const std::uint32_t> places = matrix.factor.places();
  matrix.diagonal_by_place.resize(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) matrix.diagonal_by_place[places[i]] = matrix.diagonal[i];
  matrix.edge_places.reserve(mesh.edges.size());
  for (const auto& [first, second] : mesh.edges) matrix.edge_places.push_back({places[first], places[second]});
}

template <class Real>
ImplicitMatrixPtr make_matrix(ImplicitConstants constants, const SoftState<Real>& body) {
  auto matrix = std::make_shared<ImplicitMatrix>();
  MatrixEntries entries{.pinned = constants.pinned};
  entries.diagonal.assign(constants.mesh->positions_m.size(), constants.vertex_mass_kg);
  for (std::size_t i = 0; i < constants.mass_shares.size(); ++i) {
    entries.diagonal[i] *= constants.mass_shares[i];
    matrix->least_share = std::min(matrix->least_share, constants.mass_shares[i]);
  }
  constants.bounds.stiffen(body, {*constants.mesh, constants.s, constants.pressure_stiffness_n_m}, entries);
  if (!matrix->factor.factor(assemble(entries))) return nullptr;
  matrix->diagonal = std::move(entries.diagonal);
  place(*constants.mesh, *matrix);
  if (constants.mesh->closed) matrix->opposite = opposite_vertices(*constants.mesh);
  matrix->constants = std::move(constants);
  matrix->inverse = std::make_unique<InverseColumns>(matrix->factor, matrix->constants.pinned);
  return matrix;
}

}  // namespace

template <class Real>
ImplicitConstants ImplicitConstants::of(const SoftState<Real>& body, const Surroundings& surroundings, double s,
                                        double pressure_stiffness_n_m) {
  return {body.body.mesh,
          s,
          static_cast<double>(body.vertex_mass_kg),
          rounded_up(pressure_stiffness_n_m, body.body.springs.stiffness_n_m),
          MatrixBounds::of(body, surroundings),
          body.pinned,
          body.mass_shares};
}

bool ImplicitConstants::operator==(const ImplicitConstants& other) const {
  const auto numbers = [](const ImplicitConstants& of) {
    return std::tie(of.s, of.vertex_mass_kg, of.pressure_stiffness_n_m, of.bounds, of.pinned, of.mass_shares);
  };
  return numbers(*this) == numbers(other) && same_mesh(*mesh, *other.mesh);
}

std::size_t ImplicitMatrix::bytes() const {
  return factor.bytes() + inverse->bytes() + (diagonal.capacity() + diagonal_by_place.capacity()) * sizeof(double) +
         edge_places.capacity() * sizeof(EdgePlaces) + opposite.capacity() * sizeof(opposite[0]) +
         constants.bounds.bytes() + constants.mass_shares.capacity() * sizeof(double) + constants.pinned.capacity();
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
