// Distances between the features of triangle meshes, and how far four points may move before two of them meet.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// The two kinds of features that touch first when surfaces do.
enum class FeaturePair { vertex_face, edge_edge };

/// Four points: a vertex and the three of a face, or the two ends of an edge and those of another.
using FourPoints = std::array<Vec3d, 4>;

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
/// The furthest that a point of one of the two features moves as seen from one of the other.
[[nodiscard]] double largest_relative_move_m(FeaturePair pair, const FourPoints& moves);

/// The share of the moves up to which the two features stay at least `margin_m` apart; 1: all of it. The points start
/// at least that far apart. Conservative advancement: no point comes nearer by more than the largest relative move, so
/// a share never passes through a contact. (Li, Kaufman, Jiang, "Codimensional Incremental Potential Contact", 2021.)
[[nodiscard]] double safe_share(FeaturePair pair, const FourPoints& start, const FourPoints& moves, double margin_m);

}  // namespace pneuma::physics
