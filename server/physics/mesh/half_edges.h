// The directed edges of triangles, and the words for what is wrong at one.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/status.h"
#include "physics/mesh/mesh.h"

namespace pneuma::physics {

struct HalfEdge {
  Edge edge;
  std::uint32_t face;
  bool rising;  // runs from the lower index to the higher

  [[nodiscard]] std::uint32_t from() const { return rising ? edge[0] : edge[1]; }
  [[nodiscard]] std::uint32_t to() const { return rising ? edge[1] : edge[0]; }
};

/// Three a face, sorted by edge, then by face.
[[nodiscard]] std::vector<HalfEdge> half_edges_of(std::span<const Face> faces);

/// "the edge of vertices 3 and 7"
[[nodiscard]] std::string edge_text(const Edge& edge);
[[nodiscard]] std::string face_text(std::size_t face);
/// Under the face's place in the flat list of a scene, `indices[9..11]`: `face 3 WHAT`.
[[nodiscard]] base::Status bad_face(std::size_t face, const std::string& what);

}  // namespace pneuma::physics
