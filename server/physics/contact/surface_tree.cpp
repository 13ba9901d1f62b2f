#include "physics/contact/surface_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace pneuma::physics {
namespace {

// Smaller leaves make the tree deeper than their tests cost.
constexpr std::uint32_t leaf_faces_max = 4;

class Builder {
 public:
  explicit Builder(SurfaceTopology& tree) : tree_(tree) {
    const Mesh& mesh = *tree.mesh;
    for (const Face& face : mesh.faces) {
      centres_.push_back(mesh.positions_m[face[0]] + mesh.positions_m[face[1]] + mesh.positions_m[face[2]]);
    }
    tree.faces.resize(mesh.faces.size());
    std::iota(tree.faces.begin(), tree.faces.end(), 0U);
    tree.nodes.emplace_back();
    split(0, 0, static_cast<std::uint32_t>(tree.faces.size()));
  }

 private:
  // At the median of the longest side. Faces at one place are told apart by their index.
  void split(std::uint32_t node, std::uint32_t begin, std::uint32_t end) {
    if (end - begin <= leaf_faces_max) {
      tree_.nodes[node] = {begin, end - begin};
      return;
    }
    Box box;
    for (std::uint32_t i = begin; i < end; ++i) box.include(centres_[tree_.faces[i]]);
    Eigen::Index axis = 0;
    (box.high - box.low).maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(tree_.faces.begin() + begin, tree_.faces.begin() + middle, tree_.faces.begin() + end,
                     [&](std::uint32_t f, std::uint32_t g) {
                       const double at_f = centres_[f][axis];
                       const double at_g = centres_[g][axis];
                       return at_f < at_g || (at_f == at_g && f < g);
                     });
    const auto left = static_cast<std::uint32_t>(tree_.nodes.size());
    tree_.nodes[node] = {left, 0};
    tree_.nodes.resize(tree_.nodes.size() + 2);
    split(left, begin, middle);
    split(left + 1, middle, end);
  }

  SurfaceTopology& tree_;
  std::vector<Vec3d> centres_;
};

void give_features_to_faces(SurfaceTopology& tree) {
  const Mesh& mesh = *tree.mesh;
  std::vector<std::uint8_t> taken_vertices(mesh.positions_m.size(), 0);
  std::vector<std::uint8_t> taken_edges(mesh.edges.size(), 0);
  tree.owned.resize(mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    SurfaceTopology::OwnedFeatures& owned = tree.owned[f];
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t vertex = mesh.faces[f][i];
      if (std::exchange(taken_vertices[vertex], std::uint8_t{1}) == 0) owned.vertices[owned.vertex_count++] = vertex;
      const Edge edge{std::min(vertex, mesh.faces[f][(i + 1) % 3]), std::max(vertex, mesh.faces[f][(i + 1) % 3])};
      const auto at = std::ranges::lower_bound(mesh.edges, edge) - mesh.edges.begin();
      const auto index = static_cast<std::uint32_t>(at);
      if (std::exchange(taken_edges[index], std::uint8_t{1}) == 0) owned.edges[owned.edge_count++] = index;
    }
  }
}

}  // namespace

std::shared_ptr<const SurfaceTopology> make_surface_topology(std::shared_ptr<const Mesh> mesh) {
  auto tree = std::make_shared<SurfaceTopology>();
  tree->mesh = std::move(mesh);
  const Builder builder(*tree);
  give_features_to_faces(*tree);
  return tree;
}

Box way_box(const Face& face, std::span<const Vec3d> from, std::span<const Vec3d> to, double margin_m) {
  const auto& [a, b, c] = face;
  const Vec3d margin = Vec3d::Constant(margin_m);
  return {from[a].cwiseMin(from[b]).cwiseMin(from[c]).cwiseMin(to[a]).cwiseMin(to[b]).cwiseMin(to[c]) - margin,
          from[a].cwiseMax(from[b]).cwiseMax(from[c]).cwiseMax(to[a]).cwiseMax(to[b]).cwiseMax(to[c]) + margin};
}

void SurfaceBoxes::fit(const SurfaceTopology& topology, std::span<const Vec3d> from, std::span<const Vec3d> to,
                       double margin_m) {
  const Mesh& mesh = *topology.mesh;
  faces.resize(mesh.faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) faces[f] = way_box(mesh.faces[f], from, to, margin_m);
  nodes.resize(topology.nodes.size());
  for (std::size_t i = nodes.size(); i-- > 0;) {
    const SurfaceTopology::Node& node = topology.nodes[i];
    Box box;
    if (node.count == 0) {
      box = nodes[node.first];
      box.include(nodes[node.first + 1]);
    }
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) box.include(faces[topology.faces[k]]);
    nodes[i] = box;
  }
}

}  // namespace pneuma::physics
