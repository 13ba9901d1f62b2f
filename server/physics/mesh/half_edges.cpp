#include "physics/mesh/half_edges.h"

#include <algorithm>
#include <utility>

namespace pneuma::physics {

std::vector<HalfEdge> half_edges_of(std::span<const Face> faces) {
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(faces.size() * 3);
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t from = faces[f][corner];
      const std::uint32_t to = faces[f][(corner + 1) % 3];
      half_edges.push_back({{std::min(from, to), std::max(from, to)}, f, from < to});
    }
  }
  std::sort(half_edges.begin(), half_edges.end(),
            [](const HalfEdge& a, const HalfEdge& b) { return std::pair(a.edge, a.face) < std::pair(b.edge, b.face); });
  return half_edges;
}

std::string edge_text(const Edge& edge) {
  return "the edge of vertices " + std::to_string(edge[0]) + " and " + std::to_string(edge[1]);
}

std::string face_text(std::size_t face) {
  return "face " + std::to_string(face);
}

base::Status bad_face(std::size_t face, const std::string& what) {
  return base::invalid(face_text(face) + " " + what,
                       "indices[" + std::to_string(3 * face) + ".." + std::to_string(3 * face + 2) + "]");
}

}  // namespace pneuma::physics
