// Shows that no surface crosses another, or itself, once its moves are cut, however violent they were and many times
// over, by an oracle that does not round; that cuts are shares of the moves, that what does not meet keeps all of its
// own, and that they depend on no order.
#include "physics/contact/filter.h"

#include <algorithm>
#include <numbers>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "unit/physics/contact/surface_rig.h"

namespace pneuma::physics {
namespace {

constexpr double shell_of_filtered_m = 0.01;

/// Bodies that begin close to each other, and how they go on.
struct Scramble {
  std::string name;
  std::vector<SurfaceBody> (*make)();
  double move_m = 0.0;  // the most of a substep, along each axis
  bool with_selves = false;
  int substeps = 50;

  friend std::ostream& operator<<(std::ostream& out, const Scramble& scramble) { return out << scramble.name; }
};

SurfaceBody ball_at(const Vec3d& position_m, unsigned seed) {
  return askew_surface(*make_icosphere(1, 0.5), position_m, seed, shell_of_filtered_m);
}

std::vector<SurfaceBody> two_balls() {
  return {ball_at({0, 0, 0}, 1), ball_at({1.03, 0.1, 0.05}, 2)};
}

std::vector<SurfaceBody> four_balls() {
  std::vector<SurfaceBody> bodies = two_balls();
  bodies.push_back(ball_at({0.5, 0.95, 0.0}, 3));
  bodies.push_back(ball_at({0.5, 0.3, 0.9}, 4));
  return bodies;
}

std::vector<SurfaceBody> ball_between_sheets() {
  std::vector<SurfaceBody> bodies{ball_at({0, 0, 0}, 5)};
  for (const double side : {-1.0, 1.0}) {
    SurfaceBody& sheet =
        bodies.emplace_back(askew_surface(*make_grid(5, 5, 1.5, 1.5), Vec3d::Zero(), 6, shell_of_filtered_m));
    const Vec3d normal = (sheet.from[1] - sheet.from[0]).cross(sheet.from[6] - sheet.from[0]).normalized();
    for (Vec3d& x : sheet.from) x += 0.52 * side * normal;
  }
  return bodies;
}

/// One and a half turns, a tenth of a metre apart.
std::vector<SurfaceBody> rolled_sheet() {
  SurfaceBody sheet = askew_surface(*make_grid(16, 3, 1.0, 0.5), Vec3d::Zero(), 7, shell_of_filtered_m);
  for (std::size_t i = 0; i < sheet.from.size(); ++i) {
    const Vec3d& flat = sheet.topology->mesh->positions_m[i];
    const double angle = 3.0 * std::numbers::pi * (flat.x() + 0.5);
    const double radius_m = 0.2 + 0.1 * angle / (2.0 * std::numbers::pi);
    sheet.from[i] = {radius_m * std::cos(angle), radius_m * std::sin(angle), flat.z() + 0.01 * angle};
  }
  return {sheet};
}

void take_cut_moves(std::vector<SurfaceBody>& bodies) {
  for (SurfaceBody& body : bodies) {
    for (std::uint32_t i = 0; i < body.from.size(); ++i) {
      const Vec3d move_m = body.move_m(i);
      body.from[i] += std::exchange(body.cuts[i], 1.0) * move_m;
    }
  }
}

std::size_t crossings(const std::vector<SurfaceBody>& bodies, bool with_selves) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (with_selves) count += support::count_self_crossings(triangles_of(bodies[i]));
    for (std::size_t j = 0; j < i; ++j) {
      count += support::count_crossings(triangles_of(bodies[i]), triangles_of(bodies[j]));
    }
  }
  return count;
}

class Scrambled : public testing::TestWithParam<Scramble> {
 protected:
  void shake(std::vector<SurfaceBody>& bodies) {
    const Vec3d centre = middle(bodies);
    for (SurfaceBody& body : bodies) {
      body.to = body.from;
      for (Vec3d& x : body.to) x += random_vector(random_, GetParam().move_m) + 0.2 * (centre - x);
    }
  }

 private:
  static Vec3d middle(const std::vector<SurfaceBody>& bodies) {
    Box box;
    for (const SurfaceBody& body : bodies) {
      for (const Vec3d& x : body.from) box.include(x);
    }
    return 0.5 * (box.low + box.high);
  }

  std::mt19937 random_{8};
};

TEST_P(Scrambled, NeverCross) {
  std::vector<SurfaceBody> bodies = GetParam().make();
  const bool with_selves = GetParam().with_selves;
  ASSERT_EQ(crossings(bodies, with_selves), 0U);
  bool would_cross = false;
  for (int substep = 0; substep < GetParam().substeps; ++substep) {
    shake(bodies);
    if (!would_cross) {
      std::vector<SurfaceBody> uncut = bodies;
      for (SurfaceBody& body : uncut) body.cuts.assign(body.cuts.size(), 1.0);
      take_cut_moves(uncut);
      would_cross = crossings(uncut, with_selves) > 0;
    }
    cut_moves(all_pairs(bodies, with_selves), bodies);
    for (const SurfaceBody& body : bodies) {
      for (const double cut : body.cuts) {
        ASSERT_GE(cut, 0.0);
        ASSERT_LE(cut, 1.0);
      }
    }
    take_cut_moves(bodies);
    ASSERT_EQ(crossings(bodies, with_selves), 0U) << substep;
  }
  EXPECT_TRUE(would_cross);  // else this shows nothing
}

TEST_P(Scrambled, AreCutAlikeInAnyOrder) {
  std::vector<SurfaceBody> bodies = GetParam().make();
  std::mt19937 random(9);
  for (int substep = 0; substep < 3; ++substep) {
    shake(bodies);
    std::vector<SurfacePair> pairs = all_pairs(bodies, GetParam().with_selves);
    std::vector<SurfaceBody> shuffled = bodies;
    cut_moves(pairs, bodies);
    std::ranges::shuffle(pairs, random);
    for (SurfacePair& pair : pairs) std::ranges::shuffle(pair.candidates, random);
    cut_moves(pairs, shuffled);
    for (std::size_t i = 0; i < bodies.size(); ++i) EXPECT_EQ(bodies[i].cuts, shuffled[i].cuts) << i;
    take_cut_moves(bodies);
  }
}

INSTANTIATE_TEST_SUITE_P(Moves, Scrambled,
                         testing::Values(Scramble{"TwoBalls", two_balls, 0.1, false},
                                         Scramble{"TwoBallsWithThemselvesViolently", two_balls, 2.0, true},
                                         Scramble{"FourBalls", four_balls, 0.1, false, 25},
                                         Scramble{"FourBallsWithThemselvesViolently", four_balls, 1.0, true, 8},
                                         Scramble{"BallBetweenSheets", ball_between_sheets, 0.3, false},
                                         Scramble{"RolledSheet", rolled_sheet, 0.1, true},
                                         Scramble{"RolledSheetViolently", rolled_sheet, 1.0, true}),
                         [](const auto& info) { return info.param.name; });

TEST(Filter, LeavesMovesThatMeetNothingWhole) {
  std::vector<SurfaceBody> bodies = two_balls();
  for (Vec3d& x : bodies[0].to) x += Vec3d(-3.0, 0.2, 0.0);
  for (Vec3d& x : bodies[1].to) x += Vec3d(1.0, 5.0, 0.0);
  cut_moves(all_pairs(bodies, true), bodies);
  for (const SurfaceBody& body : bodies) {
    for (const double cut : body.cuts) EXPECT_EQ(cut, 1.0);
  }
}

// Two that keep their distance, and one of which something else holds back: the other would run into it.
TEST(Filter, SeesWhatHasCutAMoveBefore) {
  std::vector<SurfaceBody> bodies = two_balls();
  for (SurfaceBody& body : bodies) {
    for (Vec3d& x : body.to) x += Vec3d(-2.0, 0.0, 0.0);
  }
  cut_moves(all_pairs(bodies, false), bodies);
  for (const SurfaceBody& body : bodies) {
    for (const double cut : body.cuts) EXPECT_EQ(cut, 1.0);
  }
  bodies[0].cuts.assign(bodies[0].cuts.size(), 0.25);
  cut_moves(all_pairs(bodies, false), bodies);
  for (const double cut : bodies[0].cuts) EXPECT_LE(cut, 0.25);
  EXPECT_LT(std::ranges::min(bodies[1].cuts), 0.5);
  take_cut_moves(bodies);
  EXPECT_EQ(crossings(bodies, false), 0U);
}

/// Where all vertices end.
std::vector<Vec3d> ends_of(std::span<const SurfaceBody> bodies) {
  std::vector<Vec3d> ends;
  for (const SurfaceBody& body : bodies) {
    for (std::uint32_t i = 0; i < body.from.size(); ++i) ends.push_back(body.from[i] + body.cut_move_m(i));
  }
  return ends;
}

/// Two balls that run into each other, and both as fast sideways.
std::vector<SurfaceBody> free_balls(const Vec3d& both_m) {
  std::vector<SurfaceBody> bodies = two_balls();
  const Vec3d towards = bodies[1].from.front() - bodies[0].from.front();
  for (std::size_t i = 0; i < 2; ++i) {
    bodies[i].free.assign(bodies[i].from.size(), 1);
    for (Vec3d& x : bodies[i].to) x += both_m + (i == 0 ? 0.5 : -0.5) * towards;
  }
  return bodies;
}

// Cut along its own way, what is stopped in a fast pile would be left behind by it.
TEST(Filter, CutsFreeBodiesAsSeenByOneThatFliesWithThem) {
  const Vec3d flight_m(0.0, -7.0, 2.0);
  std::vector<SurfaceBody> still = free_balls(Vec3d::Zero());
  std::vector<SurfaceBody> flying = free_balls(flight_m);
  EXPECT_FALSE(cut_moves(all_pairs(still, false), still).empty());
  EXPECT_FALSE(cut_moves(all_pairs(flying, false), flying).empty());
  const std::vector<Vec3d> ends = ends_of(still);
  const std::vector<Vec3d> flown = ends_of(flying);
  for (std::size_t i = 0; i < ends.size(); ++i) EXPECT_LT((flown[i] - flight_m - ends[i]).norm(), 1e-9) << i;
  for (std::vector<SurfaceBody>* bodies : {&still, &flying}) {
    for (SurfaceBody& body : *bodies) {
      for (std::uint32_t i = 0; i < body.from.size(); ++i) body.to[i] = body.from[i] + body.cut_move_m(i);
      body.from = body.to;
    }
    EXPECT_EQ(crossings(*bodies, false), 0U);
  }
}

// As one that stands on a solid, or is pinned.
TEST(Filter, TakesNobodyAlongWithOneThatIsNotFree) {
  std::vector<SurfaceBody> bodies = free_balls(Vec3d::Zero());
  bodies[0].free.clear();
  EXPECT_FALSE(cut_moves(all_pairs(bodies, false), bodies).empty());
  EXPECT_FALSE(bodies[1].drifts.empty());
  for (const Vec3d& drift : bodies[1].drifts) EXPECT_TRUE(drift.isZero(0.0));
}

/// A vertex close above a wide face, and how it goes on: along it for so long that one advance after another would not
/// get there, and down.
struct GlideOverFace {
  GlideOverFace(double down_m, const Vec3d& apart_of_glide) {
    bodies = {ball_at({0, 100, 0}, 10), askew_surface(*make_grid(1, 1, 40.0, 40.0), Vec3d::Zero(), 11, 0.01)};
    const Face& face = bodies[1].topology->mesh->faces[0];
    const Vec3d& a = bodies[1].from[face[0]];
    const Vec3d& b = bodies[1].from[face[1]];
    const Vec3d& c = bodies[1].from[face[2]];
    const Vec3d normal = (b - a).cross(c - a).normalized();
    const Vec3d along = (a - (b + c) / 2.0).normalized();
    bodies[0].from[0] = (a + b + c) / 3.0 + above_m * normal;
    bodies[0].to = bodies[0].from;
    bodies[0].to[0] += glide_m * along - down_m * normal;
    // The direction is given as shares of the normal and of the way along.
    const Vec3d apart = apart_of_glide.x() * along + apart_of_glide.y() * normal;
    SurfacePair& pair = pairs.emplace_back(SurfacePair{0, 1});
    Candidate& candidate =
        pair.candidates.emplace_back(make_candidate(FeaturePair::vertex_face, false, 0, 0, pair, bodies));
    candidate.apart_m = 0.9 * above_m;
    candidate.apart = apart;
  }

  /// The share of its way that the vertex may make; the face keeps still.
  double cut() {
    cut_moves(pairs, bodies);
    return bodies[0].cuts[0];
  }
  /// Where it ends.
  [[nodiscard]] double end_above_m() const {
    const FourPoints start = corners_of(pairs[0], pairs[0].candidates[0]).start(bodies);
    return nearest_of_face(start[0] + bodies[0].cuts[0] * bodies[0].move_m(0), start[1], start[2], start[3]).distance_m;
  }

  static constexpr double above_m = 0.05;
  static constexpr double glide_m = 10.0;
  std::vector<SurfaceBody> bodies;
  std::vector<SurfacePair> pairs;
};

TEST(Filter, LeavesAMoveWholeThatTheKnownDirectionKeepsApart) {
  EXPECT_EQ(GlideOverFace(0.0, Vec3d::UnitY()).cut(), 1.0);
  EXPECT_EQ(GlideOverFace(0.9 * GlideOverFace::above_m, Vec3d::UnitY()).cut(), 1.0);
}

// Down to less than the margin, and through; or with a direction that parts the two nowhere, at the start or at the
// end.
TEST(Filter, CutsAMoveThatTheKnownDirectionDoesNotKeepApart) {
  for (const double down_m : {0.99 * GlideOverFace::above_m, 2.0 * GlideOverFace::above_m, 10.0}) {
    GlideOverFace glide(down_m, Vec3d::UnitY());
    EXPECT_LT(glide.cut(), 1.0) << down_m;
    EXPECT_GT(glide.end_above_m(), 0.0) << down_m;
  }
  EXPECT_LT(GlideOverFace(2.0 * GlideOverFace::above_m, -Vec3d::UnitY()).cut(), 1.0);
  for (const Vec3d& apart : {Vec3d(0, 0, 0), Vec3d(1, 0, 0), Vec3d(-1, 0, 0), Vec3d(0, -1, 0), Vec3d(-0.6, 0.8, 0)}) {
    EXPECT_LT(GlideOverFace(0.0, apart).cut(), 1.0) << apart.transpose();
  }
}

// A cut keeps what it can: only the two sides that face each other are held back.
TEST(Filter, CutsOnlyTheSidesThatMeet) {
  std::vector<SurfaceBody> bodies = two_balls();
  for (Vec3d& x : bodies[1].to) x += Vec3d(-0.2, 0.0, 0.0);
  cut_moves(all_pairs(bodies, false), bodies);
  std::size_t cut = 0;
  for (std::size_t i = 0; i < bodies[1].cuts.size(); ++i) {
    if (bodies[1].from[i].x() > 1.1) {
      EXPECT_EQ(bodies[1].cuts[i], 1.0) << i;
    }
    cut += bodies[1].cuts[i] < 1.0 ? 1 : 0;
  }
  EXPECT_GT(cut, 0U);
}

}  // namespace
}  // namespace pneuma::physics
