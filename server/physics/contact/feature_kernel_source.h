// The one source of the feature kernels. Include only where PNEUMA_LANES names the instruction set that the
// file is compiled for, as with lane_pack.h. The ways are those of closest.cpp, without branches.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "physics/contact/closest.h"
#include "physics/contact/feature_kernels.h"
#include "physics/lanes/lane_pack.h"

namespace pneuma::physics {
inline namespace PNEUMA_LANES {

template <class P>
struct PackVector {
  P x, y, z;

  static PackVector load(const FeatureBlock& block, std::size_t point, std::size_t lane) {
    return {P::load(block.points[3 * point] + lane), P::load(block.points[3 * point + 1] + lane),
            P::load(block.points[3 * point + 2] + lane)};
  }
  friend PackVector operator+(const PackVector& a, const PackVector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend PackVector operator-(const PackVector& a, const PackVector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend PackVector operator*(const P& scale, const PackVector& a) { return {scale * a.x, scale * a.y, scale * a.z}; }
  [[nodiscard]] P dot(const PackVector& b) const { return x * b.x + y * b.y + z * b.z; }
  [[nodiscard]] P squared() const { return dot(*this); }
  [[nodiscard]] PackVector cross(const PackVector& b) const {
    return {y * b.z - z * b.y, z * b.x - x * b.z, x * b.y - y * b.x};
  }
};

template <class P>
P smaller_of(const P& a, const P& b) {
  return choose(b - a, a, b);
}

// The share of the way from its start at which the segment is nearest to a point that is seen from there.
template <class P>
P share_of_way(const PackVector<P>& way, const P& way_m2, const PackVector<P>& point) {
  const P zero = P::all(0.0);
  const P one = P::all(1.0);
  const P share = choose(way_m2, way.dot(point) / way_m2, zero);
  return choose(share, smaller_of(share, one), zero);
}

template <class P>
void store_nearest(NearestBlock& nearest, std::size_t lane, const P& squared_m2, const PackVector<P>& apart,
                   const P& first, const P& second, const P& third) {
  sqrt(squared_m2).store(nearest.distances_m + lane);
  apart.x.store(nearest.apart_m[0] + lane);
  apart.y.store(nearest.apart_m[1] + lane);
  apart.z.store(nearest.apart_m[2] + lane);
  first.store(nearest.shares[0] + lane);
  second.store(nearest.shares[1] + lane);
  third.store(nearest.shares[2] + lane);
}

// The point is at the origin.
template <class P>
void nearest_vertex_face(const FeatureBlock& block, std::size_t lane, NearestBlock& nearest) {
  using V = PackVector<P>;
  const P zero = P::all(0.0);
  const P one = P::all(1.0);
  const P least = P::all(share_min);
  const V a = V::load(block, 0, lane);
  const V b = V::load(block, 1, lane);
  const V c = V::load(block, 2, lane);
  const V origin{zero, zero, zero};
  struct OnEdge {
    P share, squared_m2;
  };
  const auto on_edge = [&](const V& start, const V& way) -> OnEdge {
    const P share = share_of_way(way, way.squared(), origin - start);
    const P snapped = choose(share - (one - least), one, choose(least - share, zero, share));
    return {snapped, (start + share * way).squared()};
  };
  const V ab = b - a;
  const V ac = c - a;
  const OnEdge first = on_edge(a, ab);
  const OnEdge second = on_edge(b, c - b);
  const OnEdge third = on_edge(c, a - c);
  P of_a = one - first.share;
  P of_b = first.share;
  P of_c = zero;
  P best_m2 = first.squared_m2;
  const auto take = [&](const P& is_nearer, const P& squared_m2, const P& a_share, const P& b_share, const P& c_share) {
    of_a = choose(is_nearer, a_share, of_a);
    of_b = choose(is_nearer, b_share, of_b);
    of_c = choose(is_nearer, c_share, of_c);
    best_m2 = choose(is_nearer, squared_m2, best_m2);
  };
  take(best_m2 - second.squared_m2, second.squared_m2, zero, one - second.share, second.share);
  take(best_m2 - third.squared_m2, third.squared_m2, third.share, zero, one - third.share);

  const V normal = ab.cross(ac);
  const P normal_m4 = normal.squared();  // 0 of what has no area: the shares are no numbers then, and not taken
  const V point = origin - a;
  const P inner_b = normal.dot(point.cross(ac)) / normal_m4;
  const P inner_c = normal.dot(ab.cross(point)) / normal_m4;
  const P inner_a = one - inner_b - inner_c;
  const P inner_m2 = (inner_a * a + inner_b * b + inner_c * c).squared();  // of slivers more exact than their planes
  const P innermost = smaller_of(smaller_of(inner_b, inner_c), inner_a);
  take(choose(innermost - least, best_m2 - inner_m2, zero), inner_m2, inner_a, inner_b, inner_c);

  store_nearest(nearest, lane, best_m2, origin - (of_a * a + of_b * b + of_c * c), of_a, of_b, of_c);
}

// The first edge begins at the origin.
template <class P>
void nearest_edge_edge(const FeatureBlock& block, std::size_t lane, NearestBlock& nearest) {
  using V = PackVector<P>;
  const P zero = P::all(0.0);
  const P one = P::all(1.0);
  const P least = P::all(share_min);
  const V first = V::load(block, 0, lane);
  const V start = V::load(block, 1, lane);
  const V second = V::load(block, 2, lane) - start;
  const V origin{zero, zero, zero};
  const P first_m2 = first.squared();
  const P second_m2 = second.squared();
  const auto squared_between = [&](const P& along_first, const P& along_second) {
    return (along_first * first - start - along_second * second).squared();
  };
  P along_first = zero;
  P along_second = share_of_way(second, second_m2, origin - start);
  P within = zero;
  P best_m2 = squared_between(along_first, along_second);
  const auto take = [&](const P& of_first, const P& of_second, const P& squared_m2, const P& is_nearer) {
    along_first = choose(is_nearer, of_first, along_first);
    along_second = choose(is_nearer, of_second, along_second);
    best_m2 = choose(is_nearer, squared_m2, best_m2);
  };
  const auto try_end = [&](const P& of_first, const P& of_second) {
    const P squared_m2 = squared_between(of_first, of_second);
    take(of_first, of_second, squared_m2, best_m2 - squared_m2);
  };
  try_end(share_of_way(first, first_m2, start), zero);
  try_end(one, share_of_way(second, second_m2, first - start));
  try_end(share_of_way(first, first_m2, start + second), one);

  const P both_m2 = first.dot(second);
  const P determinant = first_m2 * second_m2 - both_m2 * both_m2;
  const P of_first = zero - first.dot(start);
  const P of_second = zero - second.dot(start);
  const P inner_first = (both_m2 * of_second - second_m2 * of_first) / determinant;
  const P inner_second = (first_m2 * of_second - both_m2 * of_first) / determinant;
  const P outermost =
      smaller_of(smaller_of(inner_first, one - inner_first), smaller_of(inner_second, one - inner_second));
  const P squared_m2 = squared_between(inner_first, inner_second);
  const P is_across = determinant - P::all(parallel_share) * first_m2 * second_m2;
  const P is_nearer = choose(is_across, choose(outermost - least, best_m2 - squared_m2, zero), zero);
  take(inner_first, inner_second, squared_m2, is_nearer);
  within = choose(is_nearer, one, zero);

  store_nearest(nearest, lane, best_m2, along_first * first - start - along_second * second, along_first, along_second,
                within);
}

template <class P>
void nearest_vertex_faces(const FeatureBlock* blocks, std::size_t count, NearestBlock* nearest) {
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t lane = 0; lane < FeatureBlock::width; lane += P::width) {
      nearest_vertex_face<P>(blocks[i], lane, nearest[i]);
    }
  }
}

template <class P>
void nearest_edge_edges(const FeatureBlock* blocks, std::size_t count, NearestBlock* nearest) {
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t lane = 0; lane < FeatureBlock::width; lane += P::width) {
      nearest_edge_edge<P>(blocks[i], lane, nearest[i]);
    }
  }
}

template <class P>
std::size_t find_overlapping(const std::array<double, 6>& box, const BoxRows& boxes, std::uint32_t* which) {
  const std::array<P, 6> sides{P::all(box[0]), P::all(box[1]), P::all(box[2]),
                               P::all(box[3]), P::all(box[4]), P::all(box[5])};
  std::size_t found = 0;
  for (std::size_t first = 0; first < boxes.count; first += P::width) {
    std::uint32_t bits = ~0U;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      bits &= at_most(P::load(boxes.sides[axis] + first), sides[axis + 3]);
      bits &= at_most(sides[axis], P::load(boxes.sides[axis + 3] + first));
    }
    for (; bits != 0; bits &= bits - 1) {
      which[found++] = static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(__builtin_ctz(bits));
    }
  }
  return found;
}

template <class P>
consteval FeatureKernels list_feature_kernels() {
  return {&nearest_vertex_faces<P>, &nearest_edge_edges<P>, &find_overlapping<P>};
}

}  // namespace PNEUMA_LANES
}  // namespace pneuma::physics
