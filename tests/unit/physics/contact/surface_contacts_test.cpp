// Shows that where bodies go elsewhere than their candidates were found for, the candidates of what may cross on the
// way that they did go are all there.
#include "physics/contact/surface_contacts.h"

#include <array>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "physics/forces/soft_setup.h"
#include "physics/mesh/mesh_builders.h"
#include "unit/physics/contact/feature_search.h"

namespace pneuma::physics {
namespace {

struct Walk {
  std::vector<SoftState<double>> soft;
  std::vector<BodyBounds> bounds;
  SurfaceContacts<double> surfaces;

  /// Two bodies beside each other that go towards each other in each of so many substeps; `self`: one and itself.
  Walk(std::mt19937& random, bool self, double substeps) {
    for (int i = 0; i < (self ? 1 : 2); ++i) {
      SoftBody body;
      body.name = std::to_string(i);
      body.mesh = *make_icosphere(1, 0.5);
      body.position = Vec3d(1.0 * i, 0.1, 0.05 * i);
      body.collision.self = self;
      body.surface.thickness_m = 0.02;  // so that many come near
      soft.push_back(make_soft_state<double>(body));
      const Vec3d move_m = random_vector(random, 0.01) + Vec3d(i == 0 ? 0.01 : -0.01, 0.0, 0.0);
      for (Vec3d& dr : soft.back().dr) dr = move_m + random_vector(random, 0.005);
      if (self) {
        for (Vec3d& x : soft.back().x) x += random_vector(random, 0.2);
      }
    }
    bounds.resize(soft.size());
    for (BodyBounds& of_body : bounds) of_body.active = true;
    surfaces.load(soft, bounds, SurfaceContacts<double>::Whose::all, substeps);
    surfaces.find_pairs(soft);
  }

  void end_elsewhere(std::mt19937& random, double by_m, double share) {
    std::uniform_real_distribution<double> draw(0.0, 1.0);
    for (std::uint32_t i = 0; i < soft.size(); ++i) {
      for (Vec3d& to : surfaces.bodies()[i].to) {
        if (draw(random) < share) to += random_vector(random, by_m);
      }
    }
    surfaces.update_crossing_candidates(soft, false);
  }
};

void expect_all(Walk& walk, std::size_t& near) {
  // More than twice what the filter keeps two surfaces apart by.
  const std::vector<SurfaceBody>& bodies = walk.surfaces.bodies();
  const double near_m = 0.22 * (bodies.front().shell_m + bodies.back().shell_m);
  const std::uint32_t last = static_cast<std::uint32_t>(bodies.size() - 1);
  std::set<NamedPair> found;
  for (const SurfacePair& pair : walk.surfaces.pairs()) {
    for (const Candidate& candidate : pair.candidates) found.insert(name_of(pair, candidate));
  }
  for (const NamedPair& wanted : near_features({0, last}, bodies, near_m)) {
    ++near;
    EXPECT_TRUE(found.contains(wanted));
  }
}

TEST(CrossingCandidates, OfTwoBodiesHoldWhereverTheyWent) {
  std::mt19937 random(21);
  std::size_t near = 0;
  for (const double by_m : {0.001, 0.01, 0.05, 0.3}) {
    for (const double share : {0.05, 1.0}) {
      for (int i = 0; i < 12; ++i) {
        Walk walk(random, false, 1.0 + i % 5);
        walk.end_elsewhere(random, by_m, share);
        expect_all(walk, near);
      }
    }
  }
  EXPECT_GT(near, 500U);
}

TEST(CrossingCandidates, OfABodyWithItselfHoldWhereverItWent) {
  std::mt19937 random(22);
  std::size_t near = 0;
  for (const double by_m : {0.001, 0.05}) {
    for (int i = 0; i < 8; ++i) {
      Walk walk(random, true, 1.0 + i % 5);
      walk.end_elsewhere(random, by_m, 0.2);
      expect_all(walk, near);
    }
  }
  EXPECT_GT(near, 100U);
}

// The boxes of two bodies that were far apart did not meet.
TEST(CrossingCandidates, OfBodiesThatWereNotNearAreFound) {
  std::mt19937 random(23);
  std::size_t near = 0;
  for (int i = 0; i < 12; ++i) {
    Walk walk(random, false, 1.0);
    for (Vec3d& x : walk.soft[1].x) x += Vec3d(3.0, 0.0, 0.0);
    walk.surfaces.load(walk.soft, walk.bounds, SurfaceContacts<double>::Whose::all, 1.0);
    walk.surfaces.find_pairs(walk.soft);
    EXPECT_TRUE(walk.surfaces.pairs().empty());
    for (Vec3d& to : walk.surfaces.bodies()[1].to) to -= Vec3d(2.94 + 0.02 * i, 0.0, 0.0);
    walk.surfaces.update_crossing_candidates(walk.soft, false);
    expect_all(walk, near);
  }
  EXPECT_GT(near, 10U);
}

}  // namespace
}  // namespace pneuma::physics
