// Shows that what was broken of a known mesh comes back: its counts, its volume (a hole in a flat side is filled
// without changing it) and its faces; that mending twice does nothing the second time; that what is mended at random
// holds gas; and that what cannot be mended is refused by the numbers of the list as given.
#include "physics/mesh/mesh_mend.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <set>
#include <string>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "base/limits.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

struct Triangles {
  std::vector<Vector3d> positions_m;
  std::vector<Face> faces;
};

Triangles list_of(const Mesh& mesh) {
  return {mesh.positions_m, mesh.faces};
}
Triangles sound_ball(std::uint32_t subdivisions = 2) {
  return list_of(**make_icosphere(subdivisions, 1.0));
}
/// 2 m wide; each side has 4 x 4 cells of two triangles.
Triangles crate() {
  return list_of(**make_box({1, 1, 1}, 4));
}

MendedMesh mended(const Triangles& list, const MeshMend& mend = {}) {
  auto made = mend_mesh(list.positions_m, list.faces, mend);
  EXPECT_TRUE(made.ok()) << made.status().message();
  return made.ok() ? *made : MendedMesh{};
}
std::string refusal(const Triangles& list, const MeshMend& mend = {}) {
  const auto made = mend_mesh(list.positions_m, list.faces, mend);
  return made.ok() ? "mended: " + describe(made->report) : made.status().message();
}

double volume_of(const Mesh& mesh) {
  return signed_volume_m3(mesh.positions_m, mesh.faces);
}

/// Each turned so that its lowest vertex comes first.
std::set<Face> same_way(const std::vector<Face>& faces) {
  std::set<Face> all;
  for (Face face : faces) {
    std::rotate(face.begin(), std::min_element(face.begin(), face.end()), face.end());
    all.insert(face);
  }
  return all;
}

void flip(Face& face) {
  std::swap(face[1], face[2]);
}

/// Removes the faces whose corners are all within the square on the side at x = 1.
template <class Within>
void cut_side(Triangles& list, const Within& within) {
  std::erase_if(list.faces, [&](const Face& face) {
    return std::ranges::all_of(face, [&](std::uint32_t vertex) {
      const Vector3d& at = list.positions_m[vertex];
      return at.x() == 1.0 && within(at.y(), at.z());
    });
  });
}

TEST(MendMesh, LeavesAGoodMeshAsItIs) {
  const Triangles good = sound_ball();
  const MendedMesh after = mended(good);
  EXPECT_EQ(after.report, MendReport{});
  EXPECT_EQ(describe(after.report), "nothing to mend");
  EXPECT_EQ(after.mesh->positions_m, good.positions_m);
  EXPECT_EQ(after.mesh->faces, good.faces);
}

TEST(MendMesh, WeldsASoupOfTrianglesIntoTheirBall) {
  const Triangles good = sound_ball();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> jitter_m(-2e-7, 2e-7);
  Triangles soup;
  for (const Face& face : good.faces) {
    Face own{};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      own[corner] = static_cast<std::uint32_t>(soup.positions_m.size());
      const Vector3d off{jitter_m(random), jitter_m(random), jitter_m(random)};
      soup.positions_m.emplace_back(good.positions_m[face[corner]] + off);
    }
    soup.faces.push_back(own);
  }
  const MendedMesh after = mended(soup);
  EXPECT_EQ(after.report, (MendReport{.vertices_welded = soup.positions_m.size() - good.positions_m.size()}));
  EXPECT_TRUE(after.mesh->closed);
  EXPECT_EQ(after.mesh->faces.size(), good.faces.size());
  EXPECT_NEAR(volume_of(*after.mesh), signed_volume_m3(good.positions_m, good.faces), 1e-5);
  EXPECT_EQ(refusal(soup, {.weld_m = 0.0}), "indices[0..2]: face 0 stands alone: closed, it would have nothing inside");
}

TEST(MendMesh, AVertexIsWeldedAsFarAsTheDistanceAndNoFurther) {
  Triangles list = sound_ball(0);
  list.positions_m.emplace_back(list.positions_m[5] * 1.01);
  for (Face& face : list.faces) {
    const auto corner = std::ranges::find(face, 5U);
    if (corner == face.end()) continue;
    *corner = 12;
    break;
  }
  EXPECT_EQ(mended(list, {.weld_m = 0.0101}).report, (MendReport{.vertices_welded = 1}));
  EXPECT_EQ(mended(list, {.weld_m = 0.0099}).report.vertices_welded, 0U);
}

TEST(MendMesh, DropsFacesWithoutAreaDoublesAndLooseVertices) {
  Triangles list = sound_ball();
  const std::vector<Face> good = list.faces;
  list.faces.push_back({4, 4, 9});
  list.faces.push_back(good[17]);
  list.faces.push_back({good[20][2], good[20][0], good[20][1]});
  list.positions_m.emplace_back(0.1, 0.2, 0.3);
  const MendedMesh after = mended(list);
  EXPECT_EQ(after.report, (MendReport{.vertices_dropped = 1, .faces_dropped = 3}));
  EXPECT_EQ(after.mesh->faces, good);
  EXPECT_EQ(describe(after.report), "1 vertex dropped, 3 faces dropped");
}

TEST(MendMesh, TurnsFlippedFacesBack) {
  const Triangles good = sound_ball();
  for (const std::size_t count : {1U, 40U, 160U, 300U, 320U}) {
    Triangles list = good;
    std::vector<std::size_t> order(list.faces.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), std::mt19937(11));
    for (std::size_t i = 0; i < count; ++i) flip(list.faces[order[i]]);
    const MendedMesh after = mended(list);
    EXPECT_EQ(after.report, (MendReport{.faces_turned = count}));
    EXPECT_EQ(same_way(after.mesh->faces), same_way(good.faces));
  }
}

TEST(MendMesh, TurnsEachPartByItself) {
  Triangles two = sound_ball(1);
  const auto count = static_cast<std::uint32_t>(two.positions_m.size());
  for (const Vector3d& position : sound_ball(1).positions_m) two.positions_m.emplace_back(position + Vector3d(3, 0, 0));
  for (Face face : sound_ball(1).faces) {
    for (std::uint32_t& vertex : face) vertex += count;
    flip(face);
    two.faces.push_back(face);
  }
  const MendedMesh after = mended(two);
  EXPECT_EQ(after.report, (MendReport{.faces_turned = sound_ball(1).faces.size()}));
  EXPECT_TRUE(check_holds_gas(*after.mesh).ok());
}

TEST(MendMesh, AnOpenSheetRunsAsMostOfItDoes) {
  Triangles sheet = list_of(**make_grid(4, 4, 1, 1));
  const std::vector<Face> good = sheet.faces;
  flip(sheet.faces[3]);
  const MendedMesh after = mended(sheet, {.close = false});
  EXPECT_EQ(after.report, (MendReport{.faces_turned = 1}));
  EXPECT_EQ(same_way(after.mesh->faces), same_way(good));
}

TEST(MendMesh, AMissingFaceComesBack) {
  const Triangles good = sound_ball();
  for (std::size_t missing = 0; missing < good.faces.size(); missing += 29) {
    Triangles list = good;
    list.faces.erase(list.faces.begin() + static_cast<std::ptrdiff_t>(missing));
    const MendedMesh after = mended(list);
    EXPECT_EQ(after.report, (MendReport{.holes_closed = 1, .faces_added = 1}));
    EXPECT_EQ(same_way(after.mesh->faces), same_way(good.faces));
  }
}

TEST(MendMesh, HolesInAFlatSideAreFilledFlat) {
  struct Hole {
    const char* what;
    std::function<bool(double, double)> within;
    std::size_t corners;
  };
  const std::vector<Hole> holes{
      {"square", [](double y, double z) { return std::abs(y) <= 0.5 && std::abs(z) <= 0.5; }, 8},
      {"the whole side", [](double, double) { return true; }, 16},
      {"an L", [](double y, double z) { return y <= 0.5 && z <= 0.5 && (y <= -0.5 || z <= -0.5); }, 12}};
  for (const Hole& hole : holes) {
    Triangles list = crate();
    cut_side(list, hole.within);
    ASSERT_LT(list.faces.size(), crate().faces.size());
    const MendedMesh after = mended(list);
    EXPECT_EQ(after.report.holes_closed, 1U) << hole.what;
    EXPECT_EQ(after.report.faces_added, hole.corners - 2) << hole.what;
    EXPECT_TRUE(check_holds_gas(*after.mesh).ok()) << hole.what;
    EXPECT_NEAR(volume_of(*after.mesh), 8.0, 1e-12) << hole.what;
    double area_m2 = 0.0;
    for (const Face& face : after.mesh->faces) area_m2 += face_area_m2(after.mesh->positions_m, face);
    EXPECT_NEAR(area_m2, 24.0, 1e-12) << hole.what;  // no face lies over another
  }
}

TEST(MendMesh, HolesThatTouchAtAVertexAreTwo) {
  Triangles list = crate();
  cut_side(list, [](double y, double z) { return (y <= 0 && y >= -0.5 && z <= 0 && z >= -0.5); });
  cut_side(list, [](double y, double z) { return (y >= 0 && y <= 0.5 && z >= 0 && z <= 0.5); });
  const MendedMesh after = mended(list);
  EXPECT_EQ(after.report, (MendReport{.holes_closed = 2, .faces_added = 4}));
  EXPECT_NEAR(volume_of(*after.mesh), 8.0, 1e-12);
}

TEST(MendMesh, ALargeRoundHoleIsClosed) {
  // A tube along y, open at both ends, of as many sides as a hole may have vertices.
  const auto sides = static_cast<std::uint32_t>(base::mesh_hole_vertices_max);
  Triangles tube;
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / sides;
    tube.positions_m.emplace_back(std::cos(angle), 0.0, -std::sin(angle));
    tube.positions_m.emplace_back(std::cos(angle), 1.0, -std::sin(angle));
    const std::uint32_t next = (i + 1) % sides;
    tube.faces.push_back({2 * i, 2 * next, 2 * i + 1});
    tube.faces.push_back({2 * next, 2 * next + 1, 2 * i + 1});
  }
  const MendedMesh after = mended(tube);
  EXPECT_EQ(after.report, (MendReport{.holes_closed = 2, .faces_added = 2 * (sides - 2)}));
  EXPECT_NEAR(volume_of(*after.mesh), 0.5 * sides * std::sin(2.0 * std::numbers::pi / sides), 1e-9);
}

TEST(MendMesh, MendedTwiceItIsTheSame) {
  Triangles list = crate();
  cut_side(list, [](double y, double z) { return std::abs(y) <= 0.5 && std::abs(z) <= 0.5; });
  for (std::size_t i = 0; i < list.faces.size(); i += 3) flip(list.faces[i]);
  const MendedMesh once = mended(list);
  const MendedMesh twice = mended(list_of(*once.mesh));
  EXPECT_EQ(twice.report, MendReport{});
  EXPECT_TRUE(same_mesh(*once.mesh, *twice.mesh));
}

TEST(MendMesh, WhatIsMendedOfARandomWreckHoldsGas) {
  std::size_t mended_count = 0;
  for (std::uint32_t seed = 0; seed < 300; ++seed) {
    std::mt19937 random(seed);
    Triangles list = seed % 2 == 0 ? sound_ball() : crate();
    const double share = 0.002 * (seed % 50);
    std::bernoulli_distribution happens(share);
    std::erase_if(list.faces, [&](const Face&) { return happens(random); });
    for (Face& face : list.faces) {
      if (happens(random)) flip(face);
    }
    const std::size_t count = list.faces.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (happens(random)) list.faces.push_back(list.faces[i]);
    }
    std::shuffle(list.faces.begin(), list.faces.end(), random);
    const auto made = mend_mesh(list.positions_m, list.faces, {});
    if (!made.ok()) {
      const std::string& what = made.status().what();
      EXPECT_TRUE(what.find("the hole with") != std::string::npos || what.find("stands alone") != std::string::npos)
          << made.status().message();
      continue;
    }
    ++mended_count;
    EXPECT_TRUE(check_holds_gas(*made->mesh).ok()) << "seed " << seed << ": " << check_holds_gas(*made->mesh).message();
  }
  EXPECT_GT(mended_count, 270U);
}

TEST(MendMesh, AnEdgeOfThreeFacesIsRefusedByTheNumbersAsGiven) {
  Triangles list = sound_ball();
  const Face face = list.faces.back();
  list.faces.insert(list.faces.begin(), {3, 3, 3});  // dropped, and still counted
  list.positions_m.emplace_back(5, 5, 5);
  list.faces.push_back({face[0], face[1], 162});
  EXPECT_EQ(refusal(list).substr(0, 51), "indices[963..965]: face 321 shares the edge of vert");
}

TEST(MendMesh, ASurfaceWithOneSideIsRefused) {
  Triangles strip;
  constexpr std::uint32_t cells = 12;
  for (std::uint32_t i = 0; i < cells; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / cells;
    const Vector3d out(std::cos(angle), 0.0, std::sin(angle));
    const Vector3d half = 0.3 * (std::cos(angle / 2) * out + std::sin(angle / 2) * Vector3d::UnitY());
    strip.positions_m.emplace_back(out - half);
    strip.positions_m.emplace_back(out + half);
    const bool last = i + 1 == cells;  // joins the first one upside down
    const std::uint32_t next_low = last ? 1 : 2 * i + 2;
    const std::uint32_t next_high = last ? 0 : 2 * i + 3;
    strip.faces.push_back({2 * i, next_low, 2 * i + 1});
    strip.faces.push_back({next_low, next_high, 2 * i + 1});
  }
  EXPECT_NE(refusal(strip, {.close = false}).find("one side only"), std::string::npos) << refusal(strip);
}

TEST(MendMesh, WhatMayNotBeDoneIsNotDone) {
  Triangles flipped = sound_ball();
  flip(flipped.faces[7]);
  EXPECT_NE(refusal(flipped, {.orient = false}).find("mend.orient is off"), std::string::npos);
  Triangles open = sound_ball();
  open.faces.pop_back();
  EXPECT_FALSE(mended(open, {.close = false}).mesh->closed);
}

/// Faces from one point to each edge of a border, which is left open.
Triangles cone(const Vector3d& apex, std::vector<Vector3d> border) {
  const auto count = static_cast<std::uint32_t>(border.size());
  Triangles list{std::move(border), {}};
  list.positions_m.push_back(apex);
  for (std::uint32_t i = 0; i < count; ++i) list.faces.push_back({i, (i + 1) % count, count});
  return list;
}

TEST(MendMesh, AFaceThatStandsAloneIsNotClosedToNothing) {
  Triangles list = sound_ball(1);
  list.positions_m.insert(list.positions_m.end(), {{5, 0, 0}, {6, 0, 0}, {5, 1, 0}});
  list.faces.push_back({42, 43, 44});
  EXPECT_EQ(refusal(list), "indices[240..242]: face 80 stands alone: closed, it would have nothing inside");
  MeshMend open;
  open.close = false;
  EXPECT_EQ(mended(list, open).mesh->faces.size(), 81U);
}

TEST(MendMesh, AHoleThatCannotBeFilledIsNamed) {
  EXPECT_EQ(refusal(cone({0.5, 0.4, 1}, {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}})),
            "indices: the hole with the edge of vertices 0 and 3, 4 vertices in all, cannot be closed: its border is "
            "twisted, or in one line");
}

// Its base is open, a hole of `sides` vertices.
Triangles round_cone(std::size_t sides, double x_m) {
  std::vector<Vector3d> border;
  for (std::size_t i = 0; i < sides; ++i) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(sides);
    border.emplace_back(x_m + std::cos(angle), std::sin(angle), 0.0);
  }
  return cone({x_m, 0, 1}, border);
}

TEST(MendMesh, HolesThatAreTooLargeTogetherAreRefusedAtTheOneTooMany) {
  Triangles list;
  for (const double x_m : {0.0, 3.0, 6.0}) {
    const Triangles one = round_cone(2000, x_m);
    const auto offset = static_cast<std::uint32_t>(list.positions_m.size());
    list.positions_m.insert(list.positions_m.end(), one.positions_m.begin(), one.positions_m.end());
    for (const auto& [a, b, c] : one.faces) list.faces.push_back({a + offset, b + offset, c + offset});
  }
  EXPECT_EQ(mend_mesh(list.positions_m, list.faces, {}).status().code(), base::StatusCode::limit_exceeded);
  EXPECT_NE(refusal(list).find("2000 vertices in all, is one too many"), std::string::npos) << refusal(list);
}

TEST(MendMesh, AHoleThatIsTooLargeIsNamedWithTheLimit) {
  const Triangles list = round_cone(base::mesh_hole_vertices_max + 1, 0.0);
  EXPECT_EQ(mend_mesh(list.positions_m, list.faces, {}).status().code(), base::StatusCode::limit_exceeded);
  EXPECT_NE(refusal(list).find("has 2049 vertices; one of at most 2048"), std::string::npos) << refusal(list);
}

TEST(MendMesh, NothingLeftIsSaid) {
  EXPECT_NE(refusal({{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}}).find("no face is left"), std::string::npos);
  EXPECT_NE(refusal(sound_ball(), {.weld_m = 10.0}).find("no face is left"), std::string::npos);
  EXPECT_NE(refusal({{{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0, 1, 2}}}).find("no face is left"), std::string::npos);
}

}  // namespace
}  // namespace pneuma::physics
