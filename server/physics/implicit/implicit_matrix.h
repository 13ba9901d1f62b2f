// The preconditioner of implicit steps: one N x N matrix, the same for x, y and z, factored once for all bodies of a
// world that are alike.
#pragma once

#include <array>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "physics/forces/matrix_bounds.h"
#include "physics/implicit/inverse_columns.h"
#include "physics/implicit/sparse_cholesky.h"
#include "physics/implicit/system_kernels.h"
#include "physics/state/state.h"

namespace pneuma::physics {

/// What the matrix of a step of length s depends on.
struct ImplicitConstants {
  std::shared_ptr<const Mesh> mesh;
  double s = 0.0;                       // s
  double vertex_mass_kg = 0.0;          // the mean
  double pressure_stiffness_n_m = 0.0;  // of every edge, beside its spring's
  MatrixBounds bounds;                  // of the forces
  std::vector<std::uint8_t> pinned;
  std::vector<double> mass_shares;  // SoftState's

  template <class Real>
  static ImplicitConstants of(const SoftState<Real>& body, const Surroundings& surroundings, double s,
                              double pressure_stiffness_n_m = 0.0);
  /// Meshes are equal by what they hold.
  bool operator==(const ImplicitConstants& other) const;
};

/// M and what the forces bound their tangents by.
struct ImplicitMatrix {
  ImplicitConstants constants;
  std::vector<double> diagonal;                        // mass, and what holds single vertices
  double least_share = 1.0;                            // of the mean mass, of any vertex
  std::vector<std::array<std::uint32_t, 2>> opposite;  // opposite_vertices, of closed meshes
  SparseCholesky factor;
  std::vector<double> diagonal_by_place;    // the diagonal in the factor's order
  std::vector<EdgePlaces> edge_places;      // one an edge of the mesh
  std::unique_ptr<InverseColumns> inverse;  // of the factored matrix

  [[nodiscard]] std::size_t bytes() const;
};
using ImplicitMatrixPtr = std::shared_ptr<const ImplicitMatrix>;

/// What a body holds: for its steps, for passes with contact, and for steps of implicit Euler where its own method is
/// another. Null until it had one.
struct HeldMatrices {
  ImplicitMatrixPtr steps;
  ImplicitMatrixPtr touching;
  ImplicitMatrixPtr first_order;
};

/// The matrices of one world's bodies, which hold them. For any thread.
class ImplicitMatrices {
 public:
  /// Sets `held` to the body's matrix for steps of s, where it is not that already: one that another body holds, or a
  /// new one. Null where there is none: the matrix could not be factored. `pressure_stiffness_n_m`: what the gas may
  /// take from each edge's stiffness, as a bound from above; it is rounded up, so that it seldom asks for a new matrix.
  template <class Real>
  void update(ImplicitMatrixPtr& held, const SoftState<Real>& body, const Surroundings& surroundings, double s,
              double pressure_stiffness_n_m = 0.0);

  /// Sets `held` to what another body held under an earlier plan, where that is what this one would factor again.
  /// `others` has each once.
  template <class Real>
  void take_over(HeldMatrices& held, const SoftState<Real>& body, const Surroundings& surroundings,
                 std::span<const HeldMatrices> others);

  /// Of all that are held, each once.
  [[nodiscard]] std::size_t bytes() const;

 private:
  [[nodiscard]] ImplicitMatrixPtr find(const ImplicitConstants& constants) const;
  void add(const ImplicitMatrixPtr& matrix);

  mutable std::mutex mutex_;
  std::vector<std::weak_ptr<const ImplicitMatrix>> matrices_;
};

}  // namespace pneuma::physics
