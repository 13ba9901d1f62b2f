// A tree of boxes about the faces of a mesh that keeps its shape, and the edges that something convex may touch.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "physics/mesh/mesh.h"
#include "physics/mesh/picking.h"

namespace pneuma::physics {

struct MeshTree {
  struct Box {
    Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d high_m = Eigen::Vector3d::Zero();

    [[nodiscard]] bool overlaps(const Box& other) const {
      return (low_m.array() <= other.high_m.array()).all() && (other.low_m.array() <= high_m.array()).all();
    }
  };
  struct Node {
    Box box;
    std::uint32_t first = 0;  // a leaf's first face in `faces`; else the left child, and the right one follows it
    std::uint32_t count = 0;  // faces of a leaf; 0 of an inner node
  };

  std::shared_ptr<const Mesh> mesh;
  std::vector<Node> nodes;           // the root first
  std::vector<std::uint32_t> faces;  // by leaf
  // One a face: the edges that belong to it, of those between faces that are not level, and of borders.
  std::vector<std::vector<std::uint32_t>> sharp_edges;

  /// The point of the surface that is nearest, and the face that is most across the way to it where several are as
  /// near: its side tells whether the point is in a closed mesh.
  [[nodiscard]] MeshPoint nearest(const Eigen::Vector3d& point_m) const;

  /// Calls visit(face) for the faces of leaves whose boxes overlap `box`, in the order of the tree.
  template <class Visit>
  void for_near(const Box& box, const Visit& visit) const {
    descend(0, box, visit);
  }

 private:
  template <class Visit>
  void descend(std::uint32_t index, const Box& box, const Visit& visit) const {
    const Node& node = nodes[index];
    if (!node.box.overlaps(box)) return;
    if (node.count == 0) {
      descend(node.first, box, visit);
      descend(node.first + 1, box, visit);
    }
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) visit(faces[k]);
  }
};

[[nodiscard]] std::shared_ptr<const MeshTree> make_mesh_tree(std::shared_ptr<const Mesh> mesh);

}  // namespace pneuma::physics
