// Convex meshes that tests fill.
#pragma once

#include <cmath>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "physics/mesh/polyhedron.h"
#include "physics/scene/scene.h"
#include "unit/physics/mesh/built_mesh.h"

namespace pneuma::physics {

/// Regular, with its centre at the origin.
inline MeshPtr tetrahedron(double edge_m) {
  const double s = edge_m / std::sqrt(8.0);
  return built(make_mesh({Vec3d(s, s, s), Vec3d(s, -s, -s), Vec3d(-s, s, -s), Vec3d(-s, -s, s)},
                         {Face{0, 1, 2}, Face{0, 3, 1}, Face{0, 2, 3}, Face{1, 3, 2}}));
}

/// Likewise, with its corners on the axes.
inline MeshPtr octahedron(double edge_m) {
  const double r = edge_m / std::sqrt(2.0);
  return built(
      make_mesh({Vec3d(r, 0, 0), Vec3d(-r, 0, 0), Vec3d(0, r, 0), Vec3d(0, -r, 0), Vec3d(0, 0, r), Vec3d(0, 0, -r)},
                {Face{0, 2, 4}, Face{2, 1, 4}, Face{1, 3, 4}, Face{3, 0, 4}, Face{2, 0, 5}, Face{1, 2, 5},
                 Face{3, 1, 5}, Face{0, 3, 5}}));
}

/// The mesh, turned and then shifted.
inline MeshPtr turned_and_shifted(const Mesh& mesh, const Quatd& turn, const Vec3d& shift) {
  std::vector<Vec3d> positions_m;
  for (const Vec3d& p : mesh.positions_m) positions_m.push_back(turn * p + shift);
  return built(make_mesh(std::move(positions_m), mesh.faces));
}

inline std::shared_ptr<const Polyhedron> filled(const Mesh& mesh) {
  auto made = make_polyhedron(mesh);
  EXPECT_TRUE(made.ok()) << made.status().message();
  return made.ok() ? *made : nullptr;
}

inline ConvexShape convex(const MeshPtr& mesh) {
  return {"mesh", mesh, filled(*mesh)};
}

}  // namespace pneuma::physics
