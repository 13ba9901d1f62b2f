#include "physics/mesh/mesh_tree.h"

#include <algorithm>
#include <utility>

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

// Of the sine of the angle between two faces: what is less is level.
constexpr double level_sine_max = 1e-6;

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
      const Vector3d normal = unit_normal(tree.surface(), first_face[index]);
      const Vector3d other = unit_normal(tree.surface(), f);
      is_level[index] = normal.dot(other) > 0.0 && normal.cross(other).norm() <= level_sine_max ? 1 : 0;
    }
  }
  tree.sharp_edges.resize(mesh.faces.size());
  for (std::uint32_t e = 0; e < mesh.edges.size(); ++e) {
    if (is_level[e] == 0) tree.sharp_edges[first_face[e]].push_back(e);
  }
}

}  // namespace

std::shared_ptr<const MeshTree> make_mesh_tree(std::shared_ptr<const Mesh> mesh) {
  auto tree = std::make_shared<MeshTree>();
  tree->mesh = std::move(mesh);
  tree->faces = make_face_tree(tree->surface());
  find_sharp_edges(*tree);
  return tree;
}

}  // namespace pneuma::physics
