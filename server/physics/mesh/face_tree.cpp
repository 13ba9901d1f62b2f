#include "physics/mesh/face_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t tree_leaf_faces_max = 4;

class TreeBuilder {
 public:
  TreeBuilder(const FacesAt& surface, FaceTree& tree) : surface_(surface), tree_(tree) {
    for (const auto& [a, b, c] : surface.faces) {
      centres_m_.emplace_back(surface.positions_m[a] + surface.positions_m[b] + surface.positions_m[c]);
    }
    tree.faces.resize(surface.faces.size());
    std::iota(tree.faces.begin(), tree.faces.end(), 0U);
    tree.nodes.reserve(surface.faces.size());
    tree.nodes.emplace_back();
    split(0, 0, static_cast<std::uint32_t>(tree.faces.size()));
  }

 private:
  [[nodiscard]] FaceTree::Box box_of(std::uint32_t begin, std::uint32_t end) const {
    const Vector3d& first_m = surface_.positions_m[surface_.faces[tree_.faces[begin]][0]];
    FaceTree::Box box{first_m, first_m};
    for (std::uint32_t i = begin; i < end; ++i) {
      for (const std::uint32_t vertex : surface_.faces[tree_.faces[i]]) {
        box.low_m = box.low_m.cwiseMin(surface_.positions_m[vertex]);
        box.high_m = box.high_m.cwiseMax(surface_.positions_m[vertex]);
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

  const FacesAt& surface_;
  FaceTree& tree_;
  std::vector<Vector3d> centres_m_;  // three times
};

class NearestFinder {
 public:
  NearestFinder(const FaceTree& tree, const FacesAt& surface, const Vector3d& point_m)
      : tree_(tree), surface_(surface), point_m_(point_m) {
    best_.distance_m = std::numeric_limits<double>::infinity();
    descend(0);
  }
  [[nodiscard]] const MeshPoint& best() const { return best_; }
  [[nodiscard]] std::uint64_t looks() const { return looks_; }

 private:
  void descend(std::uint32_t index) {
    const FaceTree::Node& node = tree_.nodes[index];
    if (node.box.distance_m(point_m_) > as_near * best_.distance_m) return;
    if (node.count == 0) {
      const double left_m = tree_.nodes[node.first].box.distance_m(point_m_);
      const double right_m = tree_.nodes[node.first + 1].box.distance_m(point_m_);
      descend(left_m <= right_m ? node.first : node.first + 1);
      descend(left_m <= right_m ? node.first + 1 : node.first);
    }
    looks_ += node.count;
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) consider(tree_.faces[k]);
  }

  void consider(std::uint32_t face) {
    MeshPoint found = nearest_surface_point(surface_.positions_m, surface_.faces.subspan(face, 1), point_m_);
    found.face = face;
    const bool nearer = as_near * found.distance_m < best_.distance_m;
    if (!nearer && found.distance_m > as_near * best_.distance_m) return;
    const double across = std::abs(unit_normal(surface_, face).dot(point_m_ - found.position_m));
    if (!nearer && across <= across_) return;
    best_ = found;
    across_ = across;
  }

  static constexpr double as_near = 1.0 + 1e-9;
  const FaceTree& tree_;
  const FacesAt& surface_;
  const Vector3d& point_m_;
  MeshPoint best_;
  double across_ = 0.0;
  std::uint64_t looks_ = 0;
};

class FirstHitFinder {
 public:
  FirstHitFinder(const FaceTree& tree, const FacesAt& surface, const Ray& ray)
      : tree_(tree), surface_(surface), ray_(ray) {
    if (const auto entered_m = tree.nodes[0].box.entered_m(ray)) descend(0, *entered_m);
  }
  [[nodiscard]] const std::optional<MeshPoint>& first() const { return first_; }
  [[nodiscard]] std::uint64_t looks() const { return looks_; }

 private:
  void descend(std::uint32_t index, double entered_m) {
    if (first_ && entered_m > first_->distance_m) return;
    const FaceTree::Node& node = tree_.nodes[index];
    if (node.count == 0) {
      const auto left_m = tree_.nodes[node.first].box.entered_m(ray_);
      const auto right_m = tree_.nodes[node.first + 1].box.entered_m(ray_);
      const bool right_first = right_m && (!left_m || *right_m < *left_m);
      if (right_first) descend(node.first + 1, *right_m);
      if (left_m) descend(node.first, *left_m);
      if (right_m && !right_first) descend(node.first + 1, *right_m);
    }
    looks_ += node.count;
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
      std::optional<MeshPoint> hit = first_hit(surface_.positions_m, surface_.faces.subspan(tree_.faces[k], 1), ray_);
      if (!hit) continue;
      hit->face = tree_.faces[k];
      const auto order = [](const MeshPoint& at) { return std::pair(at.distance_m, at.face); };
      if (!first_ || order(*hit) < order(*first_)) first_ = hit;
    }
  }

  const FaceTree& tree_;
  const FacesAt& surface_;
  const Ray& ray_;
  std::optional<MeshPoint> first_;
  std::uint64_t looks_ = 0;
};

}  // namespace

std::optional<double> FaceTree::Box::entered_m(const Ray& ray) const {
  const Vector3d middle_m = 0.5 * (low_m + high_m);
  const Vector3d to_box_m = ray.origin_m - middle_m;
  const double rounding_m =
      8.0 * std::numeric_limits<double>::epsilon() * (ray.origin_m.cwiseAbs() + middle_m.cwiseAbs()).maxCoeff();
  const Vector3d half_m = (0.5 * (high_m - low_m)).array() + rounding_m;
  if ((to_box_m.array().abs() <= half_m.array()).all()) return 0.0;
  return hit_box_m({to_box_m, ray.direction}, half_m);
}

FaceTree::Box box_about(std::span<const Vector3d> positions_m) {
  FaceTree::Box box{positions_m.front(), positions_m.front()};
  for (const Vector3d& position_m : positions_m) {
    box.low_m = box.low_m.cwiseMin(position_m);
    box.high_m = box.high_m.cwiseMax(position_m);
  }
  return box;
}

FaceTree one_leaf(const FacesAt& surface) {
  FaceTree tree;
  tree.faces.resize(surface.faces.size());
  std::iota(tree.faces.begin(), tree.faces.end(), 0U);
  tree.nodes.push_back({box_about(surface.positions_m), 0, static_cast<std::uint32_t>(tree.faces.size())});
  return tree;
}

FaceTree make_face_tree(const FacesAt& surface) {
  FaceTree tree;
  const TreeBuilder builder(surface, tree);
  return tree;
}

MeshPoint nearest_in(const FaceTree& tree, const FacesAt& surface, const Vector3d& point_m, std::uint64_t* looks) {
  const NearestFinder finder(tree, surface, point_m);
  if (looks != nullptr) *looks += finder.looks();
  return finder.best();
}

std::optional<MeshPoint> first_hit_in(const FaceTree& tree, const FacesAt& surface, const Ray& ray,
                                      std::uint64_t* looks) {
  const FirstHitFinder finder(tree, surface, ray);
  if (looks != nullptr) *looks += finder.looks();
  return finder.first();
}

Vector3d unit_normal(const FacesAt& surface, std::uint32_t face) {
  const auto& [a, b, c] = surface.faces[face];
  const auto& at_m = surface.positions_m;
  return (at_m[b] - at_m[a]).cross(at_m[c] - at_m[a]).normalized();
}

}  // namespace pneuma::physics
