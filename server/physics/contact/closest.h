// Distances between the features of triangle meshes, and how far four points may move before two of them meet.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// The two kinds of features that touch first when surfaces do.
enum class FeaturePair { vertex_face, edge_edge };

/// Four points: a vertex and the three of a face, or the two ends of an edge and those of another.
using FourPoints = std::array<Vec3d, 4>;

/// Shares of a face or an edge below this are none: the point is on its border.
inline constexpr double share_min = 1e-9;
/// Of the product of two edges' squared lengths: edges that are nearer to parallel than this meet at their ends.
inline constexpr double parallel_share = 1e-12;

/// How much of each of a face's corners makes up a point of it; they sum to 1.
struct FacePoint {
  std::array<double, 3> weights{};
  double distance_m = 0.0;

  /// One bit a corner that has a share: 7 inside the face, one of 1, 2, 4 at a corner.
  [[nodiscard]] std::uint32_t corners() const {
    return (weights[0] > 0.0 ? 1U : 0U) | (weights[1] > 0.0 ? 2U : 0U) | (weights[2] > 0.0 ? 4U : 0U);
  }
};
/// The point of face abc that is nearest to p. Slivers and faces without area count as the segments that they are.
[[nodiscard]] FacePoint nearest_of_face(const Vec3d& p, const Vec3d& a, const Vec3d& b, const Vec3d& c);

/// Where two edges are nearest: shares of the way along each.
struct EdgePoints {
  double along_first = 0.0;
  double along_second = 0.0;
  double distance_m = 0.0;
  bool within_both = false;  // no end of either is nearest
};
[[nodiscard]] EdgePoints nearest_of_edges(const Vec3d& a0, const Vec3d& a1, const Vec3d& b0, const Vec3d& b1);

[[nodiscard]] double distance_m(FeaturePair pair, const FourPoints& points);
/// No more than the distance, nearly always little less, and found sooner.
[[nodiscard]] double distance_bound_m(FeaturePair pair, const FourPoints& points);
/// The furthest that a point of one of the two features moves as seen from one of the other; squared.
[[nodiscard]] inline double largest_relative_move_m2(FeaturePair pair, const FourPoints& moves) {
  double squared = 0.0;
  const std::size_t first_count = pair == FeaturePair::vertex_face ? 1 : 2;
  for (std::size_t i = 0; i < first_count; ++i) {
    for (std::size_t j = first_count; j < 4; ++j) squared = std::max(squared, (moves[i] - moves[j]).squaredNorm());
  }
  return squared;
}
[[nodiscard]] inline double largest_relative_move_m(FeaturePair pair, const FourPoints& moves) {
  return std::sqrt(largest_relative_move_m2(pair, moves));
}

/// The share of the moves up to which the two features stay at least `margin_m` apart; 1: all of it. The points start
/// at least that far apart. Conservative advancement: no point comes nearer by more than the largest relative move, so
/// a share never passes through a contact. (Li, Kaufman, Jiang, "Codimensional Incremental Potential Contact", 2021.)
[[nodiscard]] double safe_share(FeaturePair pair, const FourPoints& start, const FourPoints& moves, double margin_m);

}  // namespace pneuma::physics
