#include "physics/mesh/mesh.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "base/limits.h"
#include "physics/mesh/half_edges.h"

namespace pneuma::physics {
namespace {

// Of the square of the mesh's diagonal. The smallest honest face of a 65,536-vertex mesh has about 1e-5 of it, and
// rounding gives a face of three vertices in line about 1e-16.
constexpr double face_area_min_relative = 1e-12;

std::string position_path(std::size_t vertex) {
  return "positions[" + std::to_string(vertex) + "]";
}

base::Status check_counts(std::size_t vertex_count, std::size_t face_count) {
  if (vertex_count == 0) return base::invalid("the mesh has no vertex", "positions");
  if (face_count == 0) return base::invalid("the mesh has no face", "indices");
  if (vertex_count > base::mesh_vertices_max) {
    return {base::StatusCode::limit_exceeded,
            "has " + std::to_string(vertex_count) + " vertices; at most " + std::to_string(base::mesh_vertices_max),
            "positions"};
  }
  if (face_count > base::mesh_faces_max) {
    return {base::StatusCode::limit_exceeded,
            "has " + std::to_string(face_count) + " faces; at most " + std::to_string(base::mesh_faces_max), "indices"};
  }
  return {};
}

base::Status check_positions(const std::vector<Eigen::Vector3d>& positions_m) {
  for (std::size_t i = 0; i < positions_m.size(); ++i) {
    if (!positions_m[i].allFinite()) return base::invalid("is not finite", position_path(i));
    if (positions_m[i].cwiseAbs().maxCoeff() > base::coordinate_max_m) {
      return {base::StatusCode::limit_exceeded, "is further than 1e7 m from the mesh's origin", position_path(i)};
    }
  }
  return {};
}

base::Status check_faces(const std::vector<Eigen::Vector3d>& positions_m, const std::vector<Face>& faces) {
  const double area_min_m2 = face_area_min_m2(positions_m);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const auto [a, b, c] = faces[f];
    if (a == b || b == c || c == a) {
      return bad_face(f, "names vertex " + std::to_string(a == b || a == c ? a : b) + " twice");
    }
    if (face_area_m2(positions_m, faces[f]) <= area_min_m2) {
      return bad_face(f, "has zero area (vertices " + std::to_string(a) + ", " + std::to_string(b) + ", " +
                             std::to_string(c) + " are in line)");
    }
  }
  return {};
}

/// Of the faces that run through an edge in the same direction as a neighbour, the one that does so most often is the
/// flipped one; its neighbours do so once.
base::Status name_flipped_face(const std::vector<std::pair<HalfEdge, HalfEdge>>& conflicts, std::size_t face_count) {
  std::vector<std::uint8_t> conflict_counts(face_count, 0);
  for (const auto& [a, b] : conflicts) {
    ++conflict_counts[a.face];
    ++conflict_counts[b.face];
  }
  const auto flipped = static_cast<std::uint32_t>(std::max_element(conflict_counts.begin(), conflict_counts.end()) -
                                                  conflict_counts.begin());
  const auto conflict = std::find_if(conflicts.begin(), conflicts.end(), [&](const auto& pair) {
    return pair.first.face == flipped || pair.second.face == flipped;
  });
  const std::uint32_t other = conflict->first.face == flipped ? conflict->second.face : conflict->first.face;
  return bad_face(flipped, "is flipped: it runs through " + edge_text(conflict->first.edge) +
                               " in the same direction as " + face_text(other));
}

/// Edges, lengths and borders, from the sorted half-edges: one or two to an edge.
base::Status derive_edges(Mesh& mesh) {
  const std::vector<HalfEdge> half_edges = half_edges_of(mesh.faces);
  std::vector<std::pair<HalfEdge, HalfEdge>> conflicts;
  for (std::size_t first = 0, end = 0; first < half_edges.size(); first = end) {
    const Edge edge = half_edges[first].edge;
    while (end < half_edges.size() && half_edges[end].edge == edge) ++end;
    if (end - first > 2) {
      return bad_face(half_edges[first + 2].face, "shares " + edge_text(edge) + " with more than one other face (" +
                                                      face_text(half_edges[first].face) + ", " +
                                                      face_text(half_edges[first + 1].face) + ")");
    }
    if (end - first == 1) {
      mesh.boundary.insert(mesh.boundary.end(), {edge[0], edge[1]});
    } else if (half_edges[first].rising == half_edges[first + 1].rising) {
      conflicts.emplace_back(half_edges[first], half_edges[first + 1]);
    }
    mesh.edges.push_back(edge);
    mesh.edge_lengths_m.push_back((mesh.positions_m[edge[1]] - mesh.positions_m[edge[0]]).norm());
  }
  if (!conflicts.empty()) return name_flipped_face(conflicts, mesh.faces.size());
  std::sort(mesh.boundary.begin(), mesh.boundary.end());
  mesh.boundary.erase(std::unique(mesh.boundary.begin(), mesh.boundary.end()), mesh.boundary.end());
  mesh.closed = mesh.boundary.empty();
  return {};
}

/// The faces of each part that hangs together by its vertices, parts and faces in the mesh's order.
std::vector<std::vector<std::size_t>> connected_parts(const Mesh& mesh) {
  std::vector<std::uint32_t> parents(mesh.positions_m.size());
  std::iota(parents.begin(), parents.end(), 0U);
  const auto root_of = [&parents](std::uint32_t vertex) {
    while (parents[vertex] != vertex) vertex = parents[vertex] = parents[parents[vertex]];
    return vertex;
  };
  for (const auto& [a, b] : mesh.edges) parents[root_of(a)] = root_of(b);
  std::vector<std::size_t> part_numbers(mesh.positions_m.size(), mesh.faces.size());  // of roots; faces.size(): none
  std::vector<std::vector<std::size_t>> parts;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    std::size_t& number = part_numbers[root_of(mesh.faces[f][0])];
    if (number == mesh.faces.size()) {
      number = parts.size();
      parts.emplace_back();
    }
    parts[number].push_back(f);
  }
  return parts;
}

}  // namespace

bool same_mesh(const Mesh& a, const Mesh& b) {
  return &a == &b || (a.positions_m == b.positions_m && a.faces == b.faces);
}

double diagonal_m(std::span<const Eigen::Vector3d> positions_m) {
  Eigen::Vector3d low = positions_m.front();
  Eigen::Vector3d high = low;
  for (const Eigen::Vector3d& position : positions_m) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  return (high - low).norm();
}

double face_area_m2(std::span<const Eigen::Vector3d> positions_m, const Face& face) {
  const Eigen::Vector3d along = positions_m[face[1]] - positions_m[face[0]];
  const Eigen::Vector3d across = positions_m[face[2]] - positions_m[face[0]];
  return 0.5 * along.cross(across).norm();
}

double face_area_min_m2(std::span<const Eigen::Vector3d> positions_m) {
  const double length_m = diagonal_m(positions_m);
  return face_area_min_relative * length_m * length_m;
}

base::Status check_lists(const std::vector<Eigen::Vector3d>& positions_m, const std::vector<Face>& faces) {
  if (base::Status status = check_counts(positions_m.size(), faces.size()); !status.ok()) return status;
  if (base::Status status = check_positions(positions_m); !status.ok()) return status;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (const std::uint32_t index : faces[f]) {
      if (index < positions_m.size()) continue;
      return bad_face(f, "names vertex " + std::to_string(index) + " of a mesh of " +
                             std::to_string(positions_m.size()) + " vertices");
    }
  }
  return {};
}

base::Result<std::shared_ptr<const Mesh>> make_mesh(std::vector<Eigen::Vector3d> positions_m, std::vector<Face> faces) {
  if (base::Status status = check_lists(positions_m, faces); !status.ok()) return status;
  if (base::Status status = check_faces(positions_m, faces); !status.ok()) return status;

  auto mesh = std::make_shared<Mesh>();
  mesh->positions_m = std::move(positions_m);
  mesh->faces = std::move(faces);
  mesh->face_counts.assign(mesh->positions_m.size(), 0);
  for (const Face& face : mesh->faces) {
    for (const std::uint32_t vertex : face) ++mesh->face_counts[vertex];
  }
  const auto unused = std::find(mesh->face_counts.begin(), mesh->face_counts.end(), 0U);
  if (unused != mesh->face_counts.end()) {
    return base::invalid("belongs to no face",
                         position_path(static_cast<std::size_t>(unused - mesh->face_counts.begin())));
  }
  if (base::Status status = derive_edges(*mesh); !status.ok()) return status;
  return std::shared_ptr<const Mesh>(std::move(mesh));
}

base::Status check_holds_gas(const Mesh& mesh) {
  if (!mesh.closed) {
    const std::vector<HalfEdge> half_edges = half_edges_of(mesh.faces);
    std::size_t open = 0;
    while (open + 1 < half_edges.size() && half_edges[open].edge == half_edges[open + 1].edge) open += 2;
    return base::invalid("gas needs a closed mesh; " + edge_text(half_edges[open].edge) +
                             " is open (a mend of the mesh with `close` closes it)",
                         "mesh");
  }
  for (const std::vector<std::size_t>& part : connected_parts(mesh)) {
    std::vector<Face> faces;
    faces.reserve(part.size());
    for (const std::size_t face : part) faces.push_back(mesh.faces[face]);
    if (signed_volume_m3(mesh.positions_m, faces) <= 0.0) {
      return base::invalid(
          "gas needs a mesh that faces outwards; the part with " + face_text(part.front()) + " is inside out, or flat",
          "mesh");
    }
  }
  return {};
}

double signed_volume_m3(std::span<const Eigen::Vector3d> positions_m, std::span<const Face> faces) {
  if (faces.empty()) return 0.0;
  // A closed mesh has the same volume seen from any origin; from a vertex of its own, digits survive far away.
  const Eigen::Vector3d& origin = positions_m[faces.front()[0]];
  double sum = 0.0;
  for (const auto& [a, b, c] : faces) {
    const Eigen::Vector3d to_a = positions_m[a] - origin;
    const Eigen::Vector3d to_b = positions_m[b] - origin;
    const Eigen::Vector3d to_c = positions_m[c] - origin;
    sum += to_a.dot(to_b.cross(to_c));
  }
  return sum / 6.0;
}

}  // namespace pneuma::physics
