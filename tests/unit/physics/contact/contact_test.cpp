// Shows that soft bodies meet solids as section 3.5 of the paper and the closed forms of contact say: heights of
// bounces, Coulomb's slope, momentum to round-off, nothing lost through thin walls or out of a room.
// Particles under gravity alone (no springs), so that every number is known beforehand.
#include "physics/contact/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "unit/physics/contact/contact_rig.h"

namespace pneuma::physics {
namespace {

TEST(ContactSurface, LargerRestitutionAndGeometricMeanOfFrictions) {
  const ContactSurface both = combine(surface(0.2, 0.4, 0.01), surface(0.6, 0.9, 0.02));
  EXPECT_DOUBLE_EQ(both.restitution, 0.6);
  EXPECT_DOUBLE_EQ(both.friction, 0.6);
  EXPECT_DOUBLE_EQ(both.thickness_m, 0.03);
}

TEST(ContactSurface, UnsetLeavesTheDecisionToTheOther) {
  EXPECT_DOUBLE_EQ(combine({}, surface(0.6, 0.9)).friction, 0.9);
  EXPECT_DOUBLE_EQ(combine(surface(0.6, 0.9), {}).restitution, 0.6);
  EXPECT_DOUBLE_EQ(combine({}, {}).friction, 0.0);
  EXPECT_DOUBLE_EQ(combine({}, {}).restitution, 0.0);
}

TEST(Contact, OneBodyAloneCostsNothing) {
  Rig<double> rig;
  rig.soft.push_back(make_particles<double>(*make_icosphere(2, 1.0), {0, 0, 0}, {1, 2, 3}));
  rig.run(0.1);
  for (const StageRow& row : rig.profile) {
    EXPECT_EQ(row.calls, 0U);
    EXPECT_EQ(row.bytes, 0U);
  }
}

template <class Real>
double rebound_height_m(double restitution, double height_m) {
  Rig<Real> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.soft.push_back(make_particles<Real>(speck(), {0, height_m, 0}, Vec3d::Zero()));
  rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), surface(restitution, 0.0)));
  double top_m = 0.0;
  for (bool rising = false, landed = false; !landed;) {
    rig.step();
    const double v = static_cast<double>(rig.soft[0].v[0].y());
    rising = rising || v > 0.0;
    top_m = rising ? std::max(top_m, static_cast<double>(rig.soft[0].x[0].y())) : 0.0;
    landed = rising && v <= 0.0;
  }
  return top_m;
}

TEST(Contact, BounceHeightIsRestitutionSquared) {
  for (const double restitution : {0.3, 0.5, 0.8, 1.0}) {
    for (const double height_m : {0.313, 1.0, 4.77}) {
      const double wanted_m = restitution * restitution * height_m;
      EXPECT_NEAR(rebound_height_m<double>(restitution, height_m), wanted_m, 0.01 * wanted_m);
      EXPECT_NEAR(rebound_height_m<float>(restitution, height_m), wanted_m, 0.01 * wanted_m);
    }
  }
}

TEST(Contact, ParticleComesToRestOnTheFloorAndStays) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.soft.push_back(make_particles<double>(speck(), {0, 0.5, 0}, {0.3, 0, 0}));
  rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), surface(0.5, 0.5)));
  rig.run(5.0);
  const std::vector<Vec3d> rest = rig.soft[0].x;
  for (int i = 0; i < 2'000; ++i) {
    rig.step();
    for (std::size_t k = 0; k < rest.size(); ++k) {
      ASSERT_LT((rig.soft[0].x[k] - rest[k]).norm(), 1e-12);
      ASSERT_LT(rig.soft[0].v[k].norm(), 1e-12);
      ASSERT_NEAR(rig.soft[0].x[k].y(), 0.0, 1e-9);
    }
  }
}

double slide_m(double slope_rad, double friction) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  const Vec3d normal(std::sin(slope_rad), std::cos(slope_rad), 0);
  rig.soft.push_back(make_particles<double>(*make_grid(2, 2, 1.0, 1.0), Vec3d::Zero(), Vec3d::Zero()));
  for (Vec3d& x : rig.soft[0].x) x -= normal.dot(x) * normal;
  const Vec3d start = rig.soft[0].x[0];
  rig.colliders.push_back(make_collider(PlaneShape{normal}, Vec3d::Zero(), surface(0.3, friction)));
  rig.run(2.0);
  return (rig.soft[0].x[0] - start).norm();
}

TEST(Contact, SlopeHoldsIffItsTangentIsWithinFriction) {
  for (const double slope_rad : {0.1, 0.5, 1.0}) {
    EXPECT_LT(slide_m(slope_rad, 1.001 * std::tan(slope_rad)), 1e-6);
    EXPECT_GT(slide_m(slope_rad, 0.99 * std::tan(slope_rad)), 1e-3);
  }
}

TEST(Contact, SlidingGoesAsCoulombSays) {
  const double slope_rad = 0.5;
  const double friction = 0.3;
  const double acceleration = 9.81 * (std::sin(slope_rad) - friction * std::cos(slope_rad));
  EXPECT_NEAR(slide_m(slope_rad, friction), 0.5 * acceleration * 4.0, 0.01 * 0.5 * acceleration * 4.0);
}

TEST(Contact, ThicknessKeepsTheDistance) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.soft.push_back(make_particles<double>(speck(), {0, 0.5, 0}, Vec3d::Zero(), surface(0, 0, 0.02)));
  rig.colliders.push_back(make_collider(BoxShape{{1, 0.1, 1}}, {0, -0.1, 0}, surface(0, 0, 0.03)));
  rig.run(2.0);
  for (const Vec3d& x : rig.soft[0].x) EXPECT_NEAR(x.y(), 0.05, 1e-9);
}

TEST(Contact, NothingPassesAThinWallAtAThousandMetresASecond) {
  const std::vector<Shape> walls{PlaneShape{}, BoxShape{{50, 0.0005, 50}}, EllipsoidShape{{500, 0.01, 500}},
                                 RoomShape{{50, 0.0005, 50}}};
  for (const Shape& wall : walls) {
    Rig<double> rig;
    const bool room = std::holds_alternative<RoomShape>(wall);
    rig.soft.push_back(make_particles<double>(*make_icosphere(2, 1.0), {0, 3, 0}, {0, -1'000, 0}));
    rig.colliders.push_back(make_collider(wall, room ? Vec3d(0, 0.0005, 0) : Vec3d::Zero(), surface(0.2, 0.5)));
    rig.run(0.05);
    for (const Vec3d& x : rig.soft[0].x) EXPECT_GT(x.y(), -1e-9) << wall.index();
  }
}

TEST(Contact, FastBodyIsStoppedByASmallSphereAndCapsule) {
  const std::vector<Shape> obstacles{SphereShape{0.02}, CapsuleShape{0.02, 0.01}};
  for (const Shape& obstacle : obstacles) {
    Rig<double> rig;
    rig.soft.push_back(make_particles<double>(speck(), {0, 3, 0}, {0, -1'000, 0}));
    rig.colliders.push_back(make_collider(obstacle));
    rig.run(0.02);
    for (const Vec3d& v : rig.soft[0].v) EXPECT_GT(v.y(), -100.0);
  }
}

TEST(Contact, RotatingRoomKeepsAllInside) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.soft.push_back(make_particles<double>(*make_icosphere(2, 1.0), {0, 0, 0}, {3, 2, 1}));
  rig.soft.push_back(make_particles<double>(*make_icosphere(2, 0.5), {1, 1, 1}, {-30, 20, 5}));
  rig.colliders.push_back(make_collider(RoomShape{{2, 2, 2}}, Vec3d::Zero(), surface(0.7, 0.4)));
  rig.colliders[0].collider.angular_velocity = Vec3d(0.3, 0.5, 0.9);
  const Shape& room = rig.colliders[0].collider.shape;
  for (int i = 0; i < 20 * 480; ++i) {
    rig.step();
    const Frame frame(rig.colliders[0].position, rig.colliders[0].orientation);
    for (const auto& body : rig.soft) {
      for (const Vec3d& x : body.x) ASSERT_GT(surface_distance(room, frame.to_local(x)), -1e-9) << "substep " << i;
    }
  }
}

TEST(Contact, TurningFloorCarriesWhatSticksToIt) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.soft.push_back(make_particles<double>(speck(), {0.5, 0, 0}, {0, 0, -0.5}));
  rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), surface(0, 1.0)));
  rig.colliders[0].collider.angular_velocity = Vec3d(0, 1, 0);
  const Vec3d start = rig.soft[0].x[0];
  rig.run(2.0);
  const Vec3d wanted = Eigen::AngleAxisd(2.0, Vec3d::UnitY()) * start;
  EXPECT_LT((rig.soft[0].x[0] - wanted).norm(), 1e-3);
}

TEST(Contact, RisingFloorLifts) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.soft.push_back(make_particles<double>(speck(), Vec3d::Zero(), Vec3d::Zero()));
  rig.colliders.push_back(make_collider(BoxShape{{1, 0.1, 1}}, {0, -0.1, 0}));
  rig.colliders[0].collider.velocity = Vec3d(0, 0.5, 0);
  rig.run(2.0);
  EXPECT_NEAR(rig.soft[0].x[0].y(), 1.0, 1e-9);
  EXPECT_NEAR(rig.soft[0].v[0].y(), 0.5, 1e-9);
}

TEST(Contact, PinnedVertexDoesNotMove) {
  Rig<double> rig;
  rig.soft.push_back(make_particles<double>(speck(), Vec3d::Zero(), Vec3d::Zero()));
  rig.soft[0].pinned = {1, 0, 0};
  rig.colliders.push_back(make_collider(SphereShape{0.5}));
  rig.run(0.5);  // what is in a solid comes out of it within a few tenths of a second
  EXPECT_EQ(rig.soft[0].x[0], Vec3d(0, 0, 0));
  EXPECT_GT(rig.soft[0].x[1].norm(), 0.49);
}

// 3 m at 2 m/s is a whole number of substeps: the last move before the bounce ends on the wall, or short of it by
// round-off.
TEST(Contact, HitThatBeginsOnTheSurfaceStillBounces) {
  for (const double gap_m : {0.0, 1.0 / 480, 1.0, 3.0}) {
    Rig<double> rig;
    rig.soft.push_back(make_particles<double>(speck(), {0, gap_m, 0}, {0, -2, 0}));
    rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), surface(0.5, 0.0)));
    rig.run(2.0);
    for (const Vec3d& v : rig.soft[0].v) EXPECT_DOUBLE_EQ(v.y(), 1.0) << gap_m;
  }
}

TEST(Contact, FrozenOrBrokenBodyLeavesOthersAlone) {
  Rig<double> rig;
  for (int i = 0; i < 3; ++i)
    rig.soft.push_back(make_particles<double>(*make_icosphere(1, 1.0), {0.5 * i, 0, 0}, Vec3d::Zero()));
  rig.soft[0].frozen = true;
  rig.soft[1].v[3].setConstant(std::numeric_limits<double>::quiet_NaN());
  rig.rigid.push_back(make_rigid(SphereShape{1.0}, 1.0, {0.5, 0, 0}));
  rig.rigid[0].velocity.setConstant(std::numeric_limits<double>::infinity());
  rig.colliders.push_back(make_collider(RoomShape{{5, 5, 5}}));
  rig.step();
  for (const Vec3d& x : rig.soft[2].x) EXPECT_TRUE(x.allFinite());
  for (const Vec3d& v : rig.soft[2].v) EXPECT_EQ(v, Vec3d(0, 0, 0));
}

TEST(Contact, RigidBallAndSoftBodyShareMomentum) {
  Rig<double> rig;
  rig.soft.push_back(make_particles<double>(*make_icosphere(2, 1.0), {0, 0, 0}, Vec3d::Zero(), surface(0.3, 0.5)));
  rig.rigid.push_back(make_rigid(SphereShape{0.3}, 0.2, {-2, 0.2, 0}, {5, 0, 0}));
  rig.rigid.push_back(make_rigid(BoxShape{{0.2, 0.3, 0.4}}, 2.0, {2, 0.2, 0}, {-5, 0, 0}));
  const Vec3d momentum = rig.momentum();
  for (int i = 0; i < 480; ++i) {
    rig.step();
    ASSERT_LT((rig.momentum() - momentum).norm(), 1e-11);
  }
  EXPECT_LT(rig.rigid[0].velocity.x(), 5.0);
  EXPECT_GT(rig.rigid[1].velocity.x(), -5.0);
  EXPECT_GT(rig.rigid[1].angular_velocity.norm(), 0.0);
}

TEST(Contact, PinnedClothHoldsARigidBall) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.soft.push_back(make_particles<double>(*make_grid(20, 20, 1.0, 1.0), Vec3d::Zero(), Vec3d::Zero()));
  rig.soft[0].pinned.assign(rig.soft[0].x.size(), 1);
  rig.rigid.push_back(make_rigid(SphereShape{0.2}, 1.0, {0, 0.5, 0}));
  rig.run(3.0);
  EXPECT_NEAR(rig.rigid[0].position.y(), 0.2, 0.01);
}

// What a restored world starts with.
TEST(Contact, ScratchFromEarlierSubstepsDoesNotMatter) {
  std::vector<std::vector<Vec3d>> ends;
  for (const bool fresh : {false, true}) {
    Rig<double> rig;
    rig.gravity_m_s2 = earth_gravity;
    for (int i = 0; i < 3; ++i) {
      rig.soft.push_back(
          make_particles<double>(*make_icosphere(1, 0.6), {0.9 * i, 0, 0}, {1.0 - i, 0, 0.3}, surface(0.5, 0.4)));
    }
    rig.rigid.push_back(make_rigid(BoxShape{{0.3, 0.1, 0.2}}, 0.5, {0.5, 1.0, 0}));
    rig.colliders.push_back(make_collider(RoomShape{{2.5, 2.5, 2.5}}, {0.5, 1, 0}, surface(0.5, 0.4)));
    for (int i = 0; i < 300; ++i) {
      if (fresh) rig.contacts = Contacts<double>();
      rig.step();
    }
    ends.emplace_back();
    for (const auto& body : rig.soft) ends.back().insert(ends.back().end(), body.x.begin(), body.x.end());
    ends.back().push_back(rig.rigid[0].position);
  }
  EXPECT_EQ(ends[0], ends[1]);
}

TEST(Contact, SameBitsForAnyNumberOfWorkers) {
  std::vector<std::vector<Vec3d>> ends;
  for (const std::size_t threads : {1U, 2U, 5U}) {
    Workers workers(threads);
    Rig<double> rig;
    rig.gravity_m_s2 = earth_gravity;
    for (int i = 0; i < 6; ++i) {
      const int row = i / 2;
      const Vec3d place(i % 2, row, 0.1 * i);
      rig.soft.push_back(
          make_particles<double>(*make_icosphere(3, 0.6), place, {1.0 - i, 1.0 * i, 0.3}, surface(0.5, 0.4)));
    }
    rig.rigid.push_back(make_rigid(SphereShape{0.3}, 0.5, {0.5, -1.0, 0}));
    rig.colliders.push_back(make_collider(RoomShape{{2.5, 2.5, 2.5}}, {0.5, 1, 0}, surface(0.5, 0.4)));
    rig.colliders[0].collider.angular_velocity = Vec3d(0, 0, 1);
    for (int i = 0; i < 200; ++i) rig.step(workers);
    ends.emplace_back();
    for (const auto& body : rig.soft) ends.back().insert(ends.back().end(), body.x.begin(), body.x.end());
    ends.back().push_back(rig.rigid[0].position);
  }
  EXPECT_EQ(ends[0], ends[1]);
  EXPECT_EQ(ends[0], ends[2]);
}

}  // namespace
}  // namespace pneuma::physics
