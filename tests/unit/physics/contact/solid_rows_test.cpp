// Shows that what is told apart by boxes needs no look: where a body may not meet a solid in a pass, there is no row
// and no cut, for every shape, any thickness and any motion.
#include "physics/contact/solid_rows.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "support/eigen_solvers.h"
#include "unit/physics/contact/surface_rig.h"

namespace pneuma::physics {
namespace {

struct MovingSolid {
  Shape shape;
  Surface surface;
  SolidPlace place;
};

class ToldApart : public testing::TestWithParam<Shape> {
 protected:
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  SurfaceBody body() {
    const auto seed = static_cast<unsigned>(random_() % 100);
    SurfaceBody body = askew_surface(*make_icosphere(1, 0.3), random_vector(random_, 1.3), seed, 0.002);
    body.surface.thickness_m = random_() % 2 == 0 ? 0.0 : between(0.0, 0.2);
    const Vec3d move_m = random_vector(random_, 1.0);
    for (Vec3d& x : body.to) x += move_m + random_vector(random_, 0.05);
    return body;
  }
  // `turns`: as far as half a turn in the pass.
  MovingSolid solid(bool turns) {
    MovingSolid moving{.shape = GetParam(), .surface = {}, .place = {}};
    moving.surface.thickness_m = random_() % 2 == 0 ? 0.0 : between(0.0, 0.2);
    const Quatd turn(between(-1, 1), between(-1, 1), between(-1, 1), between(-1, 1));
    moving.place.at = {random_vector(random_, 1.0), turn.normalized()};
    moving.place.ahead = moving.place.velocity = random_vector(random_, 30.0);
    if (turns) moving.place.ahead_turning = moving.place.angular_velocity = random_vector(random_, 100.0);
    return moving;
  }

  static constexpr double dt_s = 1.0 / 60.0;
  std::mt19937 random_{11};
};

TEST_P(ToldApart, TouchesNothingAndIsNotCut) {
  int apart = 0;
  int near = 0;
  for (int i = 0; i < 2'000; ++i) {
    SurfaceBody body = this->body();
    MovingSolid moving = solid(i % 2 == 1);
    moving.place.shape = &moving.shape;
    moving.place.surface = &moving.surface;
    set_way(moving.place, dt_s);
    std::vector<ContactRow> rows;
    SolidRowFinder().find(skin_move_of(body, body.from), 0, moving.place, dt_s, 0.0, rows);
    SolidCutter().cut(body, moving.place, dt_s);
    // A row may be of a wall that the way passes by; one without a gap is of what touches.
    std::erase_if(rows, [](const ContactRow& row) { return row.gap_m > 0.0; });
    const bool is_cut = std::ranges::any_of(body.cuts, [](double cut) { return cut < 1.0; });
    near += is_cut || !rows.empty() ? 1 : 0;
    if (may_meet(body, body.box_of_moves(), moving.place)) continue;
    ++apart;
    EXPECT_FALSE(is_cut) << i;
    EXPECT_TRUE(rows.empty()) << i;
  }
  EXPECT_GT(near, 100);
  const bool is_endless =
      std::holds_alternative<PlaneShape>(GetParam()) || std::holds_alternative<RoomShape>(GetParam());
  EXPECT_EQ(apart > 100, !is_endless) << apart;
}

INSTANTIATE_TEST_SUITE_P(Shapes, ToldApart,
                         testing::Values(Shape{PlaneShape{}}, Shape{SphereShape{0.4}}, Shape{BoxShape{{0.5, 0.1, 0.3}}},
                                         Shape{EllipsoidShape{{0.5, 0.2, 0.3}}}, Shape{CapsuleShape{0.1, 0.8}},
                                         Shape{RoomShape{{1.5, 1.5, 1.5}}}));

class RowsWithReach : public ToldApart {};

// Whoever goes elsewhere than foreseen, but by no more than anything of the body would, finds a row that is there
// already.
TEST_P(RowsWithReach, HoldThoseOfAnyWayThatIsNoLonger) {
  constexpr double reach = 1.3;
  std::size_t rows_in_all = 0;
  for (int i = 0; i < 2'000; ++i) {
    SurfaceBody body = this->body();
    MovingSolid moving = solid(false);
    moving.place.shape = &moving.shape;
    moving.place.surface = &moving.surface;
    moving.place.ahead = moving.place.velocity = random_vector(random_, 3.0);
    std::vector<ContactRow> foreseen;
    SolidRowFinder().find(skin_move_of(body, body.from), 0, moving.place, dt_s, reach, foreseen);
    std::vector<Vec3d> ways_m;
    for (std::size_t k = 0; k < body.from.size(); ++k) {
      ways_m.emplace_back(body.to[k] - body.from[k] - dt_s * moving.place.ahead);
    }
    std::ranges::shuffle(ways_m, random_);
    for (std::size_t k = 0; k < body.from.size(); ++k) {
      body.to[k] = body.from[k] + dt_s * moving.place.ahead + between(0.0, reach) * ways_m[k];
    }
    std::vector<ContactRow> rows;
    SolidRowFinder().find(skin_move_of(body, body.from), 0, moving.place, dt_s, 0.0, rows);
    for (const ContactRow& row : rows) {
      if (row.first.count > 1) continue;
      ++rows_in_all;
      EXPECT_NE(std::ranges::find(foreseen, row.key, &ContactRow::key), foreseen.end()) << i;
    }
  }
  EXPECT_GT(rows_in_all, 50U);
}

INSTANTIATE_TEST_SUITE_P(Shapes, RowsWithReach,
                         testing::Values(Shape{PlaneShape{}}, Shape{SphereShape{0.4}}, Shape{BoxShape{{0.5, 0.1, 0.3}}},
                                         Shape{EllipsoidShape{{0.5, 0.2, 0.3}}}, Shape{CapsuleShape{0.1, 0.8}},
                                         Shape{RoomShape{{1.5, 1.5, 1.5}}}));

// A face that a box's corner has gone through is pushed back over that corner, not on to the far side.
TEST(SolidRows, PushAFaceBackOverTheCornerThatWentThroughIt) {
  SurfaceBody sheet = askew_surface(*make_grid(1, 1, 4.0, 4.0), Vec3d::Zero(), 0, 0.0);
  sheet.from = sheet.to = sheet.topology->mesh->positions_m;
  const Shape box = BoxShape{{0.2, 0.2, 0.2}};
  const Surface surface;
  // One corner of it looks straight down, and is over the inside of a face.
  const Quatd on_corner = support::turn_between(Vec3d(-1, -1, -1).normalized(), -Vec3d::UnitY());
  const double corner_m = 0.2 * std::sqrt(3.0);
  for (const double gap_m : {0.05, 0.001, -0.001, -0.05, -0.08}) {
    SolidPlace place;
    place.shape = &box;
    place.surface = &surface;
    place.response = 1;
    place.at = {Vec3d(0.7, corner_m + gap_m, 0.2), on_corner};
    place.ahead = place.velocity = {0, -6.0, 0};
    std::vector<ContactRow> rows;
    SolidRowFinder().find(skin_move_of(sheet, sheet.from), 0, place, 1.0 / 60.0, 0.0, rows);
    ASSERT_FALSE(rows.empty()) << gap_m;
    for (const ContactRow& row : rows) EXPECT_LT(row.normal.y(), -0.999) << gap_m;  // from the box to the sheet
    EXPECT_NEAR(std::ranges::min(rows, {}, &ContactRow::gap_m).gap_m, gap_m, 1e-9);
  }
}

}  // namespace
}  // namespace pneuma::physics
