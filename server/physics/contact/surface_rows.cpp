#include "physics/contact/surface_rows.h"

#include <algorithm>
#include <array>
#include <limits>
#include <tuple>
#include <utility>

#include "physics/rigid/contact_surface.h"

namespace pneuma::physics {
namespace {

constexpr std::uint64_t no_corner = 0xffff;

// A vertex's body and index.
using Corner = std::pair<std::uint32_t, std::uint32_t>;

FeatureKey key_of(FeatureKind kind, std::uint32_t first, std::uint32_t second,
                  const std::array<std::uint64_t, 4>& parts) {
  return feature_key(kind, first, second, (parts[0] << 48U) | (parts[1] << 32U) | (parts[2] << 16U) | parts[3]);
}

// Of the corners that have a share, so that neighbouring faces name the edge or the vertex that they share alike.
FeatureKey key_of_vertex(const FeatureCorners& corners, const std::array<double, 3>& weights) {
  std::array<std::uint64_t, 4> parts{corners.vertices[0], no_corner, no_corner, no_corner};
  std::size_t count = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    if (weights[i] > 0.0) parts[count++] = corners.vertices[i + 1];
  }
  if (parts[1] > parts[2]) std::swap(parts[1], parts[2]);  // those without a share come last
  if (parts[2] > parts[3]) std::swap(parts[2], parts[3]);
  if (parts[1] > parts[2]) std::swap(parts[1], parts[2]);
  std::uint32_t first = corners.bodies[0];
  std::uint32_t second = corners.bodies[1];
  if (count == 2 && Corner(second, static_cast<std::uint32_t>(parts[1])) < Corner(first, corners.vertices[0])) {
    std::swap(first, second);
    std::swap(parts[0], parts[1]);
  }
  const FeatureKind kind = count == 4   ? FeatureKind::vertex_face
                           : count == 3 ? FeatureKind::vertex_edge
                                        : FeatureKind::vertex_vertex;
  return key_of(kind, first, second, parts);
}

FeatureKey key_of(const Candidate& candidate, const FeatureCorners& corners) {
  if (candidate.pair == FeaturePair::vertex_face) return key_of_vertex(corners, candidate.shares);
  const auto& v = corners.vertices;
  return key_of(FeatureKind::edge_edge, corners.bodies[0], corners.bodies[2], {v[0], v[1], v[2], v[3]});
}

// Of each corner, in the way from the second feature's nearest point to the first's.
std::array<double, 4> weights_of(const Candidate& candidate) {
  const auto& [a, b, c] = candidate.shares;
  if (candidate.pair == FeaturePair::vertex_face) return {1.0, -a, -b, -c};
  return {1.0 - a, a, b - 1.0, -b};
}

// Where an end of an edge is nearest, the row of a vertex says so.
bool has_point(const Candidate& candidate) {
  return !candidate.apart.isZero(0.0) && (candidate.pair == FeaturePair::vertex_face || candidate.shares[2] > 0.0);
}

double closing_m(const Candidate& candidate, const FeatureCorners& corners, std::span<const SurfaceBody> bodies) {
  const std::array<double, 4> weights = weights_of(candidate);
  Vec3d closing = Vec3d::Zero();
  for (std::size_t i = 0; i < 4; ++i) closing += weights[i] * bodies[corners.bodies[i]].move_m(corners.vertices[i]);
  return closing.dot(candidate.apart);
}

bool is_inside_face(const Candidate& candidate) {
  const auto& [a, b, c] = candidate.shares;
  return a > 0.0 && b > 0.0 && c > 0.0;
}

}  // namespace

void RowFinder::find_nearest(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  constexpr double nothing = std::numeric_limits<double>::infinity();
  nearest_m_[0].assign(bodies[pair.first].from.size(), nothing);
  nearest_m_[1].assign(bodies[pair.second].from.size(), nothing);
  for (const Candidate& candidate : pair.candidates) {
    if (candidate.pair != FeaturePair::vertex_face) continue;
    double& nearest = nearest_m_[candidate.swapped ? 1 : 0][candidate.corners[0]];
    nearest = std::min(nearest, candidate.apart_m);
  }
}

// A vertex over one face is near the edges of the next ones too, and sees these sideways: a row in that direction would
// stop it from sliding on.
bool RowFinder::is_beside(const Candidate& candidate) const {
  constexpr double last_digits = 1e-9;
  if (candidate.pair != FeaturePair::vertex_face || is_inside_face(candidate)) return false;
  const double nearest_m = nearest_m_[candidate.swapped ? 1 : 0][candidate.corners[0]];
  return candidate.apart_m > (1.0 + last_digits) * nearest_m;
}

void RowFinder::look(std::uint32_t index, std::span<const SurfacePair> pairs, std::span<const SurfaceBody> bodies) {
  const SurfacePair& pair = pairs[index];
  const double kept_m = kept_distance_m(pair, bodies);
  const double slack_m = row_slack_share * kept_m;
  find_nearest(pair, bodies);
  for (std::uint32_t i = 0; i < pair.candidates.size(); ++i) {
    const Candidate& candidate = pair.candidates[i];
    if (!has_point(candidate) || is_beside(candidate)) continue;
    const double gap_m = candidate.apart_m - kept_m;
    const FeatureCorners corners = corners_of(pair, candidate);
    if (gap_m > slack_m && gap_m + closing_m(candidate, corners, bodies) > slack_m) continue;
    found_.push_back({key_of(candidate, corners), gap_m, index, i});
  }
}

std::size_t RowFinder::find(std::span<const SurfacePair> pairs, std::span<const SurfaceBody> bodies) {
  found_.clear();
  for (std::uint32_t i = 0; i < pairs.size(); ++i) look(i, pairs, bodies);
  // Of those of one key the nearest comes first. Two that are as near differ in what they call first, or by a last
  // digit; their features tell them apart, in whatever order they were found.
  const auto features = [&](const Found& found) {
    const Candidate& candidate = pairs[found.pair].candidates[found.candidate];
    return std::tuple(candidate.pair, candidate.swapped, candidate.first, candidate.second);
  };
  std::ranges::sort(found_, [&](const Found& a, const Found& b) {
    if (a.key != b.key) return a.key < b.key;
    if (a.gap_m != b.gap_m) return a.gap_m < b.gap_m;
    return features(a) < features(b);
  });
  const auto repeated = std::ranges::unique(found_, {}, &Found::key);
  found_.erase(repeated.begin(), repeated.end());
  return found_.size();
}

std::size_t RowFinder::count_of(std::size_t pair) const {
  const auto is_of = [pair](const Found& found) { return found.pair == pair; };
  return static_cast<std::size_t>(std::ranges::count_if(found_, is_of));
}

void RowFinder::append(std::span<const SurfacePair> pairs, std::span<const SurfaceBody> bodies,
                       std::vector<ContactRow>& rows) const {
  for (const Found& found : found_) {
    const SurfacePair& pair = pairs[found.pair];
    const Candidate& candidate = pair.candidates[found.candidate];
    const FeatureCorners corners = corners_of(pair, candidate);
    const ContactSurface surface = combine(bodies[pair.first].surface, bodies[pair.second].surface);
    const std::array<double, 4> weights = weights_of(candidate);
    ContactRow& row = rows.emplace_back();
    row.key = found.key;
    row.normal = candidate.apart;
    row.gap_m = found.gap_m;
    row.first.body = corners.bodies[0];
    row.second.body = corners.bodies[3];
    for (std::size_t i = 0; i < 4; ++i) {
      if (weights[i] > 0.0) row.first.add(corners.vertices[i], weights[i]);
      if (weights[i] < 0.0) row.second.add(corners.vertices[i], -weights[i]);
    }
    row.friction = surface.friction;
    row.restitution = surface.restitution;
  }
}

}  // namespace pneuma::physics
