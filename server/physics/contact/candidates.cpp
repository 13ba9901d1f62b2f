#include "physics/contact/candidates.h"

#include <algorithm>

namespace pneuma::physics {
namespace {

template <std::size_t Size>
bool has(const std::array<std::uint32_t, Size>& list, std::uint32_t vertex) {
  return std::ranges::find(list, vertex) != list.end();
}

bool runs_through(const Vec3d& start, const Vec3d& end, const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const Vec3d normal = (b - a).cross(c - a);
  const double before = normal.dot(start - a);
  const double after = normal.dot(end - a);
  if (before * after > 0.0 || before == after) return false;
  const Vec3d at = start + before / (before - after) * (end - start);
  return normal.dot((b - a).cross(at - a)) >= 0.0 && normal.dot((c - b).cross(at - b)) >= 0.0 &&
         normal.dot((a - c).cross(at - c)) >= 0.0;
}

bool runs_through(const SurfaceBody& edges, std::uint32_t edge, const SurfaceBody& faces, std::uint32_t face) {
  const Edge& ends = edges.topology->mesh->edges[edge];
  const Face& corners = faces.topology->mesh->faces[face];
  return runs_through(edges.from[ends[0]], edges.from[ends[1]], faces.from[corners[0]], faces.from[corners[1]],
                      faces.from[corners[2]]);
}

// About the ways of an edge's ends, or of a vertex named twice.
Box way_box(const SurfaceBody& body, std::uint32_t start, std::uint32_t end) {
  const Vec3d margin = Vec3d::Constant(body.margin_m);
  return {body.from[start].cwiseMin(body.to[start]).cwiseMin(body.from[end]).cwiseMin(body.to[end]) - margin,
          body.from[start].cwiseMax(body.to[start]).cwiseMax(body.from[end]).cwiseMax(body.to[end]) + margin};
}

double highest_m(const SurfaceBody& body, const Vec3d& towards) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const Vec3d& at : body.from) highest = std::max(highest, towards.dot(at));
  for (const Vec3d& at : body.to) highest = std::max(highest, towards.dot(at));
  return highest;
}

}  // namespace

// The faces with a corner that comes as far as least_m, and whose box is in the region.
void CandidateFinder::take_near_faces(const SurfaceBody& body, const Vec3d& towards, double least_m, const Box& region,
                                      std::vector<double>& heights_m, std::vector<FaceBox>& near) {
  heights_m.resize(body.from.size());
  for (std::size_t i = 0; i < heights_m.size(); ++i) {
    heights_m[i] = std::max(towards.dot(body.from[i]), towards.dot(body.to[i]));
  }
  near.clear();
  const std::vector<Face>& faces = body.topology->mesh->faces;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const auto& [a, b, c] = faces[f];
    if (heights_m[a] < least_m && heights_m[b] < least_m && heights_m[c] < least_m) continue;
    const Box box = physics::way_box(faces[f], body.from, body.to, body.margin_m);
    if (box.overlaps(region)) near.push_back({f, box});
  }
  std::ranges::sort(near, {}, [](const FaceBox& face) { return std::pair(face.box.low.x(), face.face); });
}

// Most of two bodies that touch is told apart by one direction: from the middle of one to that of the other.
template <class Visit>
void CandidateFinder::for_near_faces(const SurfaceBody& a, const SurfaceBody& b, const Visit& visit) {
  const Vec3d between = (b.way.low + b.way.high) - (a.way.low + a.way.high);
  const Vec3d towards = between.isZero(0.0) ? Vec3d(Vec3d::UnitX()) : Vec3d(between.normalized());
  const double grown_m = a.margin_m + b.margin_m;
  take_near_faces(a, towards, -highest_m(b, -towards) - grown_m, b.way, heights_m_, near_a_);
  take_near_faces(b, -towards, -highest_m(a, towards) - grown_m, a.way, heights_m_, near_b_);
  // Sort and sweep of two lists.
  const auto sweep = [&](const std::vector<FaceBox>& firsts, const std::vector<FaceBox>& seconds, bool with_equal,
                         const auto& meet) {
    std::size_t begin = 0;
    for (const FaceBox& first : firsts) {
      const double low = first.box.low.x();
      while (begin < seconds.size() &&
             (with_equal ? seconds[begin].box.low.x() < low : seconds[begin].box.low.x() <= low)) {
        ++begin;
      }
      for (std::size_t k = begin; k < seconds.size() && seconds[k].box.low.x() <= first.box.high.x(); ++k) {
        if (first.box.overlaps(seconds[k].box)) meet(first, seconds[k]);
      }
    }
  };
  const auto meet = [&](const FaceBox& f, const FaceBox& g) { visit(f.face, f.box, g.face, g.box); };
  sweep(near_a_, near_b_, true, meet);
  sweep(near_b_, near_a_, false, [&](const FaceBox& g, const FaceBox& f) { meet(f, g); });
}

void CandidateFinder::find(SurfacePair& pair, std::span<SurfaceBody> bodies) {
  SurfaceBody& a = bodies[pair.first];
  SurfaceBody& b = bodies[pair.second];
  std::vector<Candidate>& candidates = pair.candidates;
  candidates.clear();
  const bool self = pair.first == pair.second;
  const std::vector<Face>& faces = b.topology->mesh->faces;
  const std::vector<Edge>& edges = b.topology->mesh->edges;
  const auto meet = [&](std::uint32_t f, const Box& box_f, std::uint32_t g, const Box& box_g) {
    const SurfaceTopology::OwnedFeatures& of_f = a.topology->owned[f];
    const SurfaceTopology::OwnedFeatures& of_g = b.topology->owned[g];
    for (std::uint8_t i = 0; i < of_f.vertex_count; ++i) {
      const std::uint32_t vertex = of_f.vertices[i];
      if (self && has(faces[g], vertex)) continue;
      if (way_box(a, vertex, vertex).overlaps(box_g)) {
        candidates.push_back({FeaturePair::vertex_face, false, vertex, g});
      }
    }
    for (std::uint8_t i = 0; i < of_g.vertex_count && !self; ++i) {
      const std::uint32_t vertex = of_g.vertices[i];
      if (way_box(b, vertex, vertex).overlaps(box_f)) {
        candidates.push_back({FeaturePair::vertex_face, true, vertex, f});
      }
    }
    for (std::uint8_t i = 0; i < of_f.edge_count; ++i) {
      const std::uint32_t first = of_f.edges[i];
      const auto [start, end] = a.topology->mesh->edges[first];
      const Box box = way_box(a, start, end);
      if (!box.overlaps(box_g)) continue;
      for (std::uint8_t j = 0; j < of_g.edge_count; ++j) {
        const std::uint32_t second = of_g.edges[j];
        const Edge& other = edges[second];
        if (self && (first >= second || start == other[0] || start == other[1] || end == other[0] || end == other[1])) {
          continue;  // of (f, g) and (g, f), one
        }
        if (box.overlaps(way_box(b, other[0], other[1]))) {
          candidates.push_back({FeaturePair::edge_edge, false, first, second});
        }
      }
    }
  };
  if (self) {
    a.boxes.fit(*a.topology, a.from, a.to, a.margin_m);
    a.boxes.for_pairs(*a.topology,
                      [&](std::uint32_t f, std::uint32_t g) { meet(f, a.boxes.faces[f], g, a.boxes.faces[g]); });
  } else {
    for_near_faces(a, b, meet);
  }
}

bool CandidateFinder::are_crossed(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  const SurfaceBody& a = bodies[pair.first];
  const SurfaceBody& b = bodies[pair.second];
  bool crossed = false;
  for_near_faces(a, b, [&](std::uint32_t f, const Box&, std::uint32_t g, const Box&) {
    const SurfaceTopology::OwnedFeatures& of_f = a.topology->owned[f];
    const SurfaceTopology::OwnedFeatures& of_g = b.topology->owned[g];
    for (std::uint8_t i = 0; i < of_f.edge_count && !crossed; ++i) crossed = runs_through(a, of_f.edges[i], b, g);
    for (std::uint8_t i = 0; i < of_g.edge_count && !crossed; ++i) crossed = runs_through(b, of_g.edges[i], a, f);
  });
  return crossed;
}

}  // namespace pneuma::physics
