// Which features of surfaces come near each other on their way, found by looking at all of them.
#pragma once

#include <set>
#include <span>
#include <tuple>
#include <utility>

#include "physics/contact/surface_body.h"
#include "unit/physics/contact/surface_rig.h"

namespace pneuma::physics {

/// What a candidate names: the kind, then each feature with its body.
using NamedPair = std::tuple<FeaturePair, std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>;

inline NamedPair name_of(const SurfacePair& pair, const Candidate& candidate) {
  std::pair first(candidate.swapped ? pair.second : pair.first, candidate.first);
  std::pair second(candidate.swapped ? pair.first : pair.second, candidate.second);
  if (candidate.pair == FeaturePair::edge_edge && second < first) std::swap(first, second);
  return {candidate.pair, first.first, first.second, second.first, second.second};
}

inline bool share_a_vertex(const FeatureCorners& corners, FeaturePair kind) {
  const std::size_t of_first = kind == FeaturePair::vertex_face ? 1 : 2;
  for (std::size_t i = 0; i < of_first; ++i) {
    for (std::size_t j = of_first; j < 4; ++j) {
      if (corners.bodies[i] == corners.bodies[j] && corners.vertices[i] == corners.vertices[j]) return true;
    }
  }
  return false;
}

inline bool come_near(FeaturePair kind, const FeatureCorners& corners, std::span<const SurfaceBody> bodies,
                      double near_m) {
  const FourPoints start = corners.start(bodies);
  const FourPoints moves = corners.moves(bodies);
  if (distance_m(kind, start) > near_m + largest_relative_move_m(kind, moves)) return false;
  constexpr int times = 16;
  for (int k = 0; k <= times; ++k) {
    FourPoints now = start;
    for (std::size_t i = 0; i < 4; ++i) now[i] += static_cast<double>(k) / times * moves[i];
    if (distance_m(kind, now) <= near_m) return true;
  }
  return false;
}

/// Of all features of the two, those that come near, by looking at each.
inline std::set<NamedPair> near_features(const SurfacePair& pair, std::span<const SurfaceBody> bodies, double near_m) {
  std::set<NamedPair> near;
  const auto look = [&](FeaturePair kind, bool swapped, std::uint32_t first, std::uint32_t second) {
    const Candidate candidate = make_candidate(kind, swapped, first, second, pair, bodies);
    const FeatureCorners corners = corners_of(pair, candidate);
    if (share_a_vertex(corners, kind) || !come_near(kind, corners, bodies, near_m)) return;
    near.insert(name_of(pair, candidate));
  };
  const Mesh& a = *bodies[pair.first].topology->mesh;
  const Mesh& b = *bodies[pair.second].topology->mesh;
  for (std::uint32_t v = 0; v < a.positions_m.size(); ++v) {
    for (std::uint32_t f = 0; f < b.faces.size(); ++f) look(FeaturePair::vertex_face, false, v, f);
  }
  for (std::uint32_t v = 0; v < b.positions_m.size() && pair.first != pair.second; ++v) {
    for (std::uint32_t f = 0; f < a.faces.size(); ++f) look(FeaturePair::vertex_face, true, v, f);
  }
  for (std::uint32_t e = 0; e < a.edges.size(); ++e) {
    for (std::uint32_t f = 0; f < b.edges.size(); ++f) look(FeaturePair::edge_edge, false, e, f);
  }
  return near;
}

}  // namespace pneuma::physics
