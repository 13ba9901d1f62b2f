// Shows that what is told apart by boxes needs no look: where a body may not meet a solid in a pass, there is no row
// and no cut, for every shape, any thickness and any motion.
#include "physics/contact/solid_rows.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
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
    find_solid_rows(body, 0, body.from, moving.place, dt_s, rows);
    find_corner_rows(body, 0, body.from, moving.place, dt_s, rows);
    cut_at_solid(body, moving.place, dt_s);
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

}  // namespace
}  // namespace pneuma::physics
