// The bound kernels' one source. Include only where PNEUMA_LANES names the instruction set that the file is compiled
// for, as with lane_pack.h. The formulas are those of distance_bound_m (closest.cpp).
#pragma once

#include "physics/contact/bound_kernels.h"
#include "physics/lanes/lane_pack.h"

namespace pneuma::physics {
inline namespace PNEUMA_LANES {

// Of the product of two edges' squared lengths: below this their common normal is too rough for the safety below.
constexpr float sliver_share = 1e-3F;
// Below this, m^4, a product of edges has lost its digits.
constexpr float across_min_m4 = 1e-35F;
// What single precision may make of a bound: of itself, and of the edges' lengths. Four times the sum of its roundings
// where the sine of the edges' angle is the root of sliver_share.
constexpr float safe_bound_share = 1.0F - 0x1p-10F;
constexpr float safe_edge_share = 0x1p-14F;

template <class P>
struct PackVector {
  P x, y, z;

  static PackVector load(const FeatureBlock& block, std::size_t point, std::size_t lane) {
    return {P::load(block.points[3 * point] + lane), P::load(block.points[3 * point + 1] + lane),
            P::load(block.points[3 * point + 2] + lane)};
  }
  friend PackVector operator-(const PackVector& a, const PackVector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend PackVector operator*(const P& scale, const PackVector& a) { return {scale * a.x, scale * a.y, scale * a.z}; }
  [[nodiscard]] P dot(const PackVector& b) const { return x * b.x + y * b.y + z * b.z; }
  [[nodiscard]] PackVector cross(const PackVector& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
};

// The larger of two that are not negative.
template <class P>
P larger(const P& a, const P& b) {
  return largest(a, b);
}

template <class P>
P safe_bound(const P& bound_m, const P& edges_m2, const P& across_m4, const P& product_m4) {
  const P less = P::all(safe_bound_share) * bound_m - P::all(safe_edge_share) * sqrt(edges_m2);
  const P known = where_positive(across_m4 - P::all(across_min_m4), where_positive(less, less));
  return where_positive(across_m4 - P::all(sliver_share) * product_m4, known);
}

template <class P>
P vertex_face_bound(const FeatureBlock& block, std::size_t lane) {
  using V = PackVector<P>;
  const V a = V::load(block, 0, lane);
  const V b = V::load(block, 1, lane);
  const V c = V::load(block, 2, lane);
  const V ab = b - a;
  const V bc = c - b;
  const V ca = a - c;
  const V across = ca.cross(ab);
  const P across_m4 = across.dot(across);
  const V normal = (P::all(1.0F) / sqrt(across_m4)) * across;
  const P ab_m2 = ab.dot(ab);
  const P ca_m2 = ca.dot(ca);
  const P above = normal.dot(a);
  const auto beyond_m2 = [&](const V& edge, const V& start, const P& edge_m2) {
    const P outside = normal.dot(edge.cross(start));  // the point is at the origin
    return where_positive(outside, outside * outside / edge_m2);
  };
  const P beside_m2 = larger(larger(beyond_m2(ab, a, ab_m2), beyond_m2(bc, b, bc.dot(bc))), beyond_m2(ca, c, ca_m2));
  return safe_bound(sqrt(above * above + beside_m2), ab_m2 + ca_m2, across_m4, ab_m2 * ca_m2);
}

template <class P>
P edge_edge_bound(const FeatureBlock& block, std::size_t lane) {
  using V = PackVector<P>;
  const V first = V::load(block, 0, lane);
  const V apart = V::load(block, 1, lane);
  const V second = V::load(block, 2, lane) - apart;
  const V across = first.cross(second);
  const P across_m4 = across.dot(across);
  const P across_m2 = sqrt(across_m4);
  const V normal = (P::all(1.0F) / across_m2) * across;
  const P first_m2 = first.dot(first);
  const P second_m2 = second.dot(second);
  const P above = normal.dot(apart);
  const auto beyond_m2 = [&](const V& other, const P& other_m2) {
    const P along = normal.dot(apart.cross(other));
    const P before = P::all(0.0F) - along;
    const P after = along - across_m2;
    const P outside = where_positive(before, before) + where_positive(after, after);  // one of them at most
    return outside * outside / other_m2;
  };
  const P beside_m2 = larger(beyond_m2(second, second_m2), beyond_m2(first, first_m2));
  return safe_bound(sqrt(above * above + beside_m2), first_m2 + second_m2, across_m4, first_m2 * second_m2);
}

template <class P>
void bound_vertex_faces(const FeatureBlock* blocks, std::size_t count, float* bounds_m) {
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t lane = 0; lane < FeatureBlock::width; lane += P::width) {
      vertex_face_bound<P>(blocks[i], lane).store(bounds_m + i * FeatureBlock::width + lane);
    }
  }
}

template <class P>
void bound_edge_edges(const FeatureBlock* blocks, std::size_t count, float* bounds_m) {
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t lane = 0; lane < FeatureBlock::width; lane += P::width) {
      edge_edge_bound<P>(blocks[i], lane).store(bounds_m + i * FeatureBlock::width + lane);
    }
  }
}

template <class P>
consteval BoundKernels list_bound_kernels() {
  return {&bound_vertex_faces<P>, &bound_edge_edges<P>};
}

}  // namespace PNEUMA_LANES
}  // namespace pneuma::physics
