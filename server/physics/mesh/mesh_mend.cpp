#include "physics/mesh/mesh_mend.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "base/limits.h"
#include "physics/mesh/half_edges.h"
#include "physics/mesh/hole_fill.h"

namespace pneuma::physics {

namespace {

using Eigen::Vector3d;

// Of the mesh's diagonal: finer than this a double cannot tell vertices apart, and the cells' numbers stay integers.
constexpr double weld_min_relative = 1e-12;

// Closing a hole takes time by its vertices' square; a tube has two of the largest.
constexpr std::size_t hole_work_max = 2 * base::mesh_hole_vertices_max * base::mesh_hole_vertices_max;

/// Vertices in cubes of one size; what is within that size of a point lies in the 27 about it.
class Cells {
 public:
  Cells(const Vector3d& origin, double size_m) : origin_(origin), size_m_(size_m) {}

  void insert(std::uint32_t vertex, const Vector3d& at) { cells_[cell_of(at)].push_back(vertex); }

  template <class Visitor>
  void visit_near(const Vector3d& at, const Visitor& visitor) const {
    const Cell middle = cell_of(at);
    for (int i = 0; i < 27; ++i) {
      const auto found = cells_.find({middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1});
      if (found == cells_.end()) continue;
      for (const std::uint32_t vertex : found->second) visitor(vertex);
    }
  }

 private:
  using Cell = std::array<std::int64_t, 3>;
  [[nodiscard]] Cell cell_of(const Vector3d& at) const {
    Cell cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto of_axis = static_cast<Eigen::Index>(axis);
      cell[axis] = static_cast<std::int64_t>(std::floor((at[of_axis] - origin_[of_axis]) / size_m_));
    }
    return cell;
  }

  Vector3d origin_;
  double size_m_;
  std::map<Cell, std::vector<std::uint32_t>> cells_;  // no hash: whoever sends the mesh could make them collide
};

/// Faces that are joined by edges.
struct Part {
  std::vector<std::uint32_t> faces;
  bool open = false;
};

class Mender {
 public:
  Mender(std::vector<Vector3d> positions_m, std::vector<Face> faces)
      : positions_m_(std::move(positions_m)), faces_(std::move(faces)), area_min_m2_(face_area_min_m2(positions_m_)) {
    numbers_.resize(faces_.size());
    std::iota(numbers_.begin(), numbers_.end(), 0U);
  }

  void weld(double distance_m);
  void drop_bad_faces();
  [[nodiscard]] base::Status check_edges() const;
  /// Makes each part run one way, or says where it does not.
  [[nodiscard]] base::Status find_parts(bool orient);
  [[nodiscard]] base::Status close_holes();
  void turn_outwards();
  [[nodiscard]] base::Result<MendedMesh> finish();

 private:
  [[nodiscard]] std::uint32_t number_of(const HalfEdge& half_edge) const { return numbers_[half_edge.face]; }
  void turn(std::uint32_t face) {
    std::swap(faces_[face][1], faces_[face][2]);
    if (face < turned_.size()) turned_[face] ^= 1U;
  }
  [[nodiscard]] base::Status walk_part(std::uint32_t first, const std::vector<HalfEdge>& half_edges,
                                       const std::vector<std::array<std::uint32_t, 3>>& half_edges_of_face,
                                       bool orient);
  [[nodiscard]] base::Status close_part(Part& part, EdgeSet& edges);

  std::vector<Vector3d> positions_m_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> numbers_;  // of the faces in the list as given
  std::vector<std::uint8_t> welded_;    // vertices that are others now
  std::vector<std::uint8_t> turned_;    // faces as given; new ones are past its end
  std::vector<Part> parts_;
  double area_min_m2_;
  std::size_t hole_work_ = 0;  // of holes closed so far, their vertices squared
  MendReport report_;
};

void Mender::weld(double distance_m) {
  welded_.assign(positions_m_.size(), 0);
  const double cell_m = std::max(distance_m, weld_min_relative * diagonal_m(positions_m_));
  if (!(distance_m > 0.0) || !(cell_m > 0.0)) return;
  Cells kept(positions_m_.front(), cell_m);
  std::vector<std::uint32_t> targets(positions_m_.size());
  for (std::uint32_t vertex = 0; vertex < positions_m_.size(); ++vertex) {
    const Vector3d& at = positions_m_[vertex];
    std::pair nearest{cell_m * cell_m, vertex};
    kept.visit_near(at, [&](std::uint32_t other) {
      nearest = std::min(nearest, std::pair((positions_m_[other] - at).squaredNorm(), other));
    });
    targets[vertex] = nearest.second;
    if (nearest.second == vertex) {
      kept.insert(vertex, at);
    } else {
      welded_[vertex] = 1;
      ++report_.vertices_welded;
    }
  }
  for (Face& face : faces_) {
    for (std::uint32_t& vertex : face) vertex = targets[vertex];
  }
}

void Mender::drop_bad_faces() {
  std::set<Face> seen;
  std::size_t kept = 0;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    Face sorted = faces_[f];
    std::sort(sorted.begin(), sorted.end());
    if (sorted[0] == sorted[1] || sorted[1] == sorted[2]) continue;
    if (face_area_m2(positions_m_, faces_[f]) <= area_min_m2_ || !seen.insert(sorted).second) continue;
    faces_[kept] = faces_[f];
    numbers_[kept++] = numbers_[f];
  }
  report_.faces_dropped = faces_.size() - kept;
  faces_.resize(kept);
  numbers_.resize(kept);
}

base::Status Mender::check_edges() const {
  const std::vector<HalfEdge> half_edges = half_edges_of(faces_);
  for (std::size_t i = 2; i < half_edges.size(); ++i) {
    if (half_edges[i].edge != half_edges[i - 2].edge) continue;
    return bad_face(number_of(half_edges[i]),
                    "shares " + edge_text(half_edges[i].edge) + " with more than one other face (" +
                        face_text(number_of(half_edges[i - 2])) + ", " + face_text(number_of(half_edges[i - 1])) +
                        "), which no mending undoes");
  }
  return {};
}

base::Status Mender::find_parts(bool orient) {
  const std::vector<HalfEdge> half_edges = half_edges_of(faces_);
  std::vector<std::array<std::uint32_t, 3>> half_edges_of_face(faces_.size());
  std::vector<std::uint8_t> counts(faces_.size(), 0);
  for (std::uint32_t i = 0; i < half_edges.size(); ++i) {
    const std::uint32_t face = half_edges[i].face;
    half_edges_of_face[face][counts[face]++] = i;
  }
  turned_.assign(faces_.size(), 0);
  std::vector<std::uint8_t> seen(faces_.size(), 0);
  for (std::uint32_t face = 0; face < faces_.size(); ++face) {
    if (seen[face] != 0) continue;
    if (base::Status status = walk_part(face, half_edges, half_edges_of_face, orient); !status.ok()) return status;
    for (const std::uint32_t its : parts_.back().faces) seen[its] = 1;
  }
  return {};
}

// From neighbour to neighbour, each made to run through their edge against the one before.
base::Status Mender::walk_part(std::uint32_t first, const std::vector<HalfEdge>& half_edges,
                               const std::vector<std::array<std::uint32_t, 3>>& half_edges_of_face, bool orient) {
  Part part{{first}, false};
  std::unordered_map<std::uint32_t, bool> turns{{first, false}};
  for (std::size_t next = 0; next < part.faces.size(); ++next) {
    const std::uint32_t face = part.faces[next];
    for (const std::uint32_t i : half_edges_of_face[face]) {
      const HalfEdge& here = half_edges[i];
      const HalfEdge* there = nullptr;
      if (i > 0 && half_edges[i - 1].edge == here.edge) there = &half_edges[i - 1];
      if (i + 1 < half_edges.size() && half_edges[i + 1].edge == here.edge) there = &half_edges[i + 1];
      if (there == nullptr) {
        part.open = true;
        continue;
      }
      const bool against = here.rising != there->rising;
      if (!orient && !against) {
        return bad_face(number_of(here), "runs through " + edge_text(here.edge) + " in the same direction as " +
                                             face_text(number_of(*there)) + ", and mend.orient is off");
      }
      const bool turn = turns.at(face) == against;
      const auto [entry, is_new] = turns.try_emplace(there->face, turn);
      if (is_new) part.faces.push_back(there->face);
      if (entry->second != turn) {
        return bad_face(number_of(here), "is part of a surface with one side only, as seen at " + edge_text(here.edge));
      }
    }
  }
  const auto turned =
      static_cast<std::size_t>(std::ranges::count_if(turns, [](const auto& its) { return its.second; }));
  const bool most_turned = 2 * turned > part.faces.size();
  std::sort(part.faces.begin(), part.faces.end());
  for (const std::uint32_t face : part.faces) {
    if (turns.at(face) != most_turned) turn(face);
  }
  parts_.push_back(std::move(part));
  return {};
}

/// The borders of a part's holes, in the direction of the faces that would fill them. Where two holes meet at a vertex,
/// each has it once.
std::vector<std::vector<std::uint32_t>> borders_of(std::span<const Face> faces) {
  const std::vector<HalfEdge> half_edges = half_edges_of(faces);
  std::map<std::uint32_t, std::vector<std::uint32_t>> ways;  // from each vertex on
  for (std::size_t i = 0; i < half_edges.size(); ++i) {
    const bool paired = (i > 0 && half_edges[i - 1].edge == half_edges[i].edge) ||
                        (i + 1 < half_edges.size() && half_edges[i + 1].edge == half_edges[i].edge);
    if (!paired) ways[half_edges[i].to()].push_back(half_edges[i].from());
  }
  std::vector<std::vector<std::uint32_t>> borders;
  for (auto& [start, from_start] : ways) {
    while (!from_start.empty()) {
      // As many ways lead to a vertex as from it, so the path can only end where it began.
      std::vector<std::uint32_t> path{start};
      std::unordered_map<std::uint32_t, std::size_t> places{{start, 0}};
      while (!path.empty()) {
        std::vector<std::uint32_t>& onwards = ways.at(path.back());
        const std::uint32_t next = onwards.back();
        onwards.pop_back();
        const auto [place, is_new] = places.try_emplace(next, path.size());
        if (is_new) {
          path.push_back(next);
          continue;
        }
        const std::size_t begin = place->second;
        borders.emplace_back(path.begin() + static_cast<std::ptrdiff_t>(begin), path.end());
        for (std::size_t i = begin + 1; i < path.size(); ++i) places.erase(path[i]);
        path.resize(begin == 0 ? 0 : begin + 1);
      }
    }
  }
  return borders;
}

base::Status Mender::close_holes() {
  EdgeSet edges;
  for (const Face& face : faces_) {
    for (std::size_t corner = 0; corner < 3; ++corner) edges.insert(face[corner], face[(corner + 1) % 3]);
  }
  for (Part& part : parts_) {
    if (!part.open) continue;
    if (base::Status status = close_part(part, edges); !status.ok()) return status;
  }
  return {};
}

base::Status Mender::close_part(Part& part, EdgeSet& edges) {
  if (part.faces.size() == 1) {
    return bad_face(numbers_[part.faces[0]], "stands alone: closed, it would have nothing inside");
  }
  std::vector<Face> faces;
  faces.reserve(part.faces.size());
  for (const std::uint32_t face : part.faces) faces.push_back(faces_[face]);
  for (const std::vector<std::uint32_t>& border : borders_of(faces)) {
    const std::string hole =
        "the hole with " + edge_text({std::min(border[0], border[1]), std::max(border[0], border[1])});
    if (border.size() > base::mesh_hole_vertices_max) {
      return {base::StatusCode::limit_exceeded,
              hole + " has " + std::to_string(border.size()) + " vertices; one of at most " +
                  std::to_string(base::mesh_hole_vertices_max) + " can be closed",
              "indices"};
    }
    hole_work_ += border.size() * border.size();
    if (hole_work_ > hole_work_max) {
      return {base::StatusCode::limit_exceeded,
              hole + ", " + std::to_string(border.size()) +
                  " vertices in all, is one too many: the squares of the holes' vertices may add up to " +
                  std::to_string(hole_work_max),
              "indices"};
    }
    const auto filling = fill_hole(positions_m_, border, area_min_m2_, edges);
    if (!filling) {
      return base::invalid(hole + ", " + std::to_string(border.size()) +
                               " vertices in all, cannot be closed: its border is twisted, or in one line",
                           "indices");
    }
    for (const Face& face : *filling) {
      part.faces.push_back(static_cast<std::uint32_t>(faces_.size()));
      faces_.push_back(face);
    }
    ++report_.holes_closed;
    report_.faces_added += filling->size();
  }
  part.open = false;
  return {};
}

void Mender::turn_outwards() {
  for (const Part& part : parts_) {
    if (part.open) continue;
    std::vector<Face> faces;
    faces.reserve(part.faces.size());
    for (const std::uint32_t face : part.faces) faces.push_back(faces_[face]);
    if (signed_volume_m3(positions_m_, faces) >= 0.0) continue;
    for (const std::uint32_t face : part.faces) turn(face);
  }
}

base::Result<MendedMesh> Mender::finish() {
  report_.faces_turned = static_cast<std::size_t>(std::ranges::count(turned_, 1));
  std::vector<std::uint8_t> used(positions_m_.size(), 0);
  for (const Face& face : faces_) {
    for (const std::uint32_t vertex : face) used[vertex] = 1;
  }
  std::vector<std::uint32_t> places(positions_m_.size());
  std::uint32_t count = 0;
  for (std::uint32_t vertex = 0; vertex < positions_m_.size(); ++vertex) {
    places[vertex] = count;
    if (used[vertex] != 0) positions_m_[count++] = positions_m_[vertex];
    if (used[vertex] == 0 && welded_[vertex] == 0) ++report_.vertices_dropped;
  }
  positions_m_.resize(count);
  for (Face& face : faces_) {
    for (std::uint32_t& vertex : face) vertex = places[vertex];
  }
  if (faces_.empty()) return base::invalid("no face is left of the mesh: each is without area", "indices");
  auto mesh = make_mesh(std::move(positions_m_), std::move(faces_));
  if (!mesh.ok()) return mesh.status();
  return MendedMesh{std::move(*mesh), report_};
}

}  // namespace

base::Result<MendedMesh> mend_mesh(std::vector<Vector3d> positions_m, std::vector<Face> faces, const MeshMend& mend) {
  if (base::Status status = check_lists(positions_m, faces); !status.ok()) return status;
  const double weld_m = mend.weld_m.value_or(MeshMend::weld_relative * diagonal_m(positions_m));
  Mender mender(std::move(positions_m), std::move(faces));
  mender.weld(weld_m);
  mender.drop_bad_faces();
  if (base::Status status = mender.check_edges(); !status.ok()) return status;
  if (base::Status status = mender.find_parts(mend.orient); !status.ok()) return status;
  if (mend.close) {
    if (base::Status status = mender.close_holes(); !status.ok()) return status;
  }
  if (mend.orient) mender.turn_outwards();
  return mender.finish();
}

std::string describe(const MendReport& report) {
  std::string text;
  const auto count = [](std::size_t number, const std::string& one, const std::string& many) {
    return std::to_string(number) + " " + (number == 1 ? one : many);
  };
  const auto add = [&](std::size_t number, const std::string& words) {
    if (number > 0) text += (text.empty() ? "" : ", ") + words;
  };
  add(report.vertices_welded, count(report.vertices_welded, "vertex", "vertices") + " welded");
  add(report.vertices_dropped, count(report.vertices_dropped, "vertex", "vertices") + " dropped");
  add(report.faces_dropped, count(report.faces_dropped, "face", "faces") + " dropped");
  add(report.faces_turned, count(report.faces_turned, "face", "faces") + " turned");
  add(report.holes_closed,
      count(report.holes_closed, "hole", "holes") + " closed with " + count(report.faces_added, "face", "faces"));
  return text.empty() ? "nothing to mend" : text;
}

}  // namespace pneuma::physics
