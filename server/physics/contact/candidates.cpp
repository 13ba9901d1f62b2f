#include "physics/contact/candidates.h"

#include <algorithm>
#include <limits>

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

double highest_m(std::span<const Vec3d> from, std::span<const Vec3d> to, const Vec3d& towards) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const Vec3d& at : from) highest = std::max(highest, towards.dot(at));
  for (const Vec3d& at : to) highest = std::max(highest, towards.dot(at));
  return highest;
}

// Normals that agree by less than this share of their lengths name no way out: those about two bodies in one place
// point all around. Then the way is from middle to middle; and where these are nearer than this share of the bodies'
// sizes, one that stays the same from substep to substep.
constexpr double agreeing_share = 0.5;
constexpr double apart_share = 0.02;

// So many boxes take as long as a pair of features.
constexpr std::size_t box_looks = 32;

// Of the vertices' spacing: boxes of ways that are longer have much in them that comes near nothing.
constexpr double long_way_share = 2.0;
// Of the longer of two ways: by this much the other one leads away from it, or it leads nowhere else.
constexpr double beside_share = 1e-3;
// The slack is along each of the world's axes. Along others it is larger by up to the root of 3.
constexpr double turned_slack_share = 0.75;

// From so many boxes on, sorting them costs less than it saves.
constexpr std::size_t sorted_boxes_min = 512;

Vec3d mean_move_m(const SurfaceBody& body) {
  return drift_of(body.from.size(), [&](std::size_t i) { return body.move_m(static_cast<std::uint32_t>(i)); }).shift_m;
}

}  // namespace

// About the ways of an edge's ends, or of a vertex named twice.
Box CandidateFinder::Ways::box(std::uint32_t start, std::uint32_t end) const {
  const Vec3d margin = Vec3d::Constant(margin_m);
  return {from[start].cwiseMin(to[start]).cwiseMin(from[end]).cwiseMin(to[end]) - margin,
          from[start].cwiseMax(to[start]).cwiseMax(from[end]).cwiseMax(to[end]) + margin};
}

void CandidateFinder::sort_by_low(std::vector<FaceBox>& faces) {
  std::ranges::sort(faces, {}, [](const FaceBox& face) { return std::pair(face.box.low.x(), face.face); });
}

// The faces with a corner that comes as far as least_m, and whose box is in the region.
void CandidateFinder::take_near_faces(const Ways& ways, const Vec3d& towards, double least_m, const Box& region,
                                      std::vector<double>& heights_m, std::vector<FaceBox>& near) {
  heights_m.resize(ways.from.size());
  for (std::size_t i = 0; i < heights_m.size(); ++i) {
    heights_m[i] = std::max(towards.dot(ways.from[i]), towards.dot(ways.to[i]));
  }
  near.clear();
  const std::vector<Face>& faces = ways.body->topology->mesh->faces;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const auto& [a, b, c] = faces[f];
    if (heights_m[a] < least_m && heights_m[b] < least_m && heights_m[c] < least_m) continue;
    const Box box = way_box(faces[f], ways.from, ways.to, ways.margin_m);
    if (box.overlaps(region)) near.push_back({f, box});
  }
}

void CandidateFinder::FeatureBoxes::fit(const Ways& ways) {
  const std::vector<Edge>& ends = ways.body->topology->mesh->edges;
  vertices.resize(ways.from.size());
  edges.resize(ends.size());
  for (std::uint32_t i = 0; i < vertices.size(); ++i) vertices[i] = ways.box(i, i);
  for (std::size_t i = 0; i < edges.size(); ++i) edges[i] = ways.box(ends[i][0], ends[i][1]);
}

// Most of two bodies that touch is told apart by one direction: from the middle of one to that of the other.
void CandidateFinder::take_near_faces(const Ways& a, const Ways& b) {
  const Vec3d between = (b.all.low + b.all.high) - (a.all.low + a.all.high);
  const Vec3d towards = between.isZero(0.0) ? Vec3d(Vec3d::UnitX()) : Vec3d(between.normalized());
  const double grown_m = a.margin_m + b.margin_m;
  take_near_faces(a, towards, -highest_m(b.from, b.to, -towards) - grown_m, b.all, heights_m_, near_a_);
  take_near_faces(b, -towards, -highest_m(a.from, a.to, towards) - grown_m, a.all, heights_m_, near_b_);
}

// Sort and sweep of two lists.
template <class Visit>
void CandidateFinder::for_near_faces(const Visit& visit) {
  for (std::vector<FaceBox>* near : {&near_a_, &near_b_}) sort_by_low(*near);
  const auto sweep = [&](const std::vector<FaceBox>& firsts, const std::vector<FaceBox>& seconds, bool with_equal,
                         const auto& meet) -> bool {
    std::size_t begin = 0;
    for (const FaceBox& first : firsts) {
      const double low = first.box.low.x();
      while (begin < seconds.size() &&
             (with_equal ? seconds[begin].box.low.x() < low : seconds[begin].box.low.x() <= low)) {
        ++begin;
      }
      std::size_t k = begin;
      for (; k < seconds.size() && seconds[k].box.low.x() <= first.box.high.x(); ++k) {
        if (first.box.overlaps(seconds[k].box) && !meet(first, seconds[k])) return false;
      }
      if (!take_looks((k - begin) / box_looks)) return false;
    }
    return true;
  };
  if (!sweep(near_a_, near_b_, true, visit)) return;
  (void)sweep(near_b_, near_a_, false, [&](const FaceBox& g, const FaceBox& f) { return visit(f, g); });
}

// Where one moves far, as they are seen along its way. A box about a way has little in it then but what lies on it,
// however much of the way is cut off.
std::pair<CandidateFinder::Ways, CandidateFinder::Ways> CandidateFinder::ways_of(const SurfacePair& pair,
                                                                                 std::span<const SurfaceBody> bodies) {
  const SurfaceBody& a = bodies[pair.first];
  const SurfaceBody& b = bodies[pair.second];
  Vec3d longer_m = mean_move_m(a);
  Vec3d shorter_m = mean_move_m(b);
  if (longer_m.squaredNorm() < shorter_m.squaredNorm()) longer_m.swap(shorter_m);
  if (!(longer_m.norm() > long_way_share * std::max(a.spacing_m, b.spacing_m))) return {ways_of(a), ways_of(b)};
  const Vec3d along = longer_m.normalized();
  const Vec3d beside_m = shorter_m - shorter_m.dot(along) * along;
  const bool is_beside = beside_m.norm() > beside_share * longer_m.norm();
  const Vec3d across = is_beside ? Vec3d(beside_m.normalized()) : Vec3d(along.unitOrthogonal());
  Eigen::Matrix3d axes;
  axes << along.transpose(), across.transpose(), along.cross(across).transpose();
  const Vec3d origin = a.from.front();
  const auto see = [&](const SurfaceBody& body, SeenWays& seen) -> Ways {
    const std::size_t count = body.from.size();
    seen.from.resize(count);
    seen.to.resize(count);
    Box all;
    for (std::size_t i = 0; i < count; ++i) {
      seen.from[i] = axes * (body.from[i] - origin);
      seen.to[i] = axes * (body.to[i] - origin);
      all.include(seen.from[i]);
      all.include(seen.to[i]);
    }
    const double margin_m = body.margin_m + turned_slack_share * body.slack_m;
    const Vec3d margin = Vec3d::Constant(margin_m);
    return {&body, seen.from, seen.to, {all.low - margin, all.high + margin}, margin_m};
  };
  const Ways seen_a = see(a, seen_a_);
  return {seen_a, pair.first == pair.second ? seen_a : see(b, seen_b_)};
}

void CandidateFinder::add_astray(SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  const SurfaceBody& a = bodies[pair.first];
  const SurfaceBody& b = bodies[pair.second];
  const auto [ways_a, ways_b] = ways_of(pair, bodies);
  take_near_faces(ways_a, ways_b);
  const auto take_astray = [this](const SurfaceBody& body, std::span<const FaceBox> near) {
    astray_.clear();
    for (const FaceBox& face : near) {
      const auto& [p, q, r] = body.topology->mesh->faces[face.face];
      if (body.astray[p] != 0 || body.astray[q] != 0 || body.astray[r] != 0) astray_.push_back(face);
    }
    return !astray_.empty();
  };
  if (a.any_astray && take_astray(a, near_a_)) add_near_faces(pair, ways_a, astray_, ways_b, near_b_);
  if (b.any_astray && take_astray(b, near_b_)) add_near_faces(pair, ways_a, near_a_, ways_b, astray_);
}

void CandidateFinder::BoxList::clear() {
  features.clear();
  unsorted.clear();
  for (std::vector<double>& side : sides) side.clear();
}

void CandidateFinder::BoxList::add(std::uint32_t feature, const Box& box) {
  unsorted.emplace_back(feature, box);
}

// Filled up by boxes about nothing.
void CandidateFinder::BoxList::arrange() {
  constexpr std::size_t width = FeatureBlock::width;
  widest_m = -1.0;
  if (unsorted.size() >= sorted_boxes_min) {
    std::ranges::sort(unsorted, {}, [](const auto& entry) { return std::pair(entry.second.low.x(), entry.first); });
    for (const auto& [feature, box] : unsorted) widest_m = std::max(widest_m, box.high.x() - box.low.x());
  }
  const std::size_t count = (unsorted.size() + width - 1) / width * width;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    sides[axis].resize(count, std::numeric_limits<double>::infinity());
    sides[axis + 3].resize(count, -std::numeric_limits<double>::infinity());
  }
  for (std::size_t i = 0; i < unsorted.size(); ++i) {
    const auto& [feature, box] = unsorted[i];
    features.push_back(feature);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sides[axis][i] = box.low[static_cast<Eigen::Index>(axis)];
      sides[axis + 3][i] = box.high[static_cast<Eigen::Index>(axis)];
    }
  }
}

std::pair<std::size_t, std::size_t> CandidateFinder::BoxList::window(double low_m, double high_m) const {
  constexpr std::size_t width = FeatureBlock::width;
  const std::vector<double>& lows = sides[0];
  if (!(widest_m >= 0.0)) return {0, lows.size()};
  const auto begin = std::ranges::lower_bound(lows, low_m - widest_m) - lows.begin();
  const auto end = std::ranges::upper_bound(lows, high_m) - lows.begin();
  const std::size_t first = static_cast<std::size_t>(begin) / width * width;
  const std::size_t last = (static_cast<std::size_t>(end) + width - 1) / width * width;
  return {first, last - first};
}

BoxRows CandidateFinder::BoxList::rows(std::size_t first, std::size_t count) const {
  BoxRows rows;
  for (std::size_t i = 0; i < sides.size(); ++i) rows.sides[i] = sides[i].data() + first;
  rows.count = count;
  return rows;
}

std::size_t CandidateFinder::BoxList::bytes() const {
  std::size_t sum = features.capacity() * sizeof(std::uint32_t) + unsorted.capacity() * sizeof(unsorted[0]);
  for (const std::vector<double>& side : sides) sum += side.capacity() * sizeof(double);
  return sum;
}

std::size_t CandidateFinder::bytes() const {
  return heights_m_.capacity() * sizeof(double) +
         (near_a_.capacity() + near_b_.capacity() + astray_.capacity()) * sizeof(FaceBox) +
         (boxes_.vertices.capacity() + boxes_.edges.capacity()) * sizeof(Box) + features_a_.bytes() +
         features_b_.bytes() + seen_a_.bytes() + seen_b_.bytes() + overlapping_.capacity() * sizeof(std::uint32_t);
}

void CandidateFinder::NearFeatures::take(const Ways& ways, std::span<const FaceBox> near) {
  const SurfaceTopology& topology = *ways.body->topology;
  for (BoxList* list : {&vertices, &edges, &faces}) list->clear();
  for (const FaceBox& face : near) {
    const SurfaceTopology::OwnedFeatures& owned = topology.owned[face.face];
    faces.add(face.face, face.box);
    for (std::uint8_t i = 0; i < owned.vertex_count; ++i) {
      vertices.add(owned.vertices[i], ways.box(owned.vertices[i], owned.vertices[i]));
    }
    for (std::uint8_t i = 0; i < owned.edge_count; ++i) {
      const auto [start, end] = topology.mesh->edges[owned.edges[i]];
      edges.add(owned.edges[i], ways.box(start, end));
    }
  }
  for (BoxList* list : {&vertices, &edges, &faces}) list->arrange();
}

template <class Add>
void CandidateFinder::for_overlapping(const BoxList& firsts, const BoxList& seconds, const Add& add) {
  if (overlapping_.size() < seconds.sides[0].size()) overlapping_.resize(seconds.sides[0].size());
  for (std::size_t i = 0; i < firsts.features.size(); ++i) {
    const std::array<double, 6> box = firsts.box(i);
    const auto [first, count] = seconds.window(box[0], box[3]);
    const std::size_t found = kernels_->overlapping(box, seconds.rows(first, count), overlapping_.data());
    for (std::size_t k = 0; k < found; ++k) {
      if (!take_looks(1)) return;
      add(firsts.features[i], seconds.features[first + overlapping_[k]]);
    }
  }
}

// Of one face of a body and another of its faces, what their owned features name.
void CandidateFinder::meet_self(std::uint32_t f, std::uint32_t g, const SurfaceBody& body,
                                std::vector<Candidate>& candidates) {
  const Mesh& mesh = *body.topology->mesh;
  const auto meet_vertices = [&](std::uint32_t owner, std::uint32_t face) {
    const SurfaceTopology::OwnedFeatures& owned = body.topology->owned[owner];
    for (std::uint8_t i = 0; i < owned.vertex_count; ++i) {
      const std::uint32_t vertex = owned.vertices[i];
      if (!boxes_.vertices[vertex].overlaps(body.boxes.faces[face]) || has(mesh.faces[face], vertex)) continue;
      const auto& [p, q, r] = mesh.faces[face];
      candidates.push_back({FeaturePair::vertex_face, false, vertex, face, {vertex, p, q, r}});
    }
  };
  meet_vertices(f, g);
  meet_vertices(g, f);
  const SurfaceTopology::OwnedFeatures& of_f = body.topology->owned[f];
  const SurfaceTopology::OwnedFeatures& of_g = body.topology->owned[g];
  for (std::uint8_t i = 0; i < of_f.edge_count; ++i) {
    const Box& box = boxes_.edges[of_f.edges[i]];
    if (!box.overlaps(body.boxes.faces[g])) continue;
    for (std::uint8_t j = 0; j < of_g.edge_count; ++j) {
      if (!box.overlaps(boxes_.edges[of_g.edges[j]])) continue;
      const std::uint32_t first = std::min(of_f.edges[i], of_g.edges[j]);
      const std::uint32_t second = std::max(of_f.edges[i], of_g.edges[j]);
      const Edge& edge = mesh.edges[first];
      const Edge& other = mesh.edges[second];
      if (has(edge, other[0]) || has(edge, other[1])) continue;
      candidates.push_back({FeaturePair::edge_edge, false, first, second, {edge[0], edge[1], other[0], other[1]}});
    }
  }
}

void CandidateFinder::find(SurfacePair& pair, std::span<SurfaceBody> bodies) {
  const auto [ways_a, ways_b] = ways_of(pair, bodies);
  if (pair.first != pair.second) {
    take_near_faces(ways_a, ways_b);
    meet_near_faces(pair, ways_a, ways_b);
    return;
  }
  SurfaceBody& body = bodies[pair.first];
  pair.candidates.clear();
  body.boxes.fit(*body.topology, ways_a.from, ways_a.to, ways_a.margin_m);
  boxes_.fit(ways_a);
  body.boxes.for_pairs(*body.topology, [&](std::uint32_t f, std::uint32_t g) {
    const std::size_t before = pair.candidates.size();
    meet_self(f, g, body, pair.candidates);
    return take_looks(1 + pair.candidates.size() - before);
  });
}

void CandidateFinder::find_among(SurfacePair& pair, std::span<const SurfaceBody> bodies,
                                 std::vector<FaceBox>& near_first, std::vector<FaceBox>& near_second) {
  near_a_.swap(near_first);
  near_b_.swap(near_second);
  const auto [ways_a, ways_b] = ways_of(pair, bodies);
  if (ways_a.from.data() != bodies[pair.first].from.data()) {
    see_faces(ways_a, near_a_);
    see_faces(ways_b, near_b_);
  }
  meet_near_faces(pair, ways_a, ways_b);
}

// Their boxes anew, for ways in another frame.
void CandidateFinder::see_faces(const Ways& ways, std::span<FaceBox> near) {
  const std::vector<Face>& faces = ways.body->topology->mesh->faces;
  for (FaceBox& face : near) face.box = way_box(faces[face.face], ways.from, ways.to, ways.margin_m);
}

void CandidateFinder::meet_near_faces(SurfacePair& pair, const Ways& ways_a, const Ways& ways_b) {
  pair.candidates.clear();
  add_near_faces(pair, ways_a, near_a_, ways_b, near_b_);
}

void CandidateFinder::add_near_faces(SurfacePair& pair, const Ways& ways_a, std::span<const FaceBox> near_a,
                                     const Ways& ways_b, std::span<const FaceBox> near_b) {
  if (near_a.empty() || near_b.empty()) return;
  features_a_.take(ways_a, near_a);
  features_b_.take(ways_b, near_b);
  const Mesh& mesh_a = *ways_a.body->topology->mesh;
  const Mesh& mesh_b = *ways_b.body->topology->mesh;
  for_overlapping(features_a_.vertices, features_b_.faces, [&](std::uint32_t vertex, std::uint32_t face) {
    const auto& [p, q, r] = mesh_b.faces[face];
    pair.candidates.push_back({FeaturePair::vertex_face, false, vertex, face, {vertex, p, q, r}});
  });
  for_overlapping(features_b_.vertices, features_a_.faces, [&](std::uint32_t vertex, std::uint32_t face) {
    const auto& [p, q, r] = mesh_a.faces[face];
    pair.candidates.push_back({FeaturePair::vertex_face, true, vertex, face, {vertex, p, q, r}});
  });
  for_overlapping(features_a_.edges, features_b_.edges, [&](std::uint32_t first, std::uint32_t second) {
    const Edge& edge = mesh_a.edges[first];
    const Edge& other = mesh_b.edges[second];
    pair.candidates.push_back({FeaturePair::edge_edge, false, first, second, {edge[0], edge[1], other[0], other[1]}});
  });
}

bool CandidateFinder::are_crossed(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  const SurfaceBody& a = bodies[pair.first];
  const SurfaceBody& b = bodies[pair.second];
  bool crossed = false;
  take_near_faces(start_of(a), start_of(b));
  for_near_faces([&](const FaceBox& face_a, const FaceBox& face_b) {
    const std::uint32_t f = face_a.face;
    const std::uint32_t g = face_b.face;
    const SurfaceTopology::OwnedFeatures& of_f = a.topology->owned[f];
    const SurfaceTopology::OwnedFeatures& of_g = b.topology->owned[g];
    for (std::uint8_t i = 0; i < of_f.edge_count && !crossed; ++i) crossed = runs_through(a, of_f.edges[i], b, g);
    for (std::uint8_t i = 0; i < of_g.edge_count && !crossed; ++i) crossed = runs_through(b, of_g.edges[i], a, f);
    return !crossed && take_looks(1);
  });
  return crossed;
}

Vec3d CandidateFinder::way_apart(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  const SurfaceBody& a = bodies[pair.first];
  const SurfaceBody& b = bodies[pair.second];
  const auto normal_of = [](const SurfaceBody& body, std::uint32_t face) -> Vec3d {
    const auto& [i, j, k] = body.topology->mesh->faces[face];
    return (body.from[j] - body.from[i]).cross(body.from[k] - body.from[i]);
  };
  Vec3d sum = Vec3d::Zero();
  double all = 0.0;
  const auto take = [&](const Vec3d& normal) {
    sum += normal;
    all += normal.norm();
  };
  take_near_faces(start_of(a), start_of(b));
  for_near_faces([&](const FaceBox& face_a, const FaceBox& face_b) {
    const std::uint32_t f = face_a.face;
    const std::uint32_t g = face_b.face;
    const SurfaceTopology::OwnedFeatures& of_f = a.topology->owned[f];
    const SurfaceTopology::OwnedFeatures& of_g = b.topology->owned[g];
    for (std::uint8_t i = 0; i < of_f.edge_count; ++i) {
      if (runs_through(a, of_f.edges[i], b, g)) take(normal_of(b, g));
    }
    for (std::uint8_t i = 0; i < of_g.edge_count; ++i) {
      if (runs_through(b, of_g.edges[i], a, f)) take(-normal_of(a, f));
    }
    return take_looks(1);
  });
  const Vec3d between = (a.way.low + a.way.high) - (b.way.low + b.way.high);
  const bool both_closed = a.topology->mesh->closed && b.topology->mesh->closed;
  if (!both_closed && sum.dot(between) < 0.0) sum = -sum;  // an open one has two sides
  if (sum.norm() >= agreeing_share * all && all > 0.0) return sum.normalized();
  const double size_m = (a.way.high - a.way.low + b.way.high - b.way.low).norm();
  return between.norm() > apart_share * size_m ? Vec3d(between.normalized()) : Vec3d(Vec3d::UnitX());
}

}  // namespace pneuma::physics
