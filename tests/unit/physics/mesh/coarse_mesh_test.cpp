// Shows that a coarser mesh is what its level asks for: a subset of the vertices, of the size of its level, with
// triangles that are the same kind of surface (closed or with its borders, a manifold, of the same Euler
// characteristic) near the one they stand for; the same whenever it is made; and that any triangles will do.
#include "physics/mesh/coarse_mesh.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "physics/mesh/mesh_builders.h"
#include "scene_io/load.h"
#include "scene_io/mesh_library.h"
#include "unit/physics/mesh/built_mesh.h"

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

MeshPtr hand() {
  const auto scene = scene_io::builtin_scene("hand");
  EXPECT_TRUE(scene.ok());
  const auto meshes = scene_io::MeshLibrary::build(*scene);
  EXPECT_TRUE(meshes.ok());
  return built(meshes->find("hand"));
}

/// A torus of `around` x `across` quads, each in two triangles.
MeshPtr torus(std::uint32_t around, std::uint32_t across) {
  std::vector<Vector3d> positions_m;
  std::vector<Face> faces;
  const double turn = 2.0 * std::acos(-1.0);
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < across; ++j) {
      const double a = turn * i / around;
      const double b = turn * j / across;
      const double r_m = 1.0 + 0.4 * std::cos(b);
      positions_m.emplace_back(r_m * std::cos(a), r_m * std::sin(a), 0.4 * std::sin(b));
      const auto at = [&](std::uint32_t m, std::uint32_t n) { return (i + m) % around * across + (j + n) % across; };
      faces.push_back({at(0, 0), at(1, 0), at(1, 1)});
      faces.push_back({at(0, 0), at(1, 1), at(0, 1)});
    }
  }
  return built(make_mesh(positions_m, faces));
}

std::vector<Vector3d> positions_of(const Mesh& mesh, const CoarseMesh& coarse) {
  std::vector<Vector3d> positions_m;
  for (const std::uint32_t vertex : coarse.kept) positions_m.push_back(mesh.positions_m[vertex]);
  return positions_m;
}

/// As a mesh of its own, which make_mesh() checks: no edge of three faces, none that is run through twice one way.
MeshPtr as_mesh(const Mesh& mesh, const CoarseMesh& coarse) {
  return built(make_mesh(positions_of(mesh, coarse), coarse.faces));
}

void expect_a_quarter_each_level(const MeshPtr& mesh) {
  std::vector<std::uint32_t> below;
  std::size_t expected = mesh->positions_m.size();
  for (std::uint32_t level = 0; level <= base::level_of_detail_max; ++level) {
    const CoarseMesh coarse = coarsen(mesh->positions_m, mesh->faces, level);
    ASSERT_TRUE(std::ranges::is_sorted(coarse.kept));
    EXPECT_EQ(coarse.kept.size(), expected) << "level " << level;
    if (level > 0) {
      EXPECT_TRUE(std::ranges::includes(below, coarse.kept)) << "level " << level;
    }
    const MeshPtr surface = as_mesh(*mesh, coarse);
    ASSERT_NE(surface, nullptr) << "level " << level;
    EXPECT_EQ(surface->closed, mesh->closed);
    EXPECT_EQ(euler_characteristic(*surface), euler_characteristic(*mesh)) << "level " << level;
    for (const std::uint32_t vertex : surface->boundary) {
      EXPECT_TRUE(std::ranges::binary_search(mesh->boundary, coarse.kept[vertex])) << "level " << level;
    }
    below = coarse.kept;
    expected = std::max((expected + 3) / 4, std::min(expected, base::coarse_vertices_min));
  }
}

TEST(CoarseMesh, OfAClosedMeshIsClosedAndKeepsAQuarterEachLevel) {
  expect_a_quarter_each_level(built(make_icosphere(4, 0.5)));
  expect_a_quarter_each_level(built(make_box({1.0, 2.0, 0.5}, 8)));
  expect_a_quarter_each_level(hand());
  expect_a_quarter_each_level(torus(48, 24));
}

TEST(CoarseMesh, OfASheetKeepsItsBorderOnTheBorder) {
  const MeshPtr sheet = built(make_grid(40, 30, 2.0, 1.5));
  expect_a_quarter_each_level(sheet);
  // Its corners, and so all of its area.
  const CoarseMesh coarse = coarsen(sheet->positions_m, sheet->faces, 2);
  double area_m2 = 0.0;
  for (const Face& face : coarse.faces) area_m2 += face_area_m2(positions_of(*sheet, coarse), face);
  EXPECT_NEAR(area_m2, 3.0, 1e-12);
}

TEST(CoarseMesh, IsNearTheShapeItStandsFor) {
  const MeshPtr ball = built(make_icosphere(4, 1.0));
  const double volume_m3 = signed_volume_m3(ball->positions_m, ball->faces);
  for (const auto& [level, volume_share_min] : {std::pair{1U, 0.98}, {2U, 0.94}, {3U, 0.78}}) {
    const CoarseMesh coarse = coarsen(ball->positions_m, ball->faces, level);
    const double share = signed_volume_m3(positions_of(*ball, coarse), coarse.faces) / volume_m3;
    EXPECT_GT(share, volume_share_min) << "level " << level;  // no less than the icosphere of as many vertices has
    EXPECT_LT(share, 1.0);
  }
}

TEST(CoarseMesh, IsTheSameWheneverItIsMade) {
  const MeshPtr mesh = hand();
  const CoarseMesh once = coarsen(mesh->positions_m, mesh->faces, 2);
  const CoarseMesh again = coarsen(mesh->positions_m, mesh->faces, 2);
  EXPECT_EQ(once.kept, again.kept);
  EXPECT_EQ(once.faces, again.faces);
}

TEST(CoarseMesh, OfAFewVerticesIsTheMeshItself) {
  const MeshPtr ball = built(make_icosphere(0, 1.0));
  const CoarseMesh coarse = coarsen(ball->positions_m, ball->faces, base::level_of_detail_max);
  EXPECT_EQ(coarse.kept.size(), 12U);
  EXPECT_EQ(coarse.faces, ball->faces);
}

TEST(CoarseMesh, LeavesAVertexThatTwoFansShare) {
  // Two balls that meet in a point: the last vertex of one is the first of the other.
  const MeshPtr ball = built(make_icosphere(3, 1.0));
  std::vector<Vector3d> positions_m = ball->positions_m;
  std::vector<Face> faces = ball->faces;
  const auto shared = static_cast<std::uint32_t>(positions_m.size() - 1);
  const Vector3d shift = positions_m[shared] - positions_m[0];
  for (std::size_t i = 1; i < ball->positions_m.size(); ++i) positions_m.emplace_back(ball->positions_m[i] + shift);
  for (const Face& face : ball->faces) {
    faces.push_back({face[0] + shared, face[1] + shared, face[2] + shared});
  }
  const MeshPtr pair = built(make_mesh(positions_m, faces));
  ASSERT_NE(pair, nullptr);
  const CoarseMesh coarse = coarsen(pair->positions_m, pair->faces, 2);
  EXPECT_TRUE(std::ranges::binary_search(coarse.kept, shared));
  const MeshPtr surface = as_mesh(*pair, coarse);
  ASSERT_NE(surface, nullptr);
  EXPECT_TRUE(surface->closed);
  EXPECT_EQ(euler_characteristic(*surface), euler_characteristic(*pair));
}

TEST(CoarseMesh, OfAnyTrianglesAtAllIsASubset) {
  // As a recording may hold them: faces of one vertex, repeated ones, edges of many faces, fans of thousands, vertices
  // of no face, all in one place or not.
  std::uint32_t state = 1;
  const auto random = [&state](std::uint32_t below) {
    state = state * 1'664'525U + 1'013'904'223U;
    return (state >> 8) % below;
  };
  for (const std::uint32_t vertices : {1U, 3U, 40U, 3'000U}) {
    for (const double size_m : {0.0, 1.0}) {
      std::vector<Vector3d> positions_m;
      std::vector<Face> faces;
      for (std::uint32_t i = 0; i < vertices; ++i) {
        positions_m.emplace_back(size_m * random(100), size_m * random(100), size_m * random(100));
      }
      for (std::uint32_t i = 0; i < 2 * vertices; ++i) {
        faces.push_back({random(vertices), random(vertices), random(vertices)});
        faces.push_back({0, i % vertices, (i + 1) % vertices});
      }
      const CoarseMesh coarse = coarsen(positions_m, faces, 3);
      ASSERT_FALSE(coarse.kept.empty());
      EXPECT_EQ(std::ranges::adjacent_find(coarse.kept, std::greater_equal<>()), coarse.kept.end());
      EXPECT_LT(coarse.kept.back(), vertices);
      for (const Face& face : coarse.faces) {
        EXPECT_TRUE(std::ranges::all_of(face, [&](std::uint32_t vertex) { return vertex < coarse.kept.size(); }));
      }
    }
  }
}

}  // namespace
}  // namespace pneuma::physics
