// Shows that a filled mesh has the mass of the solid that it bounds (against closed forms, wherever the mesh lies and
// however it is turned), that its surface is where its triangles are, and that what cannot be filled is refused by
// name.
#include "physics/mesh/polyhedron.h"

#include <random>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "unit/physics/mesh/convex_meshes.h"

namespace pneuma::physics {
namespace {

const Vec3d brick_half_m(0.3, 0.2, 0.1);

Eigen::Matrix3d inertia_m2(const Polyhedron& solid) {
  const Eigen::Matrix3d axes = solid.axes.value_or(Quatd::Identity()).toRotationMatrix();
  return axes * solid.moments_m2.asDiagonal() * axes.transpose();
}

TEST(PolyhedronInertia, IsTheClosedFormOfARegularTetrahedron) {
  const auto solid = filled(*tetrahedron(1.5));
  EXPECT_NEAR(solid->volume_m3, std::pow(1.5, 3) / (6.0 * std::sqrt(2.0)), 1e-14);
  EXPECT_TRUE(inertia_m2(*solid).isApprox(1.5 * 1.5 / 20.0 * Eigen::Matrix3d::Identity(), 1e-12));
  EXPECT_LT(solid->centre_m.norm(), 1e-15);
}

TEST(PolyhedronInertia, IsTheClosedFormOfARegularOctahedron) {
  const auto solid = filled(*octahedron(1.5));
  EXPECT_NEAR(solid->volume_m3, std::sqrt(2.0) / 3.0 * std::pow(1.5, 3), 1e-14);
  EXPECT_TRUE(inertia_m2(*solid).isApprox(1.5 * 1.5 / 10.0 * Eigen::Matrix3d::Identity(), 1e-12));
}

TEST(PolyhedronInertia, OfABoxIsThatOfTheBoxShapeAboutTheSameAxes) {
  for (const std::uint32_t subdivisions : {1U, 2U, 3U}) {
    const auto solid = filled(*built(make_box(brick_half_m, subdivisions)));
    const Vec3d squares = brick_half_m.cwiseAbs2();
    const Vec3d wanted = (Vec3d::Constant(squares.sum()) - squares) / 3.0;
    EXPECT_FALSE(solid->axes.has_value());
    EXPECT_TRUE(solid->moments_m2.isApprox(wanted, 1e-12)) << subdivisions;
  }
}

// I' = R I R^T about the centre of mass, which goes along.
TEST(PolyhedronInertia, GoesAlongWithTheMesh) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  const MeshPtr wedge = built(make_mesh({Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(0.2, 0.7, 0), Vec3d(0.3, 0.1, 0.4)},
                                        {Face{0, 2, 1}, Face{0, 1, 3}, Face{1, 2, 3}, Face{2, 0, 3}}));
  const auto before = filled(*wedge);
  EXPECT_TRUE(before->centre_m.isApprox(Vec3d(1.5, 0.8, 0.4) / 4.0, 1e-12)) << "the mean of a tetrahedron's corners";
  for (int i = 0; i < 50; ++i) {
    const Quatd turn = Quatd{within(random), within(random), within(random), within(random)}.normalized();
    const Vec3d shift = 3.0 * Vec3d{within(random), within(random), within(random)};
    const auto after = filled(*turned_and_shifted(*wedge, turn, shift));
    const Eigen::Matrix3d rotation = turn.toRotationMatrix();
    EXPECT_TRUE(after->centre_m.isApprox(turn * before->centre_m + shift, 1e-12)) << i;
    EXPECT_TRUE(inertia_m2(*after).isApprox(rotation * inertia_m2(*before) * rotation.transpose(), 1e-11)) << i;
    EXPECT_NEAR(after->axes->toRotationMatrix().determinant(), 1.0, 1e-12);
  }
}

TEST(Polyhedron, LevelTrianglesAreOneFaceAndWhatLiesInItIsNoCorner) {
  for (const std::uint32_t subdivisions : {1U, 2U, 3U}) {
    const auto solid = filled(*built(make_box(brick_half_m, subdivisions)));
    EXPECT_EQ(solid->corners_m.size(), 8U);
    EXPECT_EQ(solid->sides.size(), 6U);
    EXPECT_EQ(solid->ridges.size(), 12U);
    EXPECT_NEAR(solid->half_width_m, 0.1, 1e-15);
    EXPECT_TRUE(solid->half_extents_m.isApprox(brick_half_m, 1e-15));
    for (const Polyhedron::Side& side : solid->sides) EXPECT_EQ(side.count, 4U);
  }
  EXPECT_EQ(filled(*octahedron(1.0))->ridges.size(), 12U);
  EXPECT_EQ(filled(*built(make_icosphere(1, 1.0)))->corners_m.size(), 42U);
}

// The other way round: the nearest of all triangles, one by one, and the planes for the side.
TEST(Polyhedron, NearestPointIsThatOfItsTriangles) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> within(-2.0, 2.0);
  for (const MeshPtr& mesh :
       {tetrahedron(1.5), octahedron(1.2), built(make_box(brick_half_m, 2)), built(make_icosphere(1, 0.8))}) {
    const auto solid = filled(*mesh);
    for (int i = 0; i < 2'000; ++i) {
      const Vec3d point = (i % 2 == 0 ? 1.0 : 0.3) * Vec3d{within(random), within(random), within(random)};
      const PolyhedronPoint nearest = nearest_point(*solid, point);
      const MeshPoint wanted = nearest_surface_point(mesh->positions_m, mesh->faces, point);
      ASSERT_NEAR(std::abs(nearest.distance_m), wanted.distance_m, 1e-12);
      ASSERT_NEAR((nearest.position_m + nearest.distance_m * nearest.normal - point).norm(), 0.0, 1e-12);
      double over_m = -1e9;
      for (const auto& side : solid->sides) over_m = std::max(over_m, side.normal.dot(point) - side.level_m);
      ASSERT_EQ(over_m > 0.0, nearest.distance_m > 0.0);
    }
  }
}

// Where it says that a point comes near, it is that near; before, and where it says nothing, it is not.
TEST(Polyhedron, AWayEntersWhereItFirstComesThatNear) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-2.0, 2.0);
  int entered = 0;
  for (const MeshPtr& mesh : {tetrahedron(1.5), octahedron(1.2), built(make_icosphere(1, 0.8))}) {
    const auto solid = filled(*mesh);
    for (int i = 0; i < 1'000; ++i) {
      const double near_m = i % 3 == 0 ? 0.0 : 0.1;
      const Vec3d start{within(random), within(random), within(random)};
      const Vec3d way = Vec3d{within(random), within(random), within(random)} - start;
      if (nearest_point(*solid, start).distance_m < near_m) continue;
      const auto share = enter_polyhedron(*solid, start, way, near_m);
      const auto distance_m = [&](double at) { return nearest_point(*solid, start + at * way).distance_m; };
      if (share) {
        ++entered;
        ASSERT_NEAR(distance_m(*share), near_m, 1e-12);
      }
      for (int k = 0; k < 20; ++k) ASSERT_GE(distance_m(share.value_or(1.0) * k / 20.0), near_m - 1e-12);
    }
  }
  EXPECT_GT(entered, 300);
}

TEST(PolyhedronPicking, RaysMeetTheSurface) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> within(-2.0, 2.0);
  int hits = 0;
  for (const MeshPtr& mesh : {tetrahedron(1.5), octahedron(1.2), built(make_box(brick_half_m, 1))}) {
    const auto solid = filled(*mesh);
    for (int i = 0; i < 1'000; ++i) {
      const Vec3d origin = (i % 4 == 0 ? 0.1 : 1.0) * Vec3d{within(random), within(random), within(random)};
      const Vec3d direction{within(random), within(random), within(random)};
      const auto hit_m = hit_polyhedron_m({origin, direction}, *solid);
      const auto wanted = first_hit(mesh->positions_m, mesh->faces, {origin, direction});
      ASSERT_EQ(hit_m.has_value(), wanted.has_value());
      if (!hit_m) continue;
      ++hits;
      ASSERT_NEAR(*hit_m, wanted->distance_m, 1e-12);
    }
  }
  EXPECT_GT(hits, 500);
  EXPECT_FALSE(hit_polyhedron_m({Vec3d(3, 0, 0), Vec3d::Zero()}, *filled(*octahedron(1.0))));
}

std::string polyhedron_refusal(const base::Result<MeshPtr>& mesh) {
  const auto made = make_polyhedron(*built(mesh));
  return made.ok() ? "none" : made.status().message();
}

TEST(PolyhedronRefusal, NamesTheVertexAboveTheFace) {
  MeshPtr box = built(make_box(Vec3d::Ones(), 1));
  std::vector<Vec3d> dented = box->positions_m;
  dented[6] *= 0.5;
  const std::string text = polyhedron_refusal(make_mesh(dented, box->faces));
  EXPECT_TRUE(text.starts_with("is not convex: vertex ")) << text;
  EXPECT_NE(text.find(" m above the plane of face "), std::string::npos) << text;
}

TEST(PolyhedronRefusal, NamesTheOpenEdge) {
  std::vector<Face> faces = tetrahedron(1.0)->faces;
  faces.pop_back();
  EXPECT_EQ(polyhedron_refusal(make_mesh(tetrahedron(1.0)->positions_m, faces)),
            "is open at the edge from vertex 1 to vertex 2");
}

TEST(PolyhedronRefusal, SaysHowManyVerticesThereMayBe) {
  EXPECT_EQ(polyhedron_refusal(make_icosphere(2, 1.0)),
            "has 162 vertices; the mesh of a rigid body may have at most 64");
  const auto made = make_polyhedron(*built(make_icosphere(2, 1.0)));
  EXPECT_EQ(made.status().code(), base::StatusCode::limit_exceeded);
}

TEST(PolyhedronRefusal, OfWhatIsInsideOutOrFlat) {
  std::vector<Face> faces = tetrahedron(1.0)->faces;
  for (Face& face : faces) std::swap(face[1], face[2]);
  EXPECT_TRUE(
      polyhedron_refusal(make_mesh(tetrahedron(1.0)->positions_m, faces)).starts_with("is inside out, or flat"));
  EXPECT_TRUE(polyhedron_refusal(make_box({1.0, 1e-7, 1.0}, 1)).starts_with("is flat: "));
}

// Two boxes in one mesh, apart and one in the other.
TEST(PolyhedronRefusal, OfTwoSolids) {
  for (const double shift_m : {3.0, 0.0}) {
    const MeshPtr box = built(make_box(Vec3d::Ones(), 1));
    std::vector<Vec3d> positions_m = box->positions_m;
    std::vector<Face> faces = box->faces;
    for (const Vec3d& p : box->positions_m) positions_m.push_back(0.5 * p + Vec3d(shift_m, 0, 0));
    for (Face face : box->faces) {
      for (std::uint32_t& vertex : face) vertex += 8;
      faces.push_back(face);
    }
    EXPECT_NE(polyhedron_refusal(make_mesh(positions_m, faces)), "none") << shift_m;
  }
}

// A vertex off by a rounding of single precision is no dent; one off by a thousandth is.
TEST(PolyhedronRefusal, IsToleranceOfTheSize) {
  for (const double scale : {1e-3, 1.0, 1e3}) {
    for (const auto& [share, ok] : {std::pair{1e-6, true}, std::pair{1e-3, false}}) {
      const MeshPtr box = built(make_box(scale * Vec3d::Ones(), 2));
      std::vector<Vec3d> positions_m = box->positions_m;
      for (Vec3d& p : positions_m) {
        if (p.cwiseAbs().sum() < 1.5 * scale) p *= 1.0 - share;  // the middle of a side
      }
      EXPECT_EQ(polyhedron_refusal(make_mesh(positions_m, box->faces)) == "none", ok) << scale << ' ' << share;
    }
  }
}

}  // namespace
}  // namespace pneuma::physics
