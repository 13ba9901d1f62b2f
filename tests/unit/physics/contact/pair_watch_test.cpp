// Shows that what a watch lists in each substep has every two features that come near each other on their way, none
// twice and each as far apart as it says, however the bodies move: shaking, drifting, to and fro, in leaps, spinning.
// That rows are, bit for bit, those of a watch made in that substep, and that a list is said to hold only while nothing
// that it lacks can come near.
#include "physics/contact/pair_watch.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "unit/physics/contact/feature_search.h"
#include "unit/physics/contact/surface_rig.h"

namespace pneuma::physics {
namespace {

constexpr double shell_of_watched_m = 0.01;
constexpr double watched_apart_m = 0.97;
constexpr int watched_substeps = 200;

/// Where a body is at one time, from where it began.
struct Pose {
  Vec3d shift_m = Vec3d::Zero();
  double turned_rad = 0.0;  // about its middle
  double size = 1.0;
  double shake_m = 0.0;  // of each vertex, along each axis
};

/// One or two bodies, and how the last of them moves. Of two, the first shakes a little.
struct Motion {
  std::string name;
  bool with_itself = false;
  Pose (*at)(int substep) = nullptr;

  friend std::ostream& operator<<(std::ostream& out, const Motion& motion) { return out << motion.name; }
};

double wave(int substep, double period) {
  return std::sin(2.0 * std::numbers::pi * substep / period);
}

Pose shaking(int) {
  return {.shake_m = 0.002};
}
Pose drifting(int substep) {
  return {.shift_m = {0.0, 0.005 * (substep - 100), 0.0}, .shake_m = 1e-4};
}
// There and back by a few moves, as a contact that swings does: what a list knows of the way there is no way back.
Pose to_and_fro(int substep) {
  return {.shift_m = Vec3d(0.03, 0.01, 0.0) * wave(substep, 40.0), .shake_m = 1e-5};
}
// One leap longer than lists are made for, and a shorter one.
Pose in_leaps(int substep) {
  return {.shift_m = {(substep > 70 ? -0.2 : 0.0) + (substep > 140 ? 0.09 : 0.0), 2e-4 * substep, 0.0},
          .shake_m = 2e-4};
}
Pose spinning(int substep) {
  return {.turned_rad = substep < 100 ? 0.02 * substep : 2.0 + 0.4 * (substep - 100), .shake_m = 1e-4};
}
Pose breathing(int substep) {
  return {.shift_m = {0.01 * substep, 0.0, 0.0}, .size = 1.0 + 0.05 * wave(substep, 30.0), .shake_m = 5e-4};
}
Pose crumpling(int substep) {
  return {.size = substep == 100 ? 0.7 : 1.0, .shake_m = 0.003};
}

bool same_row(const ContactRow& a, const ContactRow& b) {
  const auto same = [](const Support& s, const Support& t) {
    return s.body == t.body && s.count == t.count && s.vertices == t.vertices && s.weights == t.weights;
  };
  return a.key == b.key && same(a.first, b.first) && same(a.second, b.second) && a.normal == b.normal &&
         a.gap_m == b.gap_m && a.friction == b.friction && a.restitution == b.restitution;
}

class Watched : public testing::TestWithParam<Motion> {
 protected:
  Watched() {
    const auto mesh = *make_icosphere(1, 0.5);
    bodies_.push_back(askew_surface(mesh, Vec3d::Zero(), 1, shell_of_watched_m));
    if (GetParam().with_itself) {
      for (Vec3d& x : bodies_[0].from) x += random_vector(random_, 0.15);
    } else {
      bodies_.push_back(askew_surface(mesh, watched_apart_m * Vec3d::UnitX(), 2, shell_of_watched_m));
    }
    for (SurfaceBody& body : bodies_) {
      began_.push_back(body.from);
      next_.push_back(body.from);
    }
    last_ = static_cast<std::uint32_t>(bodies_.size() - 1);
    pair_ = {0, last_};
    within_m_ = reach_m() + move_slack_shells * shell_of_watched_m;
  }

  /// What needs a row is within this.
  [[nodiscard]] double reach_m() const { return (1.0 + row_slack_share) * kept_distance_m(pair_, bodies_); }

  /// Begins the next substep: most of a move comes to be as it was foreseen.
  void begin() {
    ++substep_;
    for (std::uint32_t i = 0; i < bodies_.size(); ++i) {
      std::vector<Vec3d> now = next_[i];
      for (Vec3d& x : now) x += random_vector(random_, 1e-5);
      next_[i] = places(i, i == last_ ? GetParam().at(substep_ + 1) : Pose{.shake_m = 1e-4});
      begin_substep(bodies_[i], std::move(now), next_[i]);
    }
  }
  void look(PairWatch& watch, SurfacePair& pair) { watch.look(within_m_, bodies_, finder_, measures_, pair); }
  [[nodiscard]] std::set<NamedPair> names() const {
    std::set<NamedPair> found;
    for (const Candidate& candidate : pair_.candidates) found.insert(name_of(pair_, candidate));
    return found;
  }
  std::vector<ContactRow> rows_of(SurfacePair& pair) {
    std::vector<ContactRow> rows;
    RowFinder().find({&pair, 1}, bodies_, rows);
    return rows;
  }
  [[nodiscard]] SurfacePair pair() const { return {0, last_}; }
  [[nodiscard]] PairWatch new_watch() const { return {0, last_}; }

  std::mt19937 random_{3};
  std::vector<SurfaceBody> bodies_;
  SurfacePair pair_;
  double within_m_ = 0.0;

 private:
  std::vector<Vec3d> places(std::uint32_t body, const Pose& pose) {
    const Vec3d middle = body == 0 ? Vec3d::Zero() : Vec3d(watched_apart_m * Vec3d::UnitX());
    const Eigen::AngleAxisd turn(pose.turned_rad, Vec3d(0.3, 0.2, 1.0).normalized());
    std::vector<Vec3d> at;
    for (const Vec3d& x : began_[body]) {
      at.push_back(middle + pose.shift_m + pose.size * (turn * (x - middle)) + random_vector(random_, pose.shake_m));
    }
    return at;
  }

  int substep_ = -1;
  std::uint32_t last_ = 0;
  std::vector<std::vector<Vec3d>> began_, next_;
  CandidateFinder finder_;
  FeatureMeasures measures_;
};

TEST_P(Watched, ListsHaveAllThatComesNearOnceAndNoNearerThanTheySay) {
  PairWatch watch = new_watch();
  std::size_t near_count = 0;
  for (int substep = 0; substep < watched_substeps; ++substep) {
    begin();
    look(watch, pair_);
    EXPECT_EQ(pair_.drifted_m, 0.0);
    for (const Candidate& candidate : pair_.candidates) {
      const FeatureCorners corners = corners_of(pair_, candidate);
      ASSERT_FALSE(share_a_vertex(corners, candidate.pair)) << substep;
      ASSERT_NEAR(candidate.apart_m, distance_m(candidate.pair, corners.start(bodies_)), 1e-12) << substep;
    }
    const std::set<NamedPair> found = names();
    ASSERT_EQ(found.size(), pair_.candidates.size()) << "some twice in substep " << substep;
    const std::set<NamedPair> near = near_features(pair_, bodies_, within_m_);
    ASSERT_TRUE(std::ranges::includes(found, near)) << substep;
    near_count += near.size();
  }
  EXPECT_GT(near_count, 1000U);  // else this shows nothing
}

TEST_P(Watched, RowsAreThoseOfAFreshWatch) {
  PairWatch watch = new_watch();
  std::size_t row_count = 0;
  for (int substep = 0; substep < watched_substeps; ++substep) {
    begin();
    look(watch, pair_);
    PairWatch fresh = new_watch();
    SurfacePair fresh_pair = pair();
    look(fresh, fresh_pair);
    const std::vector<ContactRow> rows = rows_of(pair_);
    ASSERT_TRUE(std::ranges::equal(rows, rows_of(fresh_pair), same_row)) << substep;
    row_count += rows.size();
  }
  EXPECT_GT(row_count, 100U);
}

TEST_P(Watched, ListsHaveAllThatComesNearForAsManySubstepsAsTheyHold) {
  PairWatch watch = new_watch();
  bool holds = false;
  for (int substep = 0; substep < watched_substeps; ++substep) {
    begin();
    holds = holds && watch.holds(reach_m(), bodies_, pair_);
    if (!holds) {
      look(watch, pair_);
      holds = true;
      continue;
    }
    for (const Candidate& candidate : pair_.candidates) {
      const FeatureCorners corners = corners_of(pair_, candidate);
      ASSERT_LE(candidate.apart_m - pair_.drifted_m, distance_m(candidate.pair, corners.start(bodies_))) << substep;
    }
    ASSERT_TRUE(std::ranges::includes(names(), near_features(pair_, bodies_, reach_m()))) << substep;
  }
}

TEST_P(Watched, ListsHoldOnlyWhileNothingThatTheyLackComesNear) {
  PairWatch watch = new_watch();
  int held = 0;
  int dropped = 0;
  int lacking = 0;
  for (int substep = 0; substep < watched_substeps; ++substep) {
    begin();
    look(watch, pair_);
    if (substep % 4 != 0) continue;
    const std::vector<SurfaceBody> before = bodies_;
    for (const double scale : {0.9, 1.05, 1.5, 6.0}) {
      for (SurfaceBody& body : bodies_) {
        std::vector<Vec3d> to = body.from;
        const double other_m = 0.01 * (scale - 0.9);
        const Vec3d push_m = random_vector(random_, other_m);
        for (std::uint32_t i = 0; i < to.size(); ++i) {
          to[i] += scale * body.move_m(i) + push_m + random_vector(random_, other_m);
        }
        change_moves(body, std::move(to));
      }
      const std::set<NamedPair> found = names();
      const bool has_all = std::ranges::includes(found, near_features(pair_, bodies_, reach_m()));
      const bool holds = watch.holds(reach_m(), bodies_, pair_);
      ASSERT_TRUE(has_all || !holds) << substep << ", moves times " << scale;
      held += holds ? 1 : 0;
      dropped += holds ? 0 : 1;
      lacking += has_all ? 0 : 1;
      bodies_ = before;
    }
  }
  EXPECT_GT(held, 10);
  EXPECT_GT(dropped, 10);
  EXPECT_GT(lacking, 3);
}

INSTANTIATE_TEST_SUITE_P(Motions, Watched,
                         testing::Values(Motion{"Shaking", false, shaking}, Motion{"Drifting", false, drifting},
                                         Motion{"ToAndFro", false, to_and_fro}, Motion{"InLeaps", false, in_leaps},
                                         Motion{"Spinning", false, spinning},
                                         Motion{"BreathingOnItself", true, breathing},
                                         Motion{"CrumplingOnItself", true, crumpling},
                                         Motion{"SpinningOnItself", true, spinning}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace pneuma::physics
