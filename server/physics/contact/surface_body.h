// A soft body as contact of surfaces sees it in one substep: in double, whatever the body steps in.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "physics/contact/closest.h"
#include "physics/contact/surface_tree.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// How vertices have moved: all by the shift, and each by no more than the path beside it.
struct SurfaceDrift {
  Vec3d shift_m = Vec3d::Zero();
  double path_m = 0.0;
};
/// Of `count` moves, by their index.
template <class Move>
[[nodiscard]] SurfaceDrift drift_of(std::size_t count, const Move& move_m) {
  SurfaceDrift drift;
  for (std::size_t i = 0; i < count; ++i) drift.shift_m += move_m(i);
  drift.shift_m /= static_cast<double>(count);
  double furthest_m2 = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    furthest_m2 = std::max(furthest_m2, (move_m(i) - drift.shift_m).squaredNorm());
  }
  drift.path_m = std::sqrt(furthest_m2);
  return drift;
}
/// The most that a vertex of one has moved towards one of the other.
[[nodiscard]] inline double between_m(const SurfaceDrift& a, const SurfaceDrift& b) {
  return (a.shift_m - b.shift_m).norm() + a.path_m + b.path_m;
}

struct SurfaceBody {
  std::shared_ptr<const SurfaceTopology> topology;
  Surface surface;
  double spacing_m = 0.0;                   // of the vertices, on average
  double shell_m = 0.0;                     // that it keeps free around itself; two surfaces keep the sum of theirs
  std::vector<double> inverse_masses_1_kg;  // one a vertex; 0 of pinned ones
  // One a vertex, of bodies that are near others in this substep.
  std::vector<Vec3d> from;   // where the substep finds it, m; nothing crosses there
  std::vector<Vec3d> to;     // where it would end
  std::vector<double> cuts;  // the share of its move that it may make
  // Vertices that nothing but surfaces holds: they may be taken along by those that they meet. Empty: none.
  std::vector<std::uint8_t> free;
  std::vector<Vec3d> drifts;         // what they are taken along by, which is not cut, m; empty: nothing
  SurfaceDrift substep;              // of the move of the substep that it was loaded in
  std::vector<Vec3d> boxed_to;       // `to` as the candidates were found for it
  std::vector<std::uint8_t> astray;  // vertices that end too far beside that way
  bool any_astray = false;
  Box at;                 // of all vertices where the substep finds them
  Box way;                // of all vertices, grown by margin_m
  double slack_m = 0.0;   // what `to` may differ by from boxed_to
  double margin_m = 0.0;  // the shell, with the room beyond it that rows see, and the slack
  SurfaceBoxes boxes;     // of bodies that meet themselves

  [[nodiscard]] Vec3d move_m(std::uint32_t vertex) const { return to[vertex] - from[vertex]; }
  /// As far as it may go.
  [[nodiscard]] Vec3d cut_move_m(std::uint32_t vertex) const {
    if (drifts.empty()) return cuts[vertex] * move_m(vertex);
    return drifts[vertex] + cuts[vertex] * (move_m(vertex) - drifts[vertex]);
  }
  [[nodiscard]] Box box_of_moves() const {
    Box box;
    for (const Vec3d& at : from) box.include(at);
    for (const Vec3d& at : to) box.include(at);
    return box;
  }
  [[nodiscard]] std::size_t bytes() const {
    return (from.capacity() + to.capacity() + boxed_to.capacity() + drifts.capacity()) * sizeof(Vec3d) +
           (inverse_masses_1_kg.capacity() + cuts.capacity()) * sizeof(double) + astray.capacity() + free.capacity() +
           (boxes.nodes.capacity() + boxes.faces.capacity()) * sizeof(Box);
  }
};

struct SurfacePair;

/// A vertex (or an edge) of one surface and a face (or an edge) of the other that may meet.
struct Candidate {
  FeaturePair pair = FeaturePair::vertex_face;
  bool swapped = false;  // the first feature is of the pair's second body
  std::uint32_t first = 0;
  std::uint32_t second = 0;
  std::array<std::uint32_t, 4> corners{};  // vertices: those of the first feature come first
  // As last measured (FeatureMeasures).
  double apart_m = 0.0;
  Vec3d apart = Vec3d::Zero();     // unit, from the second's nearest point to the first's; 0 where they have none
  std::array<double, 3> shares{};  // see NearestBlock
};

/// Two bodies, or one and itself (`first == second`), and the features of theirs that may meet in this substep.
struct SurfacePair {
  std::uint32_t first = 0;
  std::uint32_t second = 0;
  std::vector<Candidate> candidates = {};
};

/// The distance that the two surfaces of a pair keep.
[[nodiscard]] double kept_distance_m(const SurfacePair& pair, std::span<const SurfaceBody> bodies);

/// A candidate's four vertices, as (body, vertex): those of the first feature first.
struct FeatureCorners {
  std::array<std::uint32_t, 4> bodies{};
  std::array<std::uint32_t, 4> vertices{};

  [[nodiscard]] FourPoints start(std::span<const SurfaceBody> all) const {
    FourPoints points;
    for (std::size_t i = 0; i < 4; ++i) points[i] = all[bodies[i]].from[vertices[i]];
    return points;
  }
  /// As far as the bodies' cuts allow.
  [[nodiscard]] FourPoints moves(std::span<const SurfaceBody> all) const {
    FourPoints points;
    for (std::size_t i = 0; i < 4; ++i) {
      points[i] = all[bodies[i]].cut_move_m(vertices[i]);
    }
    return points;
  }
};
[[nodiscard]] inline FeatureCorners corners_of(const SurfacePair& pair, const Candidate& candidate) {
  const std::uint32_t first = candidate.swapped ? pair.second : pair.first;
  const std::uint32_t second = candidate.swapped ? pair.first : pair.second;
  return {{first, candidate.pair == FeaturePair::vertex_face ? second : first, second, second}, candidate.corners};
}

}  // namespace pneuma::physics
