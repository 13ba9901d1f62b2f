// Makes a mesh that can hold gas of a triangle list that cannot: welded, turned and closed, with a report.
#pragma once

#include <optional>
#include <string>

#include "physics/mesh/mesh.h"

namespace pneuma::physics {

struct MeshMend {
  // Empty: weld_relative of the mesh's diagonal; 0: no vertices are welded.
  std::optional<double> weld_m = std::nullopt;
  bool orient = true;
  bool close = true;

  static constexpr double weld_relative = 1e-6;  // what a file in single precision leaves between equal vertices
};

struct MendReport {
  std::size_t vertices_welded = 0;   // into others
  std::size_t vertices_dropped = 0;  // of no face
  std::size_t faces_dropped = 0;     // without area, or there already
  std::size_t faces_turned = 0;
  std::size_t holes_closed = 0;
  std::size_t faces_added = 0;
  bool operator==(const MendReport&) const = default;
};

/// "18 vertices welded, 1 hole closed with 2 faces", or "nothing to mend".
[[nodiscard]] std::string describe(const MendReport& report);

struct MendedMesh {
  std::shared_ptr<const Mesh> mesh;
  MendReport report;
};

/// In this order:
/// Each vertex is welded to the nearest of those before it that are within the distance and were not welded themselves;
/// the first of them keeps its place. Faces that name a vertex twice, have zero area, or have the vertices of an
/// earlier face are dropped.
/// Where `orient` is set, each part (faces joined by edges) is made to run one way, as most of its faces do, and
/// outwards where it is closed in the end.
/// Where `close` is set, each hole is filled (hole_fill.h) by faces between the vertices of its border.
/// Vertices of no face are dropped. Those that remain keep their order, as do faces, the new ones last.
///
/// Refuses, in the numbers of the lists as given: what check_lists refuses, an edge of three faces, a part that has one
/// side only, faces that run against each other where `orient` is not set, a hole that cannot be filled, a face that
/// stands alone where `close` is set.
[[nodiscard]] base::Result<MendedMesh> mend_mesh(std::vector<Eigen::Vector3d> positions_m, std::vector<Face> faces,
                                                 const MeshMend& mend);

}  // namespace pneuma::physics
