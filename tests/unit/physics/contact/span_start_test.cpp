// Shows that the start of a span of contact is put back whole, or not at all.
#include "physics/contact/span_start.h"

#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

/// One body of each kind, in motion.
struct Movers {
  std::vector<SoftState<double>> soft{1};
  std::vector<RigidState> rigid{1};
  std::vector<ColliderState> colliders{1};
  TouchTally touches;

  Movers() {
    soft[0].x = {{0.0, 1.0, 2.0}, {3.0, 4.0, 5.0}};
    soft[0].v = {{0.1, 0.0, 0.0}, {0.0, 0.2, 0.0}};
    soft[0].gas = GasState{.moles = 0.5, .temperature_ref_k = 300.0, .volume_ref_m3 = 1.0};
    soft[0].volume_m3 = 0.9;
    soft[0].pressure_pa = 12.0;
    rigid[0].position = {1.0, 0.0, 0.0};
    rigid[0].velocity = {0.0, -1.0, 0.0};
    rigid[0].angular_velocity = {0.0, 0.0, 3.0};
    colliders[0].position = {0.0, 0.0, 7.0};
    touches.add({BodyKind::soft, 0}, {BodyKind::rigid, 0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0});
  }
  [[nodiscard]] Moving<double> moving(std::size_t events = 0) { return {soft, rigid, colliders, &touches, events}; }
  void go_on() {
    soft[0].x[1] *= 1.5;
    soft[0].v[0] *= -2.0;
    soft[0].gas->moles = 0.4;
    soft[0].volume_m3 = 0.7;
    soft[0].pressure_pa = 19.0;
    soft[0].inverted = true;
    rigid[0].position *= 2.0;
    rigid[0].orientation = Quatd(0.0, 1.0, 0.0, 0.0);
    rigid[0].velocity *= 2.0;
    rigid[0].angular_velocity *= 2.0;
    rigid[0].has_moved = true;
    colliders[0].position *= 2.0;
    colliders[0].orientation = Quatd(0.0, 1.0, 0.0, 0.0);
    touches.add({BodyKind::soft, 0}, {BodyKind::rigid, 0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0});
  }
};

TEST(SpanStart, PutsAllThatMovesBack) {
  Movers movers;
  const Movers before = movers;
  SpanStart<double> start;
  start.keep(movers.moving(), 7);
  EXPECT_EQ(start.substeps_left(), 7U);
  movers.go_on();
  ASSERT_TRUE(start.can_restore(movers.moving()));
  start.restore(movers.moving());
  const SoftState<double>& soft = movers.soft[0];
  EXPECT_EQ(soft.x, before.soft[0].x);
  EXPECT_EQ(soft.v, before.soft[0].v);
  EXPECT_EQ(soft.gas->moles, 0.5);
  EXPECT_EQ(soft.volume_m3, 0.9);
  EXPECT_EQ(soft.pressure_pa, 12.0);
  EXPECT_FALSE(soft.inverted);
  const RigidState& rigid = movers.rigid[0];
  EXPECT_EQ(rigid.position, before.rigid[0].position);
  EXPECT_EQ(rigid.orientation.coeffs(), before.rigid[0].orientation.coeffs());
  EXPECT_EQ(rigid.velocity, before.rigid[0].velocity);
  EXPECT_EQ(rigid.angular_velocity, before.rigid[0].angular_velocity);
  EXPECT_FALSE(rigid.has_moved);
  EXPECT_EQ(movers.colliders[0].position, before.colliders[0].position);
  EXPECT_EQ(movers.colliders[0].orientation.coeffs(), before.colliders[0].orientation.coeffs());
  EXPECT_EQ(movers.touches.touches().front().impulse_n_s, before.touches.touches().front().impulse_n_s);
}

TEST(SpanStart, PutsNothingBackWhereSomethingHappened) {
  Movers movers;
  SpanStart<double> start;
  EXPECT_FALSE(start.can_restore(movers.moving())) << "nothing was kept";
  start.keep(movers.moving(), 7);
  EXPECT_TRUE(start.can_restore(movers.moving()));
  EXPECT_FALSE(start.can_restore(movers.moving(1))) << "a joint broke";
  movers.rigid[0].is_crowded = true;
  EXPECT_FALSE(start.can_restore(movers.moving())) << "a body is crowded";
  movers.rigid[0].is_crowded = false;
  movers.soft[0].rest.asleep = true;
  EXPECT_FALSE(start.can_restore(movers.moving())) << "a body fell asleep";
}

}  // namespace
}  // namespace pneuma::physics
