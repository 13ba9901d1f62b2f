// Shows that the mesh builders make the shapes that they name (counts, Euler's formula V - E + F = 2, radii, volumes
// against closed forms), that what is derived from a mesh is right, and that each kind of bad mesh is refused by the
// name of its face or vertex.
#include "physics/mesh/mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "base/limits.h"
#include "physics/mesh/mesh_builders.h"
#include "unit/physics/mesh/built_mesh.h"

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

constexpr double nan_m = std::numeric_limits<double>::quiet_NaN();

std::vector<Vector3d> tetrahedron_positions() {
  return {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
}
std::vector<Face> tetrahedron_faces() {
  return {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
}

TEST(Icosphere, HasTheCountsOfASplitIcosahedron) {
  std::size_t fourth_power = 1;
  for (std::uint32_t s = 0; s <= base::icosphere_subdivisions_max; ++s, fourth_power *= 4) {
    const MeshPtr mesh = built(make_icosphere(s, 1.0));
    EXPECT_EQ(mesh->positions_m.size(), 10 * fourth_power + 2);
    EXPECT_EQ(mesh->faces.size(), 20 * fourth_power);
    EXPECT_EQ(mesh->edges.size(), 30 * fourth_power);
    EXPECT_EQ(euler_characteristic(*mesh), 2);
    EXPECT_TRUE(mesh->closed);
  }
}

TEST(Icosphere, PutsEveryVertexOnTheRadius) {
  const double radius_m = 0.37;
  const MeshPtr mesh = built(make_icosphere(4, radius_m));
  for (const Vector3d& position : mesh->positions_m) EXPECT_NEAR(position.norm(), radius_m, 1e-15);
}

TEST(Icosphere, IsRegularWithoutSubdivision) {
  const MeshPtr mesh = built(make_icosphere(0, 1.0));
  const double edge_m = 4.0 / std::sqrt(10.0 + 2.0 * std::sqrt(5.0));
  for (const double length_m : mesh->edge_lengths_m) EXPECT_NEAR(length_m, edge_m, 1e-15);
  for (const std::uint32_t count : mesh->face_counts) EXPECT_EQ(count, 5U);
}

TEST(Icosphere, VolumeNearsTheBallsFromBelowWithOrderTwo) {
  const double ball_m3 = 4.0 / 3.0 * std::numbers::pi;
  double missing_before_m3 = 0.0;
  for (std::uint32_t s = 1; s <= 5; ++s) {
    const MeshPtr mesh = built(make_icosphere(s, 1.0));
    const double missing_m3 = ball_m3 - signed_volume_m3(mesh->positions_m, mesh->faces);
    EXPECT_GT(missing_m3, 0.0);
    if (s > 1) {
      EXPECT_NEAR(std::log2(missing_before_m3 / missing_m3), 2.0, 0.1) << "subdivision " << s;
    }
    missing_before_m3 = missing_m3;
  }
}

TEST(Icosphere, RefusesSizesThatItCannotMake) {
  EXPECT_EQ(make_icosphere(base::icosphere_subdivisions_max + 1, 1.0).status().where(), "subdivisions");
  EXPECT_EQ(make_icosphere(~std::uint32_t{0}, 1.0).status().code(), base::StatusCode::limit_exceeded);
  for (const double radius_m : {0.0, -1.0, nan_m, 2e7, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(make_icosphere(1, radius_m).status().where(), "radius_m") << radius_m;
  }
}

TEST(Grid, HasAnOpenBorderAndFacesUp) {
  const std::uint32_t columns = 7;
  const std::uint32_t rows = 4;
  const MeshPtr mesh = built(make_grid(columns, rows, 3.5, 2.0));
  EXPECT_EQ(mesh->positions_m.size(), std::size_t{(columns + 1) * (rows + 1)});
  EXPECT_EQ(mesh->faces.size(), std::size_t{2 * columns * rows});
  EXPECT_EQ(euler_characteristic(*mesh), 1);
  EXPECT_FALSE(mesh->closed);
  EXPECT_EQ(mesh->boundary.size(), std::size_t{2 * (columns + rows)});
  for (const std::uint32_t vertex : mesh->boundary) {
    const Vector3d& position = mesh->positions_m[vertex];
    EXPECT_TRUE(std::abs(position.x()) == 1.75 || std::abs(position.z()) == 1.0);
  }
  double area_m2 = 0.0;
  for (const auto& [a, b, c] : mesh->faces) {
    const Vector3d normal =
        (mesh->positions_m[b] - mesh->positions_m[a]).cross(mesh->positions_m[c] - mesh->positions_m[a]);
    EXPECT_GT(normal.y(), 0.0);
    area_m2 += normal.norm() / 2;
  }
  EXPECT_NEAR(area_m2, 7.0, 1e-13);
}

TEST(Grid, RefusesSizesThatItCannotMake) {
  EXPECT_EQ(make_grid(0, 1, 1, 1).status().where(), "columns");
  EXPECT_EQ(make_grid(1, 0, 1, 1).status().where(), "rows");
  EXPECT_EQ(make_grid(~std::uint32_t{0}, 1, 1, 1).status().code(), base::StatusCode::limit_exceeded);
  EXPECT_EQ(make_grid(1, ~std::uint32_t{0}, 1, 1).status().where(), "rows");
  EXPECT_EQ(make_grid(256, 256, 1, 1).status().code(), base::StatusCode::limit_exceeded);
  EXPECT_TRUE(make_grid(255, 255, 1, 1).ok());
  EXPECT_EQ(make_grid(1, 1, 0, 1).status().where(), "width_m");
  EXPECT_EQ(make_grid(1, 1, 1, nan_m).status().where(), "height_m");
}

TEST(Box, HasTheExactVolumeAndCounts) {
  for (const std::uint32_t n : {1U, 2U, 5U}) {
    const MeshPtr mesh = built(make_box({0.5, 1.0, 2.0}, n));
    EXPECT_EQ(mesh->positions_m.size(), std::size_t{6 * n * n + 2});
    EXPECT_EQ(mesh->faces.size(), std::size_t{12 * n * n});
    EXPECT_EQ(euler_characteristic(*mesh), 2);
    EXPECT_TRUE(mesh->closed);
    EXPECT_NEAR(signed_volume_m3(mesh->positions_m, mesh->faces), 8.0, 1e-13);
  }
  EXPECT_EQ(built(make_box({1, 1, 1}, 0))->faces.size(), 12U);
}

TEST(Box, RefusesSizesThatItCannotMake) {
  EXPECT_EQ(make_box({1, 0, 1}, 1).status().where(), "half_extents.y");
  EXPECT_EQ(make_box({1, 1, nan_m}, 1).status().where(), "half_extents.z");
  EXPECT_EQ(make_box({1, 1, 1}, 105).status().where(), "subdivisions");
  EXPECT_EQ(make_box({1, 1, 1}, ~std::uint32_t{0}).status().code(), base::StatusCode::limit_exceeded);
}

TEST(MakeMesh, DerivesEachEdgeOnceInOrder) {
  const MeshPtr mesh = built(make_mesh(tetrahedron_positions(), tetrahedron_faces()));
  const std::vector<Edge> edges{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  EXPECT_EQ(mesh->edges, edges);
  ASSERT_EQ(mesh->edge_lengths_m.size(), 6U);
  EXPECT_DOUBLE_EQ(mesh->edge_lengths_m[0], 1.0);
  EXPECT_DOUBLE_EQ(mesh->edge_lengths_m[5], std::sqrt(2.0));
  EXPECT_EQ(mesh->face_counts, (std::vector<std::uint32_t>{3, 3, 3, 3}));
  EXPECT_NEAR(signed_volume_m3(mesh->positions_m, mesh->faces), 1.0 / 6.0, 1e-16);
}

TEST(MakeMesh, TakesMillimetresAndPlacesFarFromTheOrigin) {
  std::vector<Vector3d> small = tetrahedron_positions();
  for (Vector3d& position : small) position *= 1e-6;
  EXPECT_TRUE(make_mesh(small, tetrahedron_faces()).ok());
  std::vector<Vector3d> distant = tetrahedron_positions();
  for (Vector3d& position : distant) position += Vector3d(1e6, -1e6, 1e6);
  const MeshPtr mesh = built(make_mesh(distant, tetrahedron_faces()));
  EXPECT_NEAR(signed_volume_m3(mesh->positions_m, mesh->faces), 1.0 / 6.0, 1e-9);
}

struct MeshParts {
  std::vector<Vector3d> positions_m = tetrahedron_positions();
  std::vector<Face> faces = tetrahedron_faces();
};

// What is wrong is made within its test: every start of this program would make and copy the large ones.
struct BadMesh {
  std::string name;
  std::string where;
  std::string what;  // a part of it
  void (*spoil)(MeshParts&);
};

class MakeMeshRefuses : public testing::TestWithParam<BadMesh> {};

TEST_P(MakeMeshRefuses, NamingTheFaceOrVertex) {
  MeshParts parts;
  GetParam().spoil(parts);
  const auto result = make_mesh(parts.positions_m, parts.faces);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.status().where(), GetParam().where);
  EXPECT_NE(result.status().what().find(GetParam().what), std::string::npos) << result.status().what();
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, MakeMeshRefuses,
    testing::ValuesIn(std::vector<BadMesh>{
        {"NoVertex", "positions", "no vertex", [](MeshParts& m) { m.positions_m.clear(); }},
        {"NoFace", "indices", "no face", [](MeshParts& m) { m.faces.clear(); }},
        {"TooManyVertices", "positions", "65537",
         [](MeshParts& m) { m.positions_m.resize(base::mesh_vertices_max + 1, Vector3d::Zero()); }},
        {"TooManyFaces", "indices", "at most",
         [](MeshParts& m) { m.faces.resize(base::mesh_faces_max + 1, Face{0, 1, 2}); }},
        {"NotFinite", "positions[2]", "not finite", [](MeshParts& m) { m.positions_m[2].y() = nan_m; }},
        {"TooFar", "positions[3]", "further than", [](MeshParts& m) { m.positions_m[3].z() = 1.1e7; }},
        {"IndexOutOfRange", "indices[3..5]", "face 1 names vertex 4 of a mesh of 4",
         [](MeshParts& m) { m.faces[1][2] = 4; }},
        {"RepeatedVertex", "indices[6..8]", "face 2 names vertex 3 twice",
         [](MeshParts& m) { m.faces[2] = {0, 3, 3}; }},
        {"ZeroArea", "indices[0..2]", "face 0 has zero area (vertices 0, 2, 1 are in line)",
         [](MeshParts& m) { m.positions_m[2] = {0.3, 0, 0}; }},
        {"UnusedVertex", "positions[4]", "belongs to no face",
         [](MeshParts& m) { m.positions_m.emplace_back(2, 2, 2); }},
        {"FlippedFace", "indices[9..11]", "face 3 is flipped", [](MeshParts& m) { m.faces[3] = {1, 3, 2}; }},
        {"EdgeOfThreeFaces", "indices[12..14]",
         "face 4 shares the edge of vertices 0 and 1 with more than one other face",
         [](MeshParts& m) {
           m.positions_m.emplace_back(0, -1, -1);
           m.faces.push_back({0, 1, 4});
         }}}),
    [](const auto& param) { return param.param.name; });

TEST(HoldsGas, TakesAClosedMeshThatFacesOutwards) {
  EXPECT_TRUE(check_holds_gas(*built(make_icosphere(1, 1.0))).ok());
}

TEST(HoldsGas, NamesAnOpenEdge) {
  std::vector<Face> faces = tetrahedron_faces();
  faces.pop_back();
  const base::Status status = check_holds_gas(*built(make_mesh(tetrahedron_positions(), faces)));
  EXPECT_EQ(status.where(), "mesh");
  EXPECT_NE(status.what().find("vertices 1 and 2 is open"), std::string::npos) << status.what();
}

TEST(HoldsGas, RefusesAMeshThatIsInsideOut) {
  std::vector<Face> faces = tetrahedron_faces();
  for (Face& face : faces) std::swap(face[0], face[1]);
  const base::Status status = check_holds_gas(*built(make_mesh(tetrahedron_positions(), faces)));
  EXPECT_NE(status.what().find("inside out"), std::string::npos) << status.what();
}

TEST(HoldsGas, RefusesAPartThatIsInsideOutBesideALargerOne) {
  std::vector<Vector3d> positions_m = tetrahedron_positions();
  for (const Vector3d& position : tetrahedron_positions()) positions_m.push_back(0.5 * position + Vector3d(3, 0, 0));
  std::vector<Face> faces = tetrahedron_faces();
  for (const Face& face : tetrahedron_faces()) faces.push_back({face[1] + 4, face[0] + 4, face[2] + 4});
  const base::Status status = check_holds_gas(*built(make_mesh(positions_m, faces)));
  EXPECT_NE(status.what().find("the part with face 4 is inside out"), std::string::npos) << status.what();
  for (std::size_t f = 4; f < 8; ++f) std::swap(faces[f][0], faces[f][1]);
  EXPECT_TRUE(check_holds_gas(*built(make_mesh(positions_m, faces))).ok());
}

}  // namespace
}  // namespace pneuma::physics
