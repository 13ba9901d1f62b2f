// Shows what is left of contact by vertices under the limit of the energy that a body had: all of it where it costs
// nothing, next to none where springs are far too stiff for the step, and then the closed form of a rigid body's hit.
#include "physics/contact/contact_limit.h"

#include <cmath>

#include <gtest/gtest.h>

#include "physics/forces/measures.h"
#include "physics/forces/soft_setup.h"
#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

constexpr double dt_s = 1.0 / 60.0;
constexpr double speed_m_s = 6.0;
constexpr double depth_m = 0.05;

/// A ball of 1 kg that flew down by a step, and contact that stops its lowest vertices there, one by one.
struct WallHit {
  explicit WallHit(double stiffness_n_m, double restitution = 0.0) {
    SoftBody body;
    body.name = "ball";
    body.mesh = *make_icosphere(2, 0.5);
    body.springs.stiffness_n_m = stiffness_n_m;
    state = make_soft_state<double>(body);
    start.assign(state.x.size(), {0.0, -speed_m_s, 0.0});
    state.v = start;
    state.dr.assign(state.x.size(), {0.0, -dt_s * speed_m_s, 0.0});
    limit.begin_substep({}, 0.0, dt_s);
    limit.begin(state, start);
    for (std::uint32_t i = 0; i < state.x.size(); ++i) {
      if (state.x[i].y() > -0.5 + 1e-9) continue;
      limit.note({.vertex = i, .normal = Vec3d::UnitY(), .depth_m = depth_m, .surface = {.restitution = restitution}});
      state.v[i].y() = restitution * speed_m_s;
      state.dr[i].y() += depth_m;
      ++touched;
    }
  }
  [[nodiscard]] double energy_j() const {
    std::vector<Vec3d> end = state.x;
    double squares = 0.0;
    for (std::size_t i = 0; i < end.size(); ++i) {
      end[i] += state.dr[i];
      squares += state.v[i].squaredNorm();
    }
    return potential_j(state, end, 0.0, Vec3d::Zero()) + 0.5 * state.vertex_mass_kg * squares;
  }
  [[nodiscard]] Vec3d momentum() const {
    Vec3d sum = Vec3d::Zero();
    for (const Vec3d& v : state.v) sum += state.vertex_mass_kg * v;
    return sum;
  }

  SoftState<double> state;
  std::vector<Vec3d> start;
  EnergyLimit energy;
  ContactLimit<double> limit;
  int touched = 0;
};

TEST(ContactLimit, LeavesWhatAddsNoEnergyAsItIs) {
  WallHit hit(1.0);
  ASSERT_GT(hit.touched, 0);
  const std::vector<Vec3d> v = hit.state.v;
  const std::vector<Vec3d> dr = hit.state.dr;
  (void)hit.limit.end(hit.state, {}, 0.0, hit.energy);
  EXPECT_EQ(hit.state.v, v);
  EXPECT_EQ(hit.state.dr, dr);
}

TEST(ContactLimit, HoldsTheBodyToWhatItHad) {
  for (const double stiffness_n_m : {1e6, 1e7, 1e9}) {
    for (const double restitution : {0.0, 0.5, 1.0}) {
      WallHit hit(stiffness_n_m, restitution);
      const double had_j = 0.5 * speed_m_s * speed_m_s;
      ASSERT_GT(hit.energy_j(), 1.2 * had_j);
      (void)hit.limit.end(hit.state, {}, 0.0, hit.energy);
      EXPECT_LE(hit.energy_j(), (1.0 + 1e-12) * had_j) << stiffness_n_m << " " << restitution;
    }
  }
}

TEST(ContactLimit, HoldsSoManyTouchesOfABodyAndNoMore) {
  WallHit hit(1e9);
  const auto note = [&](std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) hit.limit.note({});
  };
  note(touches_a_vertex_max * hit.state.x.size());
  const std::size_t full = hit.limit.bytes();
  note(10 * touches_a_vertex_max * hit.state.x.size());
  EXPECT_EQ(hit.limit.bytes(), full);
}

TEST(ContactLimit, SpringsFarTooStiffMakeItARigidBodysHit) {
  for (const double restitution : {0.0, 0.5, 1.0}) {
    WallHit hit(1e12, restitution);
    const Exchange got = hit.limit.end(hit.state, {}, 0.0, hit.energy);
    for (std::size_t i = 0; i < hit.state.x.size(); ++i) {
      EXPECT_NEAR(hit.state.v[i].y(), restitution * speed_m_s, 0.02 * speed_m_s) << restitution;
      EXPECT_NEAR(hit.state.dr[i].y(), depth_m - dt_s * speed_m_s, 1e-4) << restitution;
    }
    EXPECT_NEAR(got.impulse_n_s.y(), (1.0 + restitution) * speed_m_s, 0.02 * speed_m_s);
  }
}

TEST(ContactLimit, CountsWhatThePartnerGetsAndKeepsTheMomentumOfBoth) {
  for (const double mass_kg : {0.1, 1.0, 10.0}) {
    for (const double restitution : {0.0, 0.5, 1.0}) {
      WallHit hit(1e6, restitution);
      RigidPart other;
      other.mass_kg = mass_kg;
      other.centre = {0.1, -1.0, 0.0};
      other.velocity = {0.3, 1.0, 0.0};
      other.inverse_inertia_1_kg_m2 = 10.0 / mass_kg * Eigen::Matrix3d::Identity();
      const double had_j = 0.5 * speed_m_s * speed_m_s;
      const Vec3d before(0.0, -speed_m_s, 0.0);
      const Exchange got = hit.limit.end(hit.state, {.rigid = other, .parts = true}, 0.0, hit.energy);
      EXPECT_NEAR((hit.momentum() - before - got.impulse_n_s).norm(), 0.0, 1e-12);

      const Vec3d velocity = other.velocity - got.impulse_n_s / mass_kg;
      const Vec3d turning = -(other.inverse_inertia_1_kg_m2 * got.moment_n_m_s);
      const double gain_j = 0.5 * mass_kg * (velocity.squaredNorm() - other.velocity.squaredNorm()) +
                            0.5 * mass_kg / 10.0 * turning.squaredNorm();
      EXPECT_NEAR(hit.limit.given_j(), gain_j, 1e-9);
      EXPECT_LE(hit.energy_j() + gain_j, (1.0 + 1e-12) * had_j) << mass_kg << " " << restitution;
    }
  }
}

TEST(ContactLimit, ABodyThatStretchedInAStepKeepsItsMotionAndAsMuchOfItsShapeAsItCanAfford) {
  WallHit hit(1e6);
  const Vec3d momentum(0.0, -speed_m_s, 0.0);
  hit.state.v = hit.start;
  hit.state.dr.assign(hit.state.x.size(), {0.0, -dt_s * speed_m_s, 0.0});
  for (std::size_t i = 0; i < hit.state.x.size(); ++i) {
    const Vec3d outwards = 0.1 * hit.state.x[i];  // sums to nothing
    hit.state.dr[i] += outwards;
    hit.state.v[i] += outwards / dt_s;
  }
  ASSERT_GT(hit.energy_j(), 1000.0);
  hit.limit.limit_step(hit.state, hit.start);
  EXPECT_LE(hit.energy_j(), (1.0 + 1e-12) * 0.5 * speed_m_s * speed_m_s);
  EXPECT_NEAR((hit.momentum() - momentum).norm(), 0.0, 1e-12);
}

}  // namespace
}  // namespace pneuma::physics
