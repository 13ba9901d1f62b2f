#include "physics/mesh/mesh_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <utility>

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t tree_leaf_faces_max = 4;
// Of the sine of the angle between two faces: what is less is level.
constexpr double level_sine_max = 1e-6;

class TreeBuilder {
 public:
  explicit TreeBuilder(MeshTree& tree) : tree_(tree) {
    const Mesh& mesh = *tree.mesh;
    for (const auto& [a, b, c] : mesh.faces) {
      centres_m_.push_back(mesh.positions_m[a] + mesh.positions_m[b] + mesh.positions_m[c]);
    }
    tree.faces.resize(mesh.faces.size());
    std::iota(tree.faces.begin(), tree.faces.end(), 0U);
    tree.nodes.emplace_back();
    split(0, 0, static_cast<std::uint32_t>(tree.faces.size()));
  }

 private:
  [[nodiscard]] MeshTree::Box box_of(std::uint32_t begin, std::uint32_t end) const {
    const Mesh& mesh = *tree_.mesh;
    MeshTree::Box box{mesh.positions_m[mesh.faces[tree_.faces[begin]][0]],
                      mesh.positions_m[mesh.faces[tree_.faces[begin]][0]]};
    for (std::uint32_t i = begin; i < end; ++i) {
      for (const std::uint32_t vertex : mesh.faces[tree_.faces[i]]) {
        box.low_m = box.low_m.cwiseMin(mesh.positions_m[vertex]);
        box.high_m = box.high_m.cwiseMax(mesh.positions_m[vertex]);
      }
    }
    return box;
  }

  // At the median of the longest side. Faces at one place are told apart by their index.
  void split(std::uint32_t node, std::uint32_t begin, std::uint32_t end) {
    tree_.nodes[node].box = box_of(begin, end);
    if (end - begin <= tree_leaf_faces_max) {
      tree_.nodes[node].first = begin;
      tree_.nodes[node].count = end - begin;
      return;
    }
    Eigen::Index axis = 0;
    (tree_.nodes[node].box.high_m - tree_.nodes[node].box.low_m).maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(tree_.faces.begin() + begin, tree_.faces.begin() + middle, tree_.faces.begin() + end,
                     [&](std::uint32_t f, std::uint32_t g) {
                       return std::pair(centres_m_[f][axis], f) < std::pair(centres_m_[g][axis], g);
                     });
    const auto left = static_cast<std::uint32_t>(tree_.nodes.size());
    tree_.nodes[node].first = left;
    tree_.nodes.resize(tree_.nodes.size() + 2);
    split(left, begin, middle);
    split(left + 1, middle, end);
  }

  MeshTree& tree_;
  std::vector<Vector3d> centres_m_;
};

Vector3d unit_normal(const Mesh& mesh, const Face& face) {
  const auto& [a, b, c] = face;
  return (mesh.positions_m[b] - mesh.positions_m[a]).cross(mesh.positions_m[c] - mesh.positions_m[a]).normalized();
}

double distance_to(const MeshTree::Box& box, const Vector3d& point_m) {
  return (box.low_m - point_m).cwiseMax(point_m - box.high_m).cwiseMax(0.0).norm();
}

class NearestFinder {
 public:
  NearestFinder(const MeshTree& tree, const Vector3d& point_m) : tree_(tree), point_m_(point_m) {
    best_.distance_m = std::numeric_limits<double>::infinity();
    descend(0);
  }
  [[nodiscard]] const MeshPoint& best() const { return best_; }

 private:
  void descend(std::uint32_t index) {
    const MeshTree::Node& node = tree_.nodes[index];
    if (distance_to(node.box, point_m_) > as_near * best_.distance_m) return;
    if (node.count == 0) {
      const double left_m = distance_to(tree_.nodes[node.first].box, point_m_);
      const double right_m = distance_to(tree_.nodes[node.first + 1].box, point_m_);
      descend(left_m <= right_m ? node.first : node.first + 1);
      descend(left_m <= right_m ? node.first + 1 : node.first);
    }
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) consider(tree_.faces[k]);
  }

  void consider(std::uint32_t face) {
    const Mesh& mesh = *tree_.mesh;
    MeshPoint found = nearest_surface_point(mesh.positions_m, std::span(mesh.faces).subspan(face, 1), point_m_);
    found.face = face;
    const double across = std::abs(unit_normal(mesh, mesh.faces[face]).dot(point_m_ - found.position_m));
    const bool nearer = as_near * found.distance_m < best_.distance_m;
    const bool ties = !nearer && found.distance_m <= as_near * best_.distance_m;
    if (!nearer && !(ties && across > across_)) return;
    best_ = found;
    across_ = across;
  }

  static constexpr double as_near = 1.0 + 1e-9;
  const MeshTree& tree_;
  const Vector3d& point_m_;
  MeshPoint best_;
  double across_ = 0.0;
};

void find_sharp_edges(MeshTree& tree) {
  const Mesh& mesh = *tree.mesh;
  constexpr std::uint32_t none = 0xffffffffU;
  std::vector<std::uint32_t> first_face(mesh.edges.size(), none);
  std::vector<std::uint8_t> is_level(mesh.edges.size(), 0);
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t start = mesh.faces[f][i];
      const std::uint32_t end = mesh.faces[f][(i + 1) % 3];
      const Edge edge{std::min(start, end), std::max(start, end)};
      const auto index = static_cast<std::size_t>(std::ranges::lower_bound(mesh.edges, edge) - mesh.edges.begin());
      if (first_face[index] == none) {
        first_face[index] = f;
        continue;
      }
      const Vector3d normal = unit_normal(mesh, mesh.faces[first_face[index]]);
      const Vector3d other = unit_normal(mesh, mesh.faces[f]);
      is_level[index] = normal.dot(other) > 0.0 && normal.cross(other).norm() <= level_sine_max ? 1 : 0;
    }
  }
  tree.sharp_edges.resize(mesh.faces.size());
  for (std::uint32_t e = 0; e < mesh.edges.size(); ++e) {
    if (is_level[e] == 0) tree.sharp_edges[first_face[e]].push_back(e);
  }
}

}  // namespace

MeshPoint MeshTree::nearest(const Vector3d& point_m) const {
  return NearestFinder(*this, point_m).best();
}

std::shared_ptr<const MeshTree> make_mesh_tree(std::shared_ptr<const Mesh> mesh) {
  auto tree = std::make_shared<MeshTree>();
  tree->mesh = std::move(mesh);
  const TreeBuilder builder(*tree);
  find_sharp_edges(*tree);
  return tree;
}

}  // namespace pneuma::physics
