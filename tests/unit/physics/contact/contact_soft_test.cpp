// Shows that soft bodies meet each other's bounding volumes as section 3.5 of the paper says, and that whatever they do
// to each other adds no energy and keeps momentum, angular momentum and the common centre of mass.
#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"
#include "unit/physics/contact/contact_rig.h"

namespace pneuma::physics {
namespace {

// Balls thrown into each other at random: sizes, masses, spins, dents and surfaces of every kind.
class Overlaps {
 public:
  explicit Overlaps(unsigned seed) : random_(seed) {}

  double within(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  Vec3d vector(double size) { return {within(-size, size), within(-size, size), within(-size, size)}; }

  template <class Real>
  Rig<Real> rig() {
    Rig<Real> rig;
    const int bodies = 2 + static_cast<int>(random_() % 3);
    for (int i = 0; i < bodies; ++i) {
      const Surface skin = surface(random_() % 2 == 0 ? 1.0 : within(0.0, 1.0), within(0.0, 1.0), within(0.0, 0.05));
      const auto mesh = *make_icosphere(1, within(0.4, 1.0));
      rig.soft.push_back(make_particles<Real>(mesh, vector(0.8), Vec3d::Zero(), skin, std::exp(within(-3.0, 3.0))));
      SoftState<Real>& body = rig.soft.back();
      body.body.collision.bounds = static_cast<BoundsKind>(random_() % 3);
      const Vec3d velocity = vector(5.0);
      const Vec3d spin = vector(5.0);
      for (std::size_t k = 0; k < body.x.size(); ++k) {
        const Vec3d arm = mesh->positions_m[k];
        body.x[k] += vector(0.1).cast<Real>();
        body.v[k] = (velocity + spin.cross(arm) + vector(1.0)).cast<Real>();
      }
    }
    return rig;
  }

 private:
  std::mt19937 random_;
};

/// Moments of momentum about the origin, with the particles at `places`.
Vec3d angular_momentum(const Rig<double>& rig, const std::vector<std::vector<Vec3d>>& places) {
  Vec3d sum = Vec3d::Zero();
  for (std::size_t i = 0; i < rig.soft.size(); ++i) {
    for (std::size_t k = 0; k < places[i].size(); ++k) {
      sum += rig.soft[i].mass_kg(k) * places[i][k].cross(rig.soft[i].v[k]);
    }
  }
  return sum;
}

/// Steps, and shows that no energy comes of it and that momentum, angular momentum and the centre of mass's motion are
/// kept to `tolerance`. False where nothing met.
bool step_keeping_sums(Rig<double>& rig, double tolerance) {
  std::vector<std::vector<Vec3d>> places;
  for (const auto& body : rig.soft) places.push_back(body.x);
  const double energy_j = rig.kinetic_j();
  const Vec3d momentum = rig.momentum();
  const Vec3d turning = angular_momentum(rig, places);
  const Vec3d moment = rig.first_moment() + rig.dt_s * momentum;
  rig.step();
  EXPECT_LE(rig.kinetic_j(), energy_j * (1.0 + 1e-13));
  EXPECT_LT((rig.momentum() - momentum).norm(), tolerance);
  EXPECT_LT((angular_momentum(rig, places) - turning).norm(), tolerance);
  EXPECT_LT((rig.first_moment() - moment).norm(), tolerance);
  return rig.kinetic_j() != energy_j;
}

TEST(SoftContact, AddsNoEnergyAndKeepsMomentumWhateverOverlaps) {
  int met = 0;
  for (unsigned seed = 0; seed < 500; ++seed) {
    Rig<double> rig = Overlaps(seed).rig<double>();
    SCOPED_TRACE(seed);
    met += step_keeping_sums(rig, 1e-12) ? 1 : 0;
  }
  EXPECT_GT(met, 400);
}

TEST(SoftContact, AddsNoEnergyAndKeepsMomentumOfVerticesOfDifferentMass) {
  int met = 0;
  for (unsigned seed = 0; seed < 500; ++seed) {
    Rig<double> rig = Overlaps(seed).rig<double>();
    std::mt19937 random(seed);
    for (auto& body : rig.soft) {
      const double ratio = std::pow(10.0, 6.0 * static_cast<double>(random() % 100) / 100.0);
      for (std::size_t k = 0; k < body.x.size(); ++k) {
        body.mass_shares.push_back(std::pow(ratio, static_cast<double>(random() % 100) / 100.0 - 0.5));
      }
    }
    SCOPED_TRACE(seed);
    met += step_keeping_sums(rig, 1e-11 * std::sqrt(rig.kinetic_j())) ? 1 : 0;
  }
  EXPECT_GT(met, 400);
}

TEST(SoftContact, AddsNoEnergyInSinglePrecisionOrToBodiesThatArePinned) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    Rig<float> single = Overlaps(seed).rig<float>();
    const double single_j = single.kinetic_j();
    const Vec3d momentum = single.momentum();
    single.step();
    EXPECT_LE(single.kinetic_j(), single_j * (1.0 + 1e-6)) << seed;
    EXPECT_LT((single.momentum() - momentum).norm(), 1e-4) << seed;

    Rig<double> pinned = Overlaps(seed).rig<double>();
    for (std::size_t i = 0; i < pinned.soft.size(); ++i) {
      SoftState<double>& body = pinned.soft[i];
      body.pinned.assign(body.x.size(), 0);
      for (std::size_t k = 0; k < body.x.size(); k += i + 1) {
        body.pinned[k] = 1;
        body.v[k].setZero();
      }
    }
    const double pinned_j = pinned.kinetic_j();
    pinned.step();
    EXPECT_LE(pinned.kinetic_j(), pinned_j * (1.0 + 1e-13)) << seed;
  }
}

/// Angular momentum about the body's own centre.
Vec3d spin(const SoftState<double>& body) {
  Vec3d centre = Vec3d::Zero();
  for (const Vec3d& x : body.x) centre += x / static_cast<double>(body.x.size());
  Vec3d sum = Vec3d::Zero();
  for (std::size_t k = 0; k < body.x.size(); ++k) sum += body.vertex_mass_kg * (body.x[k] - centre).cross(body.v[k]);
  return sum;
}

// Two balls that brush each other begin to spin, at the cost of the turning of their centres about each other.
TEST(SoftContact, GrazingHitKeepsAngularMomentum) {
  Rig<double> rig;
  rig.soft.push_back(
      make_particles<double>(*make_icosphere(2, 1.0), {-1.5, 0.7, 0}, {3, 0, 0}, surface(0.5, 0.8), 1.0));
  rig.soft.push_back(
      make_particles<double>(*make_icosphere(2, 1.0), {1.5, -0.7, 0.1}, {-2, 0.5, 0}, surface(0.5, 0.8), 2.5));
  const auto turning = [&rig] {
    std::vector<std::vector<Vec3d>> places;
    for (const auto& body : rig.soft) places.push_back(body.x);
    return angular_momentum(rig, places);
  };
  const Vec3d before = turning();
  const Vec3d spin_before = spin(rig.soft[0]);
  for (int i = 0; i < 960; ++i) rig.step();
  // What is left is of the moves that are cut, not of the impulses.
  EXPECT_LT((turning() - before).norm(), 0.01 * before.norm());
  EXPECT_GT((spin(rig.soft[0]) - spin_before).norm(), 0.1 * before.norm());
}

class SoftBounds : public testing::TestWithParam<BoundsKind> {};

// Whatever the vertices of two balls do to each other, momentum stays, and the common centre of mass goes on as before.
TEST_P(SoftBounds, HeadOnHitKeepsMomentumAndCentreOfMass) {
  Rig<double> rig;
  rig.soft.push_back(
      make_particles<double>(*make_icosphere(2, 1.0), {-1.5, 0.1, 0}, {3, 0, 0}, surface(0.5, 0.3), 1.0));
  rig.soft.push_back(
      make_particles<double>(*make_icosphere(2, 1.0), {1.5, 0, 0.1}, {-2, 0.5, 0}, surface(0.5, 0.3), 2.5));
  for (auto& body : rig.soft) body.body.collision.bounds = GetParam();
  const Vec3d momentum = rig.momentum();
  Vec3d moment = rig.first_moment();
  bool met = false;
  for (int i = 0; i < 480; ++i) {
    rig.step();
    moment += rig.dt_s * momentum;
    met = met || rig.soft[0].v[0] != Vec3d(3, 0, 0);
    ASSERT_LT((rig.momentum() - momentum).norm(), 1e-11) << i;
  }
  EXPECT_TRUE(met);
  EXPECT_LT((rig.first_moment() - moment).norm(), 1e-10);
}

double overlap_x_m(const Rig<double>& rig) {
  const auto x = [](const Vec3d& place) { return place.x(); };
  return std::ranges::max(rig.soft[0].x, {}, x).x() - std::ranges::min(rig.soft[1].x, {}, x).x();
}

TEST_P(SoftBounds, PushingApartKeepsTheCentreOfMass) {
  Rig<double> rig;
  rig.soft.push_back(make_particles<double>(*make_icosphere(2, 1.0), {-0.8, 0, 0}, Vec3d::Zero()));
  rig.soft.push_back(make_particles<double>(*make_icosphere(2, 1.0), {0.8, 0.1, 0}, Vec3d::Zero(), {}, 3.0));
  for (auto& body : rig.soft) body.body.collision.bounds = GetParam();
  const Vec3d moment = rig.first_moment();
  const double overlap_m = overlap_x_m(rig);
  rig.run(3.0);
  EXPECT_LT((rig.first_moment() - moment).norm(), 1e-12);
  EXPECT_LT(rig.momentum().norm(), 1e-12);
  EXPECT_LT(overlap_x_m(rig), overlap_m / 3.0);
}

// A speck that falls on a heavy body is as good as alone: it ends on or outside the bounds.
TEST_P(SoftBounds, VertexStaysOutside) {
  Rig<double> rig;
  rig.gravity_m_s2 = earth_gravity;
  rig.soft.push_back(make_particles<double>(speck(), {0.1, 1.3, 0.2}, {0, -500, 0}, {}, 1e-6));
  rig.soft.push_back(make_particles<double>(*make_icosphere(2, 1.0), Vec3d::Zero(), Vec3d::Zero(), {}, 1e6));
  rig.soft[1].pinned.assign(rig.soft[1].x.size(), 1);
  rig.soft[1].body.collision.bounds = GetParam();
  rig.run(0.2);
  const Vec3d half = fit_ellipsoid<double>(rig.soft[1].x).radii_m;
  const Shape bounds = GetParam() == BoundsKind::box ? Shape(BoxShape{half}) : Shape(EllipsoidShape{half});
  for (const Vec3d& x : rig.soft[0].x) EXPECT_GT(surface_distance(bounds, x), -1e-3);
}

INSTANTIATE_TEST_SUITE_P(Kinds, SoftBounds, testing::Values(BoundsKind::box, BoundsKind::ball, BoundsKind::ellipsoid));

// The speck's three vertices, of mass m each, hit a body of mass M at rest at once: dv = -(1 + e) v M / (3 m + M), as
// two masses do, and the body gets the three impulses.
TEST(SoftContact, BodiesPartByTheirMasses) {
  Rig<double> rig;
  rig.soft.push_back(make_particles<double>(speck(), {0, 1.5, 0}, {0, -2, 0}, surface(0.6, 0.0), 0.3));
  rig.soft.push_back(make_particles<double>(*make_icosphere(2, 1.0), Vec3d::Zero(), Vec3d::Zero(), {}, 1.0));
  for (int i = 0; i < 480 && rig.soft[0].v[0].y() == -2.0; ++i) rig.step();
  const double change = 1.6 * 2.0 * 1.0 / (0.3 + 1.0);
  for (const Vec3d& v : rig.soft[0].v) EXPECT_NEAR(v.y(), -2.0 + change, 1e-5);
  for (const Vec3d& v : rig.soft[1].v) EXPECT_NEAR(v.y(), -3 * 0.1 * change, 1e-5);
}

TEST(SoftContact, FlatSheetHasTwoSides) {
  for (const double side : {-1.0, 1.0}) {
    Rig<double> rig;
    rig.soft.push_back(make_particles<double>(*make_grid(4, 4, 2.0, 2.0), Vec3d::Zero(), Vec3d::Zero()));
    rig.soft[0].pinned.assign(rig.soft[0].x.size(), 1);
    rig.soft.push_back(make_particles<double>(speck(), {0, side, 0}, {0, -3 * side, 0}));
    rig.run(1.0);
    for (const Vec3d& x : rig.soft[1].x) EXPECT_GT(side * x.y(), 0.0);
  }
}

TEST(SoftContact, BodiesThatAreNotToMeetPassThroughEachOther) {
  Rig<double> rig;
  rig.soft.push_back(make_particles<double>(*make_icosphere(1, 1.0), {-2, 0, 0}, {4, 0, 0}));
  rig.soft.push_back(make_particles<double>(*make_icosphere(1, 1.0), {2, 0, 0}, {-4, 0, 0}));
  rig.soft[0].body.collision.soft = SoftCollision::none;
  rig.run(1.0);
  for (const Vec3d& v : rig.soft[0].v) EXPECT_EQ(v, Vec3d(4, 0, 0));
}

}  // namespace
}  // namespace pneuma::physics
