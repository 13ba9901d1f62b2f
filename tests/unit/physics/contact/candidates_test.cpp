// Shows that the candidates of two surfaces, and of one with itself, have every two features that come near each other
// anywhere on their way, found by looking at all of them at many times; that they have none twice; and that surfaces
// are said to cross exactly where an oracle without rounding says so.
#include "physics/contact/candidates.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "unit/physics/contact/feature_search.h"
#include "unit/physics/contact/surface_rig.h"

namespace pneuma::physics {
namespace {

constexpr double shell_of_candidates_m = 0.03;
constexpr int ways = 12;

/// Expects all near features among the candidates and returns how many there are.
std::size_t expect_all_near_ones(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  std::set<NamedPair> found;
  for (const Candidate& candidate : pair.candidates) {
    EXPECT_TRUE(found.insert(name_of(pair, candidate)).second) << "twice";
    EXPECT_FALSE(share_a_vertex(corners_of(pair, candidate), candidate.pair));
  }
  const std::set<NamedPair> near = near_features(pair, bodies, kept_distance_m(pair, bodies));
  EXPECT_TRUE(std::ranges::includes(found, near));
  return near.size();
}

void shake_ends(SurfaceBody& body, const Vec3d& way_m, double shake_m, std::mt19937& random) {
  for (std::size_t i = 0; i < body.to.size(); ++i) body.to[i] = body.from[i] + way_m + random_vector(random, shake_m);
}

TEST(Candidates, OfTwoBallsThatMeetHaveAllThatComesNear) {
  std::mt19937 random(1);
  std::size_t near = 0;
  for (unsigned i = 0; i < ways; ++i) {
    const Vec3d towards = random_vector(random, 1.0).normalized();
    std::vector<SurfaceBody> bodies{
        askew_surface(*make_icosphere(1, 0.5), Vec3d::Zero(), i, shell_of_candidates_m),
        askew_surface(*make_icosphere(1, 0.7), 1.4 * towards, i + 100, 2.0 * shell_of_candidates_m)};
    shake_ends(bodies[0], 0.3 * i / ways * towards, 0.05, random);
    shake_ends(bodies[1], -0.5 * i / ways * towards, 0.1, random);
    near += expect_all_near_ones(all_pairs(bodies, false).front(), bodies);
  }
  EXPECT_GT(near, 1000U);
}

// Most of a ball lies on one side of the sheet's middle: the direction between the two tells little apart.
TEST(Candidates, OfABallInAFoldedSheetHaveAllThatComesNear) {
  std::mt19937 random(2);
  std::size_t near = 0;
  for (unsigned i = 0; i < ways; ++i) {
    std::vector<SurfaceBody> bodies{
        askew_surface(*make_icosphere(1, 0.4), random_vector(random, 0.2), i, shell_of_candidates_m),
        askew_surface(*make_grid(6, 6, 2.0, 2.0), random_vector(random, 0.3), i + 50, shell_of_candidates_m)};
    for (Vec3d& x : bodies[1].from) x += random_vector(random, 0.2);
    for (SurfaceBody& body : bodies) shake_ends(body, random_vector(random, 0.3), 0.1, random);
    near += expect_all_near_ones(all_pairs(bodies, false).front(), bodies);
  }
  EXPECT_GT(near, 1000U);
}

// Ways of many times the bodies' sizes, in any direction.
TEST(Candidates, OfFastBodiesHaveAllThatComesNearAndLittleElse) {
  std::mt19937 random(6);
  const auto mesh = *make_icosphere(1, 0.5);
  std::size_t near = 0;
  std::size_t most = 0;
  for (unsigned i = 0; i < 4 * ways; ++i) {
    const Vec3d way_m = 8.0 * random_vector(random, 1.0).normalized();
    const Vec3d with_m = i % 2 == 0 ? random_vector(random, 20.0) : Vec3d(Vec3d::Zero());
    std::vector<SurfaceBody> bodies{
        askew_surface(mesh, random_vector(random, 0.1), i, 0.2 * shell_of_candidates_m),
        askew_surface(mesh, 4.0 * way_m.normalized(), i + 100, 0.2 * shell_of_candidates_m)};
    shake_ends(bodies[0], way_m + with_m, 0.02, random);
    shake_ends(bodies[1], with_m, 0.02, random);
    for (SurfaceBody& body : bodies) body.spacing_m = 0.1;
    const std::vector<SurfacePair> pairs = all_pairs(bodies, false);
    near += expect_all_near_ones(pairs.front(), bodies);
    if (with_m.isZero(0.0)) most = std::max(most, pairs.front().candidates.size());
  }
  EXPECT_GT(near, 1000U);
  EXPECT_LT(most, mesh->edges.size() * mesh->edges.size() / 3);
}

TEST(Candidates, OfAFastCrumpledBodyWithItselfHaveAllThatComesNear) {
  std::mt19937 random(7);
  std::size_t near = 0;
  for (unsigned i = 0; i < ways; ++i) {
    std::vector<SurfaceBody> bodies{
        askew_surface(*make_grid(6, 5, 1.0, 1.0), Vec3d::Zero(), i, 0.5 * shell_of_candidates_m)};
    for (Vec3d& x : bodies[0].from) x += random_vector(random, 0.15);
    shake_ends(bodies[0], random_vector(random, 30.0), 0.05, random);
    bodies[0].spacing_m = 0.1;
    near += expect_all_near_ones(all_pairs(bodies, true).front(), bodies);
  }
  EXPECT_GT(near, 300U);
}

// So many that their boxes are sorted.
TEST(Candidates, OfTwoSheetsThatLieOnEachOtherHaveAllThatComesNear) {
  std::mt19937 random(5);
  std::vector<SurfaceBody> bodies{
      askew_surface(*make_grid(20, 16, 2.0, 1.6), Vec3d::Zero(), 1, 0.3 * shell_of_candidates_m),
      askew_surface(*make_grid(17, 19, 1.8, 2.0), Vec3d(0.01, 0.006, 0.004), 1, 0.3 * shell_of_candidates_m)};
  for (SurfaceBody& body : bodies) shake_ends(body, random_vector(random, 0.02), 0.01, random);
  EXPECT_GT(expect_all_near_ones(all_pairs(bodies, false).front(), bodies), 1000U);
}

TEST(Candidates, OfACrumpledSurfaceWithItselfHaveAllThatComesNear) {
  std::mt19937 random(3);
  std::size_t near = 0;
  for (unsigned i = 0; i < ways; ++i) {
    const auto mesh = i % 2 == 0 ? *make_icosphere(1, 0.5) : *make_grid(5, 4, 1.0, 1.0);
    std::vector<SurfaceBody> bodies{askew_surface(mesh, random_vector(random, 5.0), i, shell_of_candidates_m)};
    for (Vec3d& x : bodies[0].from) x += random_vector(random, 0.15);
    shake_ends(bodies[0], random_vector(random, 0.5), 0.3, random);
    near += expect_all_near_ones(all_pairs(bodies, true).front(), bodies);
  }
  EXPECT_GT(near, 1000U);
}

TEST(Candidates, OfSurfacesFarApartAreNone) {
  std::vector<SurfaceBody> bodies{
      askew_surface(*make_icosphere(2, 0.5), Vec3d::Zero(), 1, shell_of_candidates_m),
      askew_surface(*make_icosphere(2, 0.5), Vec3d(1.5, 0.2, 0.1), 2, shell_of_candidates_m)};
  EXPECT_TRUE(all_pairs(bodies, false).front().candidates.empty());
}

TEST(Candidates, SayThatSurfacesCrossWhereTheOracleDoes) {
  std::mt19937 random(4);
  CandidateFinder finder;
  int crossed = 0;
  constexpr int poses = 200;
  for (unsigned i = 0; i < poses; ++i) {
    const auto other = i % 3 == 0 ? *make_grid(3, 3, 1.5, 1.5) : *make_icosphere(1, 0.3 + 0.4 * (i % 2));
    const Vec3d direction = random_vector(random, 1.0).normalized();
    const double apart_m = 1.3 * i / poses;
    std::vector<SurfaceBody> bodies{askew_surface(*make_icosphere(1, 0.5), Vec3d::Zero(), i, shell_of_candidates_m),
                                    askew_surface(other, apart_m * direction, i + 1000, shell_of_candidates_m)};
    for (SurfaceBody& body : bodies) shake_ends(body, random_vector(random, 0.1), 0.1, random);
    for (SurfaceBody& body : bodies) fit_way(body);
    const bool wanted = support::count_crossings(triangles_of(bodies[0]), triangles_of(bodies[1])) > 0;
    EXPECT_EQ(finder.are_crossed({0, 1}, bodies), wanted) << i;
    EXPECT_EQ(finder.are_crossed({1, 0}, bodies), wanted) << i;
    crossed += wanted ? 1 : 0;
  }
  EXPECT_GT(crossed, poses / 4);
  EXPECT_LT(crossed, 3 * poses / 4);
}

}  // namespace
}  // namespace pneuma::physics
