// Shows that the count of crossings of two surfaces (support/crossings.h) is right, where single triangles are
// (crossing_triangles_test.cpp). The sweep is held against all pairs, the count against what renaming, moving and
// scaling must leave alone, and balls and boxes against what is plain to see.
#include "support/crossings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"

namespace pneuma::support {
namespace {

using Eigen::Vector3d;

/// A mesh that owns what TriangleMesh looks at.
struct Surface {
  std::vector<Vector3d> positions_m;
  std::vector<std::array<std::uint32_t, 3>> faces;

  [[nodiscard]] TriangleMesh view() const { return {positions_m, faces}; }
  [[nodiscard]] Triangle corners_m(std::size_t face) const {
    return {positions_m[faces[face][0]], positions_m[faces[face][1]], positions_m[faces[face][2]]};
  }
};

Surface surface_of(const physics::Mesh& mesh) {
  return {mesh.positions_m, mesh.faces};
}
Surface unit_ball(std::uint32_t subdivisions = 2) {
  return surface_of(**physics::make_icosphere(subdivisions, 1.0));
}
Surface unit_box() {
  return surface_of(**physics::make_box({1.0, 1.0, 1.0}, 0));
}

template <class Move>
Surface moved(Surface surface, const Move& move) {
  for (Vector3d& position : surface.positions_m) position = move(position);
  return surface;
}
Surface moved_by(const Surface& surface, const Vector3d& offset_m) {
  return moved(surface, [&](const Vector3d& x) -> Vector3d { return x + offset_m; });
}
Surface scaled(const Surface& surface, double factor) {
  return moved(surface, [&](const Vector3d& x) -> Vector3d { return x * factor; });
}
/// Through a point, and with the outside out. It meets a convex surface in a vertex at the point, and nowhere else.
Surface reflected(const Surface& surface, const Vector3d& centre_m) {
  Surface out = moved(surface, [&](const Vector3d& x) -> Vector3d { return 2.0 * centre_m - x; });
  for (auto& face : out.faces) std::swap(face[1], face[2]);
  return out;
}

Surface joined(Surface a, const Surface& b) {
  const auto first = static_cast<std::uint32_t>(a.positions_m.size());
  a.positions_m.insert(a.positions_m.end(), b.positions_m.begin(), b.positions_m.end());
  for (const auto& [i, j, k] : b.faces) a.faces.push_back({first + i, first + j, first + k});
  return a;
}

/// Other numbers for the vertices, other places for the faces, and another first corner for each.
Surface renamed(const Surface& surface, std::mt19937_64& random) {
  std::vector<std::uint32_t> new_index(surface.positions_m.size());
  for (std::uint32_t i = 0; i < new_index.size(); ++i) new_index[i] = i;
  std::ranges::shuffle(new_index, random);
  Surface out = surface;
  for (std::size_t i = 0; i < new_index.size(); ++i) out.positions_m[new_index[i]] = surface.positions_m[i];
  for (auto& face : out.faces) {
    for (std::uint32_t& corner : face) corner = new_index[corner];
    std::ranges::rotate(face, face.begin() + static_cast<long>(random() % 3));
  }
  std::ranges::shuffle(out.faces, random);
  return out;
}

/// Faces over positions on a small grid, so that many touch, overlap in a plane or have no area.
Surface random_soup(std::mt19937_64& random, std::size_t positions, std::size_t faces, int reach) {
  Surface soup;
  std::uniform_int_distribution<int> coordinate(-reach, reach);
  soup.positions_m.resize(positions);
  for (Vector3d& position : soup.positions_m) {
    for (double& value : position) value = coordinate(random);
  }
  std::uniform_int_distribution<std::uint32_t> any(0, static_cast<std::uint32_t>(positions - 1));
  for (std::size_t i = 0; i < faces; ++i) {
    const std::uint32_t first = any(random);
    const std::uint32_t second = any(random);
    soup.faces.push_back({first, second, any(random)});
  }
  return soup;
}

std::size_t count_all_pairs(const Surface& a, const Surface& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.faces.size(); ++i) {
    for (std::size_t j = 0; j < b.faces.size(); ++j) count += crosses(a.corners_m(i), b.corners_m(j)) ? 1u : 0u;
  }
  return count;
}
std::size_t count_all_own_pairs(const Surface& surface) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < surface.faces.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const bool share = std::ranges::any_of(
          surface.faces[i], [&](std::uint32_t corner) { return std::ranges::count(surface.faces[j], corner) > 0; });
      count += !share && crosses(surface.corners_m(i), surface.corners_m(j)) ? 1u : 0u;
    }
  }
  return count;
}

TEST(Crossings, ANeedleThroughABoxCrossesTwoFaces) {
  const Surface needle{{{-3, 0.3, 0.1}, {3, 0.4, 0.2}, {3, 0.41, 0.2}}, {{0, 1, 2}}};
  EXPECT_EQ(count_crossings(needle.view(), unit_box().view()), 2u);
  EXPECT_EQ(count_crossings(moved_by(needle, {3, 0, 0}).view(), unit_box().view()), 1u);
  EXPECT_EQ(count_crossings(moved_by(needle, {0, 1, 0}).view(), unit_box().view()), 0u);
}

TEST(Crossings, SweepFindsWhatAllPairsHave) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Surface a = random_soup(random, 40, 100, 3 + trial);
    const Surface b = random_soup(random, 40, 100, 3 + trial);
    const std::size_t crossings = count_all_pairs(a, b);
    EXPECT_GT(crossings, 100u);
    EXPECT_EQ(count_crossings(a.view(), b.view()), crossings);
    EXPECT_EQ(count_self_crossings(a.view()), count_all_own_pairs(a));
  }
  const Surface ball = unit_ball();
  for (const double distance_m : {0.0, 0.3, 1.0, 1.9, 1.999, 2.1}) {
    const Surface other = moved_by(ball, Vector3d(2, -1, 2) / 3.0 * distance_m);
    EXPECT_EQ(count_crossings(ball.view(), other.view()), count_all_pairs(ball, other)) << distance_m;
  }
}

TEST(Crossings, CountDoesNotDependOnOrderOrNames) {
  std::mt19937_64 random(4);
  const Surface ball = unit_ball();
  const std::vector<std::array<Surface, 2>> pairs{
      {ball, moved_by(ball, {1.1, 0.3, -0.2})},
      {random_soup(random, 40, 150, 4), random_soup(random, 40, 150, 4)},
  };
  for (const auto& [a, b] : pairs) {
    const std::size_t crossings = count_crossings(a.view(), b.view());
    const std::size_t own = count_self_crossings(a.view());
    EXPECT_GT(crossings, 0u);
    EXPECT_EQ(count_crossings(b.view(), a.view()), crossings);
    for (int trial = 0; trial < 5; ++trial) {
      EXPECT_EQ(count_crossings(renamed(a, random).view(), renamed(b, random).view()), crossings);
      EXPECT_EQ(count_self_crossings(renamed(a, random).view()), own);
    }
  }
}

TEST(Crossings, CountDoesNotChangeWithExactMovesAndScales) {
  std::mt19937_64 random(5);
  const Surface a = random_soup(random, 40, 150, 6);
  const Surface b = random_soup(random, 40, 150, 6);
  const std::size_t crossings = count_crossings(a.view(), b.view());
  EXPECT_GT(crossings, 100u);
  for (const double factor : {0x1p-1000, 0x1p-60, 0x1p+300, -1.0}) {
    EXPECT_EQ(count_crossings(scaled(a, factor).view(), scaled(b, factor).view()), crossings) << factor;
  }
  for (const double offset_m : {0x1p-30, 0x1p+20, -0x1p+40}) {
    const Vector3d offset(offset_m, -2 * offset_m, 4 * offset_m);
    EXPECT_EQ(count_crossings(moved_by(a, offset).view(), moved_by(b, offset).view()), crossings) << offset_m;
  }
}

TEST(Crossings, BallsCrossOnlyWhereOneIsPartlyInTheOther) {
  const Surface ball = unit_ball();
  const Surface inner = moved_by(scaled(ball, 0.5), {0.2, 0.1, 0.3});
  EXPECT_EQ(count_crossings(ball.view(), inner.view()), 0u) << "one in the other";
  EXPECT_EQ(count_inside(inner.view(), ball.view()), inner.positions_m.size());
  EXPECT_EQ(count_inside(ball.view(), inner.view()), 0u);

  const Surface beside = moved_by(ball, {2.01, 0, 0});
  EXPECT_EQ(count_crossings(ball.view(), beside.view()), 0u) << "beside each other";
  EXPECT_EQ(count_inside(ball.view(), beside.view()), 0u);

  const Surface pushed_in = moved_by(ball, {1.5, 0.1, 0.2});
  EXPECT_GT(count_crossings(ball.view(), pushed_in.view()), 20u);
  EXPECT_GT(count_inside(ball.view(), pushed_in.view()), 5u);
  EXPECT_EQ(count_self_crossings(joined(ball, pushed_in).view()), count_crossings(ball.view(), pushed_in.view()));
}

TEST(Crossings, BallsThatTouchInAVertexCrossWhenItIsOneUnitInTheLastPlaceDeeper) {
  const Surface ball = unit_ball();
  const Vector3d touched = ball.positions_m[0];
  Surface other = reflected(ball, touched);
  ASSERT_EQ(other.positions_m[0], touched);
  EXPECT_EQ(count_crossings(ball.view(), other.view()), 0u);
  for (double& coordinate : other.positions_m[0]) coordinate = std::nextafter(coordinate, 0.0);
  EXPECT_GT(count_crossings(ball.view(), other.view()), 0u);
}

TEST(Crossings, EqualSurfacesAndBoxesInPlaneAreNotSeenUnlessAskew) {
  const Surface ball = unit_ball();
  const Surface box = unit_box();
  EXPECT_EQ(count_crossings(ball.view(), ball.view()), 0u);
  EXPECT_EQ(count_crossings(box.view(), moved_by(box, {1, 0, 0}).view()), 0u);
  EXPECT_GT(count_crossings(box.view(), moved_by(box, {1, 0x1p-40, 0x1p-41}).view()), 0u);
}

TEST(Crossings, ABallFoldedThroughItselfCrossesItself) {
  Surface ball = unit_ball();
  EXPECT_EQ(count_self_crossings(ball.view()), 0u);
  ball.positions_m[0] *= -1.5;  // out of the far side
  EXPECT_GT(count_self_crossings(ball.view()), 5u);
  EXPECT_EQ(count_self_crossings(ball.view()), count_all_own_pairs(ball));
}

TEST(Crossings, PointsAreInsideABoxByTheirCoordinates) {
  const Surface box = unit_box();
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> coordinate(-1.3, 1.3);
  Surface points;
  std::size_t inside = 0;
  for (int trial = 0; trial < 2'000; ++trial) {
    const double x = coordinate(random);
    const double y = coordinate(random);
    const Vector3d point(x, y, coordinate(random));
    const bool expected = point.cwiseAbs().maxCoeff() < 1.0;
    EXPECT_EQ(is_inside(point, box.view()), expected) << point.transpose();
    points.positions_m.push_back(point);
    inside += expected ? 1u : 0u;
  }
  EXPECT_EQ(count_inside(points.view(), box.view()), inside);
}

TEST(Crossings, BrokenMeshesAreRefused) {
  const Surface ball = unit_ball(0);
  Surface not_finite = ball;
  not_finite.positions_m[3].y() = std::numeric_limits<double>::quiet_NaN();
  Surface too_far = ball;
  too_far.positions_m[3].y() = 1e101;
  Surface no_vertex = ball;
  no_vertex.faces[2][1] = 12;
  for (const Surface& broken : {not_finite, too_far, no_vertex}) {
    EXPECT_THROW((void)count_crossings(ball.view(), broken.view()), std::invalid_argument);
    EXPECT_THROW((void)count_crossings(broken.view(), ball.view()), std::invalid_argument);
    EXPECT_THROW((void)count_self_crossings(broken.view()), std::invalid_argument);
    EXPECT_THROW((void)is_inside({0, 0, 0}, broken.view()), std::invalid_argument);
    EXPECT_THROW((void)count_inside(ball.view(), broken.view()), std::invalid_argument);
    EXPECT_THROW((void)count_inside(broken.view(), ball.view()), std::invalid_argument);
  }
  EXPECT_THROW((void)is_inside({0, 0, std::numeric_limits<double>::infinity()}, ball.view()), std::invalid_argument);
}

}  // namespace
}  // namespace pneuma::support
