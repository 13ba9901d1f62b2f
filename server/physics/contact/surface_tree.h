// A tree of boxes about a mesh's faces, made once a mesh and fitted anew to where its vertices move.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "physics/mesh/mesh.h"
#include "physics/scene/scene.h"

namespace pneuma::physics {

/// An axis-aligned box; at first about nothing.
struct Box {
  Vec3d low = Vec3d::Constant(std::numeric_limits<double>::infinity());
  Vec3d high = Vec3d::Constant(-std::numeric_limits<double>::infinity());

  void include(const Vec3d& point) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  void include(const Box& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
  [[nodiscard]] bool overlaps(const Box& other) const {
    return low.x() <= other.high.x() && other.low.x() <= high.x() && low.y() <= other.high.y() &&
           other.low.y() <= high.y() && low.z() <= other.high.z() && other.low.z() <= high.z();
  }
};

/// What of a mesh contact needs. Every vertex and every edge belongs to one of the faces that it is part of, so that
/// pairs of faces name each pair of features once.
struct SurfaceTopology {
  struct Node {
    std::uint32_t first = 0;  // a leaf's first face in `faces`; else the left child, and the right one follows it
    std::uint32_t count = 0;  // faces of a leaf; 0 of an inner node
  };
  struct OwnedFeatures {
    std::array<std::uint32_t, 3> vertices{};
    std::array<std::uint32_t, 3> edges{};
    std::uint8_t vertex_count = 0;
    std::uint8_t edge_count = 0;
  };

  std::shared_ptr<const Mesh> mesh;
  std::vector<Node> nodes;           // the root first, parents before children
  std::vector<std::uint32_t> faces;  // by leaf
  std::vector<OwnedFeatures> owned;  // one a face

  [[nodiscard]] std::size_t bytes() const {
    return nodes.capacity() * sizeof(Node) + faces.capacity() * sizeof(std::uint32_t) +
           owned.capacity() * sizeof(OwnedFeatures);
  }
};
[[nodiscard]] std::shared_ptr<const SurfaceTopology> make_surface_topology(std::shared_ptr<const Mesh> mesh);

/// About the ways of a face's corners, from `from` to `to`, grown by margin_m.
[[nodiscard]] Box way_box(const Face& face, std::span<const Vec3d> from, std::span<const Vec3d> to, double margin_m);

/// The boxes of one surface's faces.
struct SurfaceBoxes {
  std::vector<Box> nodes;
  std::vector<Box> faces;  // by face of the mesh

  void fit(const SurfaceTopology& topology, std::span<const Vec3d> from, std::span<const Vec3d> to, double margin_m);
  /// Calls visit(f, g) once for each two faces whose boxes overlap, until one call returns false.
  template <class Visit>
  void for_pairs(const SurfaceTopology& topology, const Visit& visit) const {
    (void)pairs_within(topology, 0, visit);
  }

 private:
  // Each returns false once a visit has.
  template <class Visit>
  bool pairs_within(const SurfaceTopology& topology, std::uint32_t i, const Visit& visit) const {
    const SurfaceTopology::Node& node = topology.nodes[i];
    if (node.count == 0) {
      return pairs_within(topology, node.first, visit) && pairs_within(topology, node.first + 1, visit) &&
             pairs_between(topology, node.first, node.first + 1, visit);
    }
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
      for (std::uint32_t l = k + 1; l < node.first + node.count; ++l) {
        if (!meet(topology, k, l, visit)) return false;
      }
    }
    return true;
  }

  template <class Visit>
  bool pairs_between(const SurfaceTopology& topology, std::uint32_t i, std::uint32_t j, const Visit& visit) const {
    if (!nodes[i].overlaps(nodes[j])) return true;
    const SurfaceTopology::Node& a = topology.nodes[i];
    const SurfaceTopology::Node& b = topology.nodes[j];
    if (a.count == 0) {
      return pairs_between(topology, a.first, j, visit) && pairs_between(topology, a.first + 1, j, visit);
    }
    if (b.count == 0) {
      return pairs_between(topology, i, b.first, visit) && pairs_between(topology, i, b.first + 1, visit);
    }
    for (std::uint32_t k = a.first; k < a.first + a.count; ++k) {
      for (std::uint32_t l = b.first; l < b.first + b.count; ++l) {
        if (!meet(topology, k, l, visit)) return false;
      }
    }
    return true;
  }

  template <class Visit>
  bool meet(const SurfaceTopology& topology, std::uint32_t k, std::uint32_t l, const Visit& visit) const {
    const std::uint32_t f = topology.faces[k];
    const std::uint32_t g = topology.faces[l];
    return !faces[f].overlaps(faces[g]) || visit(f, g);
  }
};

}  // namespace pneuma::physics
