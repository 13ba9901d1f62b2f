#include "physics/contact/surface_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "physics/rigid/contact_surface.h"

namespace pneuma::physics {
namespace {

// Nearer than this, m, features have no direction apart.
constexpr double distance_min_m = 1e-12;

enum class RowKind : std::uint64_t { vertex_face, vertex_edge, vertex_vertex, edge_edge };

constexpr std::uint64_t no_corner = 0xffff;

// A vertex's body and index.
using Corner = std::pair<std::uint32_t, std::uint32_t>;

FeatureKey key_of(RowKind kind, std::uint32_t first, std::uint32_t second, const std::array<std::uint64_t, 4>& parts) {
  return {(static_cast<std::uint64_t>(first) << 32U) | (static_cast<std::uint64_t>(second) << 8U) |
              static_cast<std::uint64_t>(kind),
          (parts[0] << 48U) | (parts[1] << 32U) | (parts[2] << 16U) | parts[3]};
}

// Of the corners that have a share, so that neighbouring faces name the edge or the vertex that they share alike.
FeatureKey key_of_vertex(const FeatureCorners& corners, const FacePoint& nearest) {
  std::array<std::uint64_t, 4> parts{corners.vertices[0], no_corner, no_corner, no_corner};
  std::size_t count = 1;
  for (std::size_t i = 0; i < 3; ++i) {
    if (nearest.weights[i] > 0.0) parts[count++] = corners.vertices[i + 1];
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
  const RowKind kind = count == 4 ? RowKind::vertex_face : count == 3 ? RowKind::vertex_edge : RowKind::vertex_vertex;
  return key_of(kind, first, second, parts);
}

// Of rows of one key the nearest comes first. Two that are as near differ in what they call first, or by a last digit.
bool comes_before(const ContactRow& a, const ContactRow& b) {
  if (a.key != b.key) return a.key < b.key;
  if (a.gap_m != b.gap_m) return a.gap_m < b.gap_m;
  const auto parts = [](const ContactRow& row) {
    return std::tie(row.first.body, row.first.vertices, row.first.weights, row.second.vertices, row.second.weights);
  };
  return parts(a) < parts(b);
}

class RowFinder {
 public:
  RowFinder(std::span<const SurfaceBody> bodies, std::vector<ContactRow>& rows) : bodies_(bodies), rows_(rows) {}

  void find(SurfacePair& pair) {
    kept_m_ = kept_distance_m(pair, bodies_);
    surface_ = combine(bodies_[pair.first].surface, bodies_[pair.second].surface);
    const double reach_m = (1.0 + row_slack_share) * kept_m_;
    for (Candidate& candidate : pair.candidates) {
      const FeatureCorners corners = corners_of(pair, candidate, bodies_);
      const double move_m = largest_relative_move_m(candidate.pair, corners.moves(bodies_));
      if (candidate.apart_m - move_m > reach_m) continue;
      const FourPoints at = corners.start(bodies_);
      if (candidate.pair == FeaturePair::vertex_face) {
        add_vertex(candidate, corners, at);
      } else {
        add_edges(candidate, corners, at);
      }
    }
  }

 private:
  void add_vertex(Candidate& candidate, const FeatureCorners& corners, const FourPoints& at) {
    const FacePoint nearest = nearest_of_face(at[0], at[1], at[2], at[3]);
    const auto& w = nearest.weights;
    if (!measure(candidate, nearest.distance_m, at[0] - w[0] * at[1] - w[1] * at[2] - w[2] * at[3])) return;
    add(candidate, corners, {1.0, -w[0], -w[1], -w[2]}, [&] { return key_of_vertex(corners, nearest); });
  }

  // Where an end is nearest, a row of a vertex says so.
  void add_edges(Candidate& candidate, const FeatureCorners& corners, const FourPoints& at) {
    const EdgePoints nearest = nearest_of_edges(at[0], at[1], at[2], at[3]);
    const double s = nearest.along_first;
    const double t = nearest.along_second;
    if (!measure(candidate, nearest.distance_m, at[0] + s * (at[1] - at[0]) - at[2] - t * (at[3] - at[2]))) return;
    if (!nearest.within_both) return;
    add(candidate, corners, {1.0 - s, s, t - 1.0, -t}, [&] {
      const auto& v = corners.vertices;
      return key_of(RowKind::edge_edge, corners.bodies[0], corners.bodies[2], {v[0], v[1], v[2], v[3]});
    });
  }

  static bool measure(Candidate& candidate, double distance_m, const Vec3d& apart) {
    candidate.apart_m = distance_m;
    if (!(distance_m > distance_min_m)) return false;
    candidate.apart = apart / distance_m;
    return true;
  }

  template <class Key>
  void add(const Candidate& candidate, const FeatureCorners& corners, const std::array<double, 4>& weights,
           const Key& key) {
    ContactRow row;
    row.normal = candidate.apart;
    row.gap_m = candidate.apart_m - kept_m_;
    Vec3d closing = Vec3d::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      if (weights[i] != 0.0) closing += weights[i] * bodies_[corners.bodies[i]].move_m(corners.vertices[i]);
    }
    const double slack_m = row_slack_share * kept_m_;
    if (row.gap_m > slack_m && row.gap_m + closing.dot(row.normal) > slack_m) return;
    row.key = key();
    row.first.body = corners.bodies[0];
    row.second.body = corners.bodies[3];
    for (std::size_t i = 0; i < 4; ++i) {
      if (weights[i] > 0.0) row.first.add(corners.vertices[i], weights[i]);
      if (weights[i] < 0.0) row.second.add(corners.vertices[i], -weights[i]);
    }
    row.friction = surface_.friction;
    row.restitution = surface_.restitution;
    rows_.push_back(row);
  }

  std::span<const SurfaceBody> bodies_;
  std::vector<ContactRow>& rows_;
  double kept_m_ = 0.0;
  ContactSurface surface_;
};

}  // namespace

void find_surface_rows(std::span<SurfacePair> pairs, std::span<const SurfaceBody> bodies,
                       std::vector<ContactRow>& rows) {
  const auto first = static_cast<std::ptrdiff_t>(rows.size());
  RowFinder finder(bodies, rows);
  for (SurfacePair& pair : pairs) finder.find(pair);
  std::sort(rows.begin() + first, rows.end(), comes_before);
  const auto same = [](const ContactRow& a, const ContactRow& b) { return a.key == b.key; };
  rows.erase(std::unique(rows.begin() + first, rows.end(), same), rows.end());
}

}  // namespace pneuma::physics
