// The faces of a mesh that keeps its shape, and the edges that something convex may touch.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "physics/mesh/face_tree.h"
#include "physics/mesh/mesh.h"
#include "physics/mesh/picking.h"

namespace pneuma::physics {

struct MeshTree {
  std::shared_ptr<const Mesh> mesh;
  FaceTree faces;
  // One a face: the edges that belong to it, of those between faces that are not level, and of borders.
  std::vector<std::vector<std::uint32_t>> sharp_edges;

  [[nodiscard]] FacesAt surface() const { return {mesh->positions_m, mesh->faces}; }
  /// In the mesh's own frame, as all below.
  [[nodiscard]] const FaceTree::Box& box() const { return faces.nodes.front().box; }
  [[nodiscard]] MeshPoint nearest(const Eigen::Vector3d& point_m) const {
    return nearest_in(faces, surface(), point_m);
  }
};

[[nodiscard]] std::shared_ptr<const MeshTree> make_mesh_tree(std::shared_ptr<const Mesh> mesh);

}  // namespace pneuma::physics
