// A tree of boxes about faces, for what asks for the few that are near.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "physics/mesh/mesh.h"
#include "physics/mesh/picking.h"

namespace pneuma::physics {

struct FaceTree {
  struct Box {
    Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
    Eigen::Vector3d high_m = Eigen::Vector3d::Zero();

    [[nodiscard]] bool overlaps(const Box& other) const {
      return (low_m.array() <= other.high_m.array()).all() && (other.low_m.array() <= high_m.array()).all();
    }
    /// 0 in the box.
    [[nodiscard]] double distance_m(const Eigen::Vector3d& point_m) const {
      return (low_m - point_m).cwiseMax(point_m - high_m).cwiseMax(0.0).norm();
    }
    /// From the origin to where the ray enters the box, 0 from within; nothing where it does not. The box is taken to
    /// be larger by what rounding may hide.
    [[nodiscard]] std::optional<double> entered_m(const Ray& ray) const;
  };
  struct Node {
    Box box;
    std::uint32_t first = 0;  // a leaf's first face in `faces`; else the left child, and the right one follows it
    std::uint32_t count = 0;  // faces of a leaf; 0 of an inner node
  };

  std::vector<Node> nodes;           // the root first
  std::vector<std::uint32_t> faces;  // by leaf

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

/// Faces and where their vertices are. At least one face.
struct FacesAt {
  std::span<const Eigen::Vector3d> positions_m;
  std::span<const Face> faces;
};

[[nodiscard]] FaceTree::Box box_about(std::span<const Eigen::Vector3d> positions_m);
[[nodiscard]] FaceTree make_face_tree(const FacesAt& surface);
/// Of all faces in one leaf: made at once, and every question looks at each.
[[nodiscard]] FaceTree one_leaf(const FacesAt& surface);

/// The point of the surface that is nearest, and the face that is most across the way to it where several are as near:
/// its side tells whether the point is in a closed mesh. The tree is of these faces at these places.
/// Adds to `looks`, if it is there, how many faces were looked at.
[[nodiscard]] MeshPoint nearest_in(const FaceTree& tree, const FacesAt& surface, const Eigen::Vector3d& point_m,
                                   std::uint64_t* looks = nullptr);
/// As first_hit() (picking.h).
[[nodiscard]] std::optional<MeshPoint> first_hit_in(const FaceTree& tree, const FacesAt& surface, const Ray& ray,
                                                    std::uint64_t* looks = nullptr);

[[nodiscard]] Eigen::Vector3d unit_normal(const FacesAt& surface, std::uint32_t face);

}  // namespace pneuma::physics
