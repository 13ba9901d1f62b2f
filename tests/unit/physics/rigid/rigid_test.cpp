// Shows that rigid balls and boxes move and meet as mechanics says: exact turning, kept angular momentum, heights of
// bounces, exchanged velocities, Coulomb's slope, rest without drift, nothing lost through thin walls or out of a
// turning room, at any spin and in any unit of length.

#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "physics/rigid/rigid_contacts.h"
#include "physics/rigid/rigid_motion.h"
#include "unit/physics/contact/contact_rig.h"

namespace pneuma::physics {
namespace {

double angle_between(const Quatd& a, const Quatd& b) {
  return a.angularDistance(b);
}

TEST(MoveSolids, ColliderTurnsExactlyForTenMinutes) {
  std::vector<ColliderState> colliders{make_collider(RoomShape{{1, 1, 1}})};
  colliders[0].collider.angular_velocity = Vec3d(0.3, -0.4, 1.2);
  const int substeps = 600 * 480;
  for (int i = 0; i < substeps; ++i) move_solids({}, colliders, 1.0 / 480.0);
  const double angle = std::remainder(1.3 * 600.0, 2.0 * std::numbers::pi);
  const Quatd wanted(Eigen::AngleAxisd(angle, Vec3d(0.3, -0.4, 1.2).normalized()));
  EXPECT_LT(angle_between(colliders[0].orientation, wanted), 1e-8);
  EXPECT_NEAR(colliders[0].orientation.norm(), 1.0, 1e-14);
}

TEST(MoveSolids, ColliderStopsAtTheEndOfWhatASceneMayHave) {
  std::vector<ColliderState> colliders{make_collider(RoomShape{{1, 1, 1}})};
  colliders[0].collider.velocity = Vec3d(base::scene_number_max, 1.0, -base::scene_number_max);
  for (int i = 0; i < 3; ++i) move_solids({}, colliders, 0.7);
  EXPECT_EQ(colliders[0].position.x(), base::scene_number_max);
  EXPECT_DOUBLE_EQ(colliders[0].position.y(), 2.1);
  EXPECT_EQ(colliders[0].position.z(), -base::scene_number_max);
}

// A box that turns about its middle axis tumbles; angular momentum about the centre stays, and so, nearly, does energy.
TEST(MoveSolids, TumblingBoxKeepsAngularMomentum) {
  std::vector<RigidState> rigid{make_rigid(BoxShape{{0.1, 0.2, 0.4}}, 2.0, Vec3d::Zero())};
  RigidState& body = rigid[0];
  body.angular_velocity = Vec3d(0.01, 10.0, 0.01);
  const Vec3d inertia = body.inverse_inertia_1_kg_m2.cwiseInverse();
  const auto momentum = [&]() -> Vec3d {
    return body.orientation * inertia.cwiseProduct(body.orientation.conjugate() * body.angular_velocity);
  };
  const Vec3d momentum_before = momentum();
  const double energy_before = 0.5 * body.angular_velocity.dot(momentum_before);
  bool flipped = false;
  for (int i = 0; i < 60 * 480; ++i) {
    move_solids(rigid, {}, 1.0 / 480.0);
    flipped = flipped || (body.orientation.conjugate() * body.angular_velocity).y() < -5.0;
    ASSERT_NEAR(0.5 * body.angular_velocity.dot(momentum()), energy_before, 0.01 * energy_before) << i;
  }
  EXPECT_LT((momentum() - momentum_before).norm(), 1e-9 * momentum_before.norm());
  EXPECT_TRUE(flipped);
}

TEST(Rigid, FreeFallIsTheParabola) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.rigid.push_back(make_rigid(SphereShape{0.1}, 1.0, {0, 100, 0}, {1, 2, 0}));
  rig.run(2.0);
  EXPECT_LT((rig.rigid[0].position - Vec3d(2, 100 + 4 - 0.5 * 9.81 * 4, 0)).norm(), 1e-9);
}

double rebound_height_m(const Shape& shape, double half_height_m, double restitution, double height_m) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.rigid.push_back(make_rigid(shape, 1.0, {0, height_m + half_height_m, 0}));
  rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), surface(restitution, 0.3)));
  double top_m = 0.0;
  for (bool rising = false, landed = false; !landed;) {
    rig.step();
    const double v = rig.rigid[0].velocity.y();
    rising = rising || v > 0.0;
    top_m = rising ? std::max(top_m, rig.rigid[0].position.y() - half_height_m) : 0.0;
    landed = rising && v <= 0.0;
  }
  return top_m;
}

TEST(Rigid, BounceHeightIsRestitutionSquared) {
  for (const double restitution : {0.3, 0.5, 0.8, 1.0}) {
    for (const double height_m : {0.313, 1.0, 4.77}) {
      const double wanted_m = restitution * restitution * height_m;
      EXPECT_NEAR(rebound_height_m(SphereShape{0.2}, 0.2, restitution, height_m), wanted_m, 0.01 * wanted_m);
      EXPECT_NEAR(rebound_height_m(BoxShape{{0.3, 0.2, 0.3}}, 0.2, restitution, height_m), wanted_m, 0.01 * wanted_m);
    }
  }
}

TEST(Rigid, EqualSpheresExchangeVelocities) {
  Rig<double> rig;
  rig.rigid.push_back(make_rigid(SphereShape{0.1}, 1.0, {-1, 0, 0}, {3, 0, 0}, surface(1.0, 0.0)));
  rig.rigid.push_back(make_rigid(SphereShape{0.1}, 1.0, {1, 0, 0}, {-1, 0, 0}, surface(1.0, 0.0)));
  rig.run(1.0);
  EXPECT_LT((rig.rigid[0].velocity - Vec3d(-1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((rig.rigid[1].velocity - Vec3d(3, 0, 0)).norm(), 1e-12);
}

TEST(Rigid, ObliqueHitKeepsMomentum) {
  Rig<double> rig;
  rig.rigid.push_back(make_rigid(SphereShape{0.1}, 1.0, {-1, 0.05, 0}, {3, 0, 0.1}, surface(0.5, 0.5)));
  rig.rigid.push_back(make_rigid(BoxShape{{0.2, 0.1, 0.15}}, 2.0, {0.5, 0, 0}, {-1, 0, 0}, surface(0.5, 0.5)));
  rig.rigid[1].orientation = Quatd(Eigen::AngleAxisd(0.4, Vec3d(1, 1, 0).normalized()));
  const Vec3d before = rig.momentum();
  rig.run(1.0);
  EXPECT_LT((rig.momentum() - before).norm(), 1e-12);
  EXPECT_GT(rig.rigid[0].angular_velocity.norm(), 0.01);
}

TEST(Rigid, BoxRestsOnAPlaneForTenSeconds) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.rigid.push_back(make_rigid(BoxShape{{0.3, 0.2, 0.4}}, 3.0, {0, 0.25, 0}, Vec3d::Zero(), surface(0.4, 0.5)));
  rig.colliders.push_back(make_collider(PlaneShape{}));
  rig.run(2.0);
  const Vec3d rest = rig.rigid[0].position;
  EXPECT_NEAR(rest.y(), 0.2, 1e-4);
  for (int i = 0; i < 4'800; ++i) {
    rig.step();
    ASSERT_LT((rig.rigid[0].position - rest).norm(), 1e-6) << i;
    ASSERT_LT(angle_between(rig.rigid[0].orientation, Quatd::Identity()), 1e-5) << i;
    ASSERT_LT(rig.rigid[0].velocity.norm(), 1e-6) << i;
  }
}

TEST(Rigid, StackOfBoxesStands) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  for (int i = 0; i < 4; ++i) {
    rig.rigid.push_back(
        make_rigid(BoxShape{{0.2, 0.2, 0.2}}, 1.0, {0, 0.2 + 0.4 * i, 0}, Vec3d::Zero(), surface(0.0, 0.6)));
  }
  rig.colliders.push_back(make_collider(BoxShape{{5, 0.5, 5}}, {0, -0.5, 0}, surface(0.0, 0.6)));
  rig.run(5.0);
  for (int i = 0; i < 4; ++i)
    EXPECT_LT((rig.rigid[static_cast<std::size_t>(i)].position - Vec3d(0, 0.2 + 0.4 * i, 0)).norm(), 5e-3);
}

double box_slide_m(double slope_rad, double friction) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  const Quatd tilt(Eigen::AngleAxisd(-slope_rad, Vec3d::UnitZ()));
  const Vec3d start = tilt * Vec3d(0, 0.1, 0);
  rig.rigid.push_back(make_rigid(BoxShape{{0.4, 0.1, 0.4}}, 1.0, start));
  rig.rigid[0].orientation = tilt;
  rig.colliders.push_back(make_collider(PlaneShape{tilt * Vec3d::UnitY()}, Vec3d::Zero(), surface(0.0, friction)));
  rig.run(2.0);
  return (rig.rigid[0].position - start).norm();
}

struct Tower {
  int boxes;
  double mass_ratio;  // of each box to the one that it stands on
};

// By sweeps alone a box sank through one of a tenth of its mass, and at 60 steps a second five equal ones fell over.
TEST(Rigid, TowerStandsHoweverHeavyItsTopIs) {
  for (const auto& [boxes, mass_ratio] : {Tower{5, 1.0}, Tower{5, 5.0}, Tower{5, 10.0}, Tower{2, 1'000.0}}) {
    for (const double rate_hz : {60.0, 480.0}) {
      Rig<double> rig;
      rig.dt_s = 1.0 / rate_hz;
      rig.gravity_m_s2 = earth_gravity;
      rig.colliders.push_back(make_collider(PlaneShape{}, Vec3d::Zero(), surface(0.0, 0.6)));
      double mass_kg = 1.0;
      for (int i = 0; i < boxes; ++i) {
        rig.rigid.push_back(make_rigid(BoxShape{{0.2, 0.2, 0.2}}, mass_kg, {0.01 * (i % 2), 0.2 + 0.4 * i, 0},
                                       Vec3d::Zero(), surface(0.0, 0.6)));
        mass_kg *= mass_ratio;
      }
      const std::vector<RigidState> start = rig.rigid;
      rig.run(1.0);
      for (std::size_t i = 0; i < start.size(); ++i) {
        const auto what = [&] {
          return ::testing::Message() << mass_ratio << ", box " << i << ", " << rate_hz << " Hz";
        };
        ASSERT_LT((rig.rigid[i].position - start[i].position).norm(), 1e-4) << what();
        ASSERT_LT((rig.rigid[i].orientation * Vec3d::UnitY() - Vec3d::UnitY()).norm(), 1e-4) << what();
        ASSERT_LT(rig.rigid[i].velocity.norm(), 1e-4) << what();
      }
    }
  }
}

TEST(Rigid, SlopeHoldsIffItsTangentIsWithinFriction) {
  for (const double slope_rad : {0.1, 0.3, 0.5}) {
    EXPECT_LT(box_slide_m(slope_rad, 1.02 * std::tan(slope_rad)), 1e-3);
    EXPECT_GT(box_slide_m(slope_rad, 0.98 * std::tan(slope_rad)), 0.01);
  }
}

// A ball that does not slip rolls down at 5/7 of g sin(slope).
TEST(Rigid, BallRollsDownASlope) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  const double slope_rad = 0.2;
  const Quatd tilt(Eigen::AngleAxisd(-slope_rad, Vec3d::UnitZ()));
  rig.rigid.push_back(make_rigid(SphereShape{0.1}, 1.0, tilt * Vec3d(0, 0.1, 0)));
  rig.colliders.push_back(make_collider(PlaneShape{tilt * Vec3d::UnitY()}, Vec3d::Zero(), surface(0.0, 1.0)));
  rig.run(2.0);
  const double wanted_m_s = 5.0 / 7.0 * 9.81 * std::sin(slope_rad) * 2.0;
  EXPECT_NEAR(rig.rigid[0].velocity.norm(), wanted_m_s, 0.01 * wanted_m_s);
}

TEST(Rigid, NothingPassesAThinWall) {
  for (const Shape& shape : {Shape(SphereShape{0.05}), Shape(BoxShape{{0.05, 0.03, 0.04}})}) {
    for (const Shape& wall :
         {Shape(BoxShape{{20, 0.001, 20}}), Shape(PlaneShape{}), Shape(EllipsoidShape{{200, 0.01, 200}})}) {
      Rig<double> rig;
      rig.rigid.push_back(make_rigid(shape, 1.0, {0, 2, 0}, {0, -1'000, 0}, surface(0.3, 0.3)));
      rig.colliders.push_back(make_collider(wall));
      rig.run(0.05);
      EXPECT_GT(rig.rigid[0].position.y(), 0.0) << shape.index() << ' ' << wall.index();
    }
  }
}

const Vec3d slab_half_m(0.005, 1, 1);

double energy_j(const RigidState& body) {
  const Vec3d spin = body.orientation.conjugate() * body.angular_velocity;
  const Vec3d inertia = body.inverse_inertia_1_kg_m2.cwiseInverse();
  return 0.5 * body.body.mass_kg * body.velocity.squaredNorm() + 0.5 * spin.dot(inertia.cwiseProduct(spin));
}

/// A slab 1 cm thick on its way to a wall as thick, at a chance slant.
Rig<double> slab_at_wall(double speed_m_s, double spin_rad_s, const Surface& skin, std::mt19937& random) {
  std::uniform_real_distribution<double> within(-1.0, 1.0);
  const auto vector = [&] {
    const double x = within(random);
    const double y = within(random);
    return Vec3d(x, y, within(random));
  };
  Rig<double> rig;
  const Vec3d aside = 0.3 * speed_m_s * vector();
  rig.rigid.push_back(make_rigid(BoxShape{slab_half_m}, 1.0, {-3, 0, 0}, {speed_m_s, aside.y(), aside.z()}, skin));
  rig.rigid[0].orientation = Quatd(Eigen::AngleAxisd(3.0 * within(random), vector().normalized()));
  rig.rigid[0].angular_velocity = spin_rad_s * vector();
  rig.colliders.push_back(make_collider(BoxShape{{0.005, 2000, 2000}}));
  return rig;
}

TEST(Rigid, SlabAtAnySlantAndSpinDoesNotPassAThinWall) {
  std::mt19937 random(3);
  for (const double rate_hz : {60.0, 480.0}) {
    for (const double speed_m_s : {100.0, 1'000.0}) {
      for (const double spin_rad_s : {0.0, 30.0, 300.0, 3'000.0}) {
        for (int i = 0; i < 20; ++i) {
          Rig<double> rig = slab_at_wall(speed_m_s, spin_rad_s, surface(0.5 * (i % 3), 0.5 * (i % 2)), random);
          rig.dt_s = 1.0 / rate_hz;
          for (int step = 0; step < 20 + static_cast<int>(6.0 / speed_m_s * rate_hz); ++step) {
            rig.step();
            ASSERT_LT(rig.rigid[0].position.x(), 0.0)
                << rate_hz << " Hz, " << speed_m_s << " m/s, " << spin_rad_s << " rad/s, slab " << i;
          }
        }
      }
    }
  }
}

TEST(Rigid, SlabThatDoesNotBounceGainsNoEnergyAtAWall) {
  std::mt19937 random(4);
  for (int i = 0; i < 50; ++i) {
    Rig<double> rig = slab_at_wall(1'000.0, 0.0, surface(0.0, 0.0), random);
    double before_j = energy_j(rig.rigid[0]);
    // It turns freely afterwards, which keeps its energy nearly only.
    for (int step = 0; step < 4 && rig.rigid[0].angular_velocity.norm() == 0.0; ++step) {
      rig.step();
      EXPECT_LE(energy_j(rig.rigid[0]), (1.0 + 1e-9) * before_j) << i;
      before_j = energy_j(rig.rigid[0]);
    }
    EXPECT_NE(rig.rigid[0].angular_velocity.norm(), 0.0) << i << ": it did not meet the wall";
  }
}

TEST(Rigid, FreeSpinIsThatOfABodyAlone) {
  Rig<double> rig;
  rig.rigid.push_back(make_rigid(BoxShape{slab_half_m}, 1.0, {-300, 0, 0}, {1, 2, 3}));
  rig.rigid[0].angular_velocity = Vec3d(1'000, 20, 3'000);
  std::vector<RigidState> alone = rig.rigid;
  rig.colliders.push_back(make_collider(BoxShape{{0.005, 2000, 2000}}));
  for (int i = 0; i < 480; ++i) {
    rig.step();
    move_solids(alone, {}, rig.dt_s);
    ASSERT_EQ(rig.rigid[0].orientation.coeffs(), alone[0].orientation.coeffs()) << i;
    ASSERT_EQ(rig.rigid[0].angular_velocity, alone[0].angular_velocity) << i;
  }
}

// Faster than its own thickness in a substep, so that it bounces between two.
TEST(Rigid, ThinPlateBouncesToItsHeight) {
  for (const double restitution : {0.5, 1.0}) {
    const double wanted_m = restitution * restitution * 4.77;
    EXPECT_NEAR(rebound_height_m(BoxShape{{0.3, 0.005, 0.3}}, 0.005, restitution, 4.77), wanted_m, 0.01 * wanted_m);
  }
}

TEST(Rigid, TumblesTheSameInAnyUnitOfLength) {
  const auto tumbled = [](double unit) {
    Rig<double> rig;
    rig.gravity_m_s2 = unit * earth_gravity;
    rig.rigid.push_back(make_rigid(BoxShape{unit * Vec3d(0.3, 0.2, 0.1)}, 1.0, unit * Vec3d(0, 1, 0),
                                   unit * Vec3d(1, 0, 0), surface(0.3, 0.5)));
    rig.rigid.push_back(make_rigid(SphereShape{unit * 0.2}, 1.0, unit * Vec3d(0.5, 2, 0)));
    rig.rigid[0].orientation = Quatd(Eigen::AngleAxisd(0.4, Vec3d(1, 1, 0).normalized()));
    rig.colliders.push_back(make_collider(PlaneShape{}));
    rig.run(1.0);
    return std::vector<Vec3d>{rig.rigid[0].position / unit, rig.rigid[1].position / unit};
  };
  const std::vector<Vec3d> in_metres = tumbled(1.0);
  for (const double unit : {1.0 / 1024.0, 1024.0}) {
    const std::vector<Vec3d> scaled = tumbled(unit);
    for (std::size_t i = 0; i < scaled.size(); ++i) EXPECT_LT((scaled[i] - in_metres[i]).norm(), 1e-9) << unit;
  }
}

TEST(Rigid, BoxRestsOnRoundColliders) {
  for (const Shape& shape :
       {Shape(SphereShape{0.5}), Shape(EllipsoidShape{{1, 0.5, 1}}), Shape(CapsuleShape{0.25, 0.25})}) {
    Rig<double> rig;
    rig.gravity_m_s2 = earth_gravity;
    rig.rigid.push_back(make_rigid(BoxShape{{0.3, 0.1, 0.3}}, 1.0, {0, 0.65, 0}));
    rig.colliders.push_back(make_collider(shape, Vec3d::Zero(), surface(0.0, 0.8)));
    rig.run(1.0);
    EXPECT_NEAR(rig.rigid[0].position.y(), 0.6, 2e-3) << shape.index();
  }
}

TEST(Rigid, TurningRoomKeepsBallsAndBoxesInside) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.rigid.push_back(make_rigid(SphereShape{0.3}, 1.0, {0, 0, 0}, {5, 1, 2}));
  rig.rigid.push_back(make_rigid(SphereShape{0.2}, 0.1, {1, 1, 0}, {-5, 1, 2}));
  rig.rigid.push_back(make_rigid(BoxShape{{0.3, 0.2, 0.1}}, 2.0, {-1, 0, 1}, {5, -8, 2}));
  rig.rigid.push_back(make_rigid(BoxShape{{0.2, 0.2, 0.2}}, 0.5, {-1, 1, -1}, {0, 0, 0}));
  rig.colliders.push_back(make_collider(RoomShape{{2, 2, 2}}, Vec3d::Zero(), surface(0.6, 0.5)));
  rig.colliders[0].collider.angular_velocity = Vec3d(0.2, 0.4, 0.8);
  for (int i = 0; i < 20 * 480; ++i) {
    rig.step();
    const Frame room(rig.colliders[0].position, rig.colliders[0].orientation);
    for (const RigidState& body : rig.rigid) {
      const Vec3d local = room.to_local(body.position);
      const double least_m = std::holds_alternative<SphereShape>(body.body.shape) ? 0.2 : 0.1;
      ASSERT_LT(local.cwiseAbs().maxCoeff(), 2.0 - least_m + 0.02) << "substep " << i;
      ASSERT_TRUE(body.angular_velocity.allFinite());
    }
  }
}

// The contacts of all pairs, looked at one by one, bit for bit and in the same order.
TEST(RigidPairs, GiveTheContactsOfAllPairs) {
  std::mt19937 random(5);
  const auto within = [&random](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto vector = [&](double size) { return Vec3d(within(-size, size), within(-size, size), within(-size, size)); };
  std::size_t found = 0;
  std::size_t looked_at = 0;
  for (int round = 0; round < 100; ++round) {
    std::vector<RigidState> rigid;
    const double far_m = round % 10 == 0 ? 1e6 : 0.0;
    for (int i = 0; i < 40; ++i) {
      const Shape shape = i % 2 == 0 ? Shape(SphereShape{within(0.05, 0.4)})
                                     : Shape(BoxShape{{within(0.05, 0.4), within(0.05, 0.4), within(0.05, 0.4)}});
      const Surface skin{.restitution = 0.5, .friction = 0.5, .thickness_m = within(0.0, 0.05)};
      rigid.push_back(make_rigid(shape, 1.0, vector(2.0) + Vec3d(far_m, 0, 0), vector(20.0), skin));
      rigid.back().angular_velocity = vector(30.0);
      rigid.back().orientation = Quatd(Eigen::AngleAxisd(within(0.0, 3.0), vector(1.0).normalized()));
      rigid.back().frozen = i % 7 == 0;
    }
    std::vector<RigidContact> all;
    for (std::uint32_t a = 0; a < rigid.size(); ++a) {
      for (std::uint32_t b = a + 1; b < rigid.size(); ++b) {
        if (!rigid[a].frozen && !rigid[b].frozen) find_rigid_contacts(rigid, a, b, rig_dt_s, all);
      }
    }
    std::vector<std::uint32_t> order;
    std::vector<RigidPair> pairs;
    find_rigid_pairs(rigid, rig_dt_s, order, pairs);
    std::vector<RigidContact> swept;
    for (const RigidPair& pair : pairs) find_rigid_contacts(rigid, pair.a, pair.b, rig_dt_s, swept);
    ASSERT_EQ(swept.size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      ASSERT_EQ(swept[i].a, all[i].a);
      ASSERT_EQ(swept[i].b, all[i].b);
      ASSERT_EQ(swept[i].point, all[i].point);
      ASSERT_EQ(swept[i].normal, all[i].normal);
      ASSERT_EQ(swept[i].distance_m, all[i].distance_m);
    }
    found += all.size();
    looked_at += pairs.size();
  }
  EXPECT_GT(found, 1000U);
  EXPECT_LT(looked_at, 100U * 34U * 33U / 2U / 4U);  // a quarter of all pairs
}

}  // namespace
}  // namespace pneuma::physics
