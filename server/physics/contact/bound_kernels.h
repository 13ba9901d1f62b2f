// Lower bounds on the distances between features of triangle meshes, many at a time. One source
// (bound_kernel_source.h), compiled for each instruction set as the lane kernels are; all do the same operations on
// each number in the same order.
#pragma once

#include <cstddef>

namespace pneuma::physics {

/// Sixteen pairs of features side by side: x, y, z of the second, third and fourth point as seen from the first (see
/// FourPoints), m.
struct alignas(64) FeatureBlock {
  static constexpr std::size_t width = 16;
  float points[9][width];
};

/// Each writes FeatureBlock::width bounds a block, m: no more than the distance, and 0 where single precision cannot
/// tell (slivers, edges that are nearly parallel).
struct BoundKernels {
  void (*vertex_face)(const FeatureBlock* blocks, std::size_t count, float* bounds_m) = nullptr;
  void (*edge_edge)(const FeatureBlock* blocks, std::size_t count, float* bounds_m) = nullptr;
};

enum class Isa;
/// has_isa(isa).
[[nodiscard]] const BoundKernels& bound_kernels(Isa isa);

}  // namespace pneuma::physics
