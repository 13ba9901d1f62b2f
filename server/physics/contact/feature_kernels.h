// What contact asks of the features of triangle meshes, many at a time: which boxes overlap, and where features are
// nearest. One source (feature_kernel_source.h), compiled for each instruction set as the lane kernels are; all do the
// same operations on each number in the same order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace pneuma::physics {

/// Eight pairs of features side by side: x, y, z of the second, third and fourth point as seen from the first (see
/// FourPoints), m.
struct alignas(64) FeatureBlock {
  static constexpr std::size_t width = 8;
  double points[9][width];
};

/// What is nearest of each of them: as nearest_of_face and nearest_of_edges (closest.h) find it. Slivers and edges that
/// are all but parallel may differ by a millionth of their size, others by last digits.
struct alignas(64) NearestBlock {
  double distances_m[FeatureBlock::width];
  double apart_m[3][FeatureBlock::width];  // x, y, z from the second feature's point to the first's
  // Of a face: its corners' weights. Of edges: the shares of the way along the first and the second, and 1 where no end
  // of either is nearest, or 0.
  double shares[3][FeatureBlock::width];
};

/// Boxes side by side: the low x, y and z of all, then the high ones. Their number is a multiple of
/// FeatureBlock::width.
struct BoxRows {
  std::array<const double*, 6> sides{};
  std::size_t count = 0;
};

struct FeatureKernels {
  void (*vertex_face)(const FeatureBlock* blocks, std::size_t count, NearestBlock* nearest) = nullptr;
  void (*edge_edge)(const FeatureBlock* blocks, std::size_t count, NearestBlock* nearest) = nullptr;
  /// Writes which of the boxes overlap one, in order; `which` has room for all. Returns their number.
  std::size_t (*overlapping)(const std::array<double, 6>& box, const BoxRows& boxes, std::uint32_t* which) = nullptr;
};

enum class Isa;
/// has_isa(isa).
[[nodiscard]] const FeatureKernels& feature_kernels(Isa isa);

}  // namespace pneuma::physics
