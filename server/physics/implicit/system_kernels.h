// The inner loops of conjugate gradients (implicit_system.h). One source (system_kernel_source.h), compiled for each
// instruction set as the lane kernels are; all do the same operations on each number in the same order.
#pragma once

#include <cstddef>
#include <cstdint>

#include "physics/forces/edge_tangent.h"
#include "physics/implicit/factor_kernels.h"

namespace pneuma::physics {

/// A vertex's x, y, z and a 0, in the order of the factor's rows.
using MotionRow = FactorRow<4>;

/// An edge's first and second vertex, as places in that order.
struct EdgePlaces {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
};

struct SystemKernels {
  /// Adds the tangents times u, edge by edge.
  void (*add_edge_products)(const EdgeTangent* tangents, const EdgePlaces* edges, std::size_t count, const MotionRow* u,
                            MotionRow* product) = nullptr;
  double (*dot)(const MotionRow* a, const MotionRow* b, std::size_t count) = nullptr;
  /// to = diagonal u
  void (*scale_each)(const double* diagonal, const MotionRow* u, std::size_t count, MotionRow* to) = nullptr;
  /// to += share x
  void (*add)(double share, const MotionRow* x, std::size_t count, MotionRow* to) = nullptr;
  /// to = x + share to
  void (*add_to)(const MotionRow* x, double share, std::size_t count, MotionRow* to) = nullptr;
};

enum class Isa;
/// has_isa(isa).
[[nodiscard]] const SystemKernels& system_kernels(Isa isa);

}  // namespace pneuma::physics
