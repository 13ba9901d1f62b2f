// Shows that a simulated body moves as mechanics have it, by closed forms, and to the bit as the golden vectors do,
// which a script of plain numbers makes; and that no numbers take it out of its bounds.
#include "codec/simulated_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "codec/prediction.h"
#include "support/golden.h"
#include "unit/codec/golden_bodies.h"
#include "unit/codec/meshes.h"

namespace pneuma::codec {
namespace {

constexpr double step_m = 1e-4;
constexpr double frame_s = 1.0 / 64.0;

Mechanics free_mechanics(const MeshOrder& order) {
  const std::size_t edges = spring_edges(order).size();
  Mechanics mechanics;
  mechanics.frame_s = frame_s;
  mechanics.substeps = 4;
  mechanics.masses_kg.assign(order.size(), 0.25F);
  mechanics.rest_lengths_m.assign(edges, 0.1F);
  mechanics.stiffnesses_n_m.assign(edges, 0.0F);
  return mechanics;
}

const Lattice tetrahedron_points{0, 0, 0, 1000, 0, 0, 0, 1000, 0, 0, 0, 1000};

/// The drift of a tetrahedron, slot by slot.
std::vector<Lanes> drift_of(const Mechanics& mechanics, const Lattice& points, const std::vector<Lanes>& velocities) {
  const auto order = order_of(4, tetrahedron);
  EXPECT_TRUE(SimulatedMotion::check(*order, mechanics, step_m).ok());
  SimulatedMotion motion(order, tetrahedron, mechanics, step_m);
  std::vector<Lanes> drift;
  motion.predict(points, velocities, drift);
  return drift;
}

std::int32_t signed_lane(const Lanes& lanes, std::size_t axis) {
  return static_cast<std::int32_t>(lanes.v[axis]);
}

std::vector<Lanes> all_at(std::int32_t x, std::int32_t y, std::int32_t z) {
  Lanes lanes;
  lanes.v = LaneVector{static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), static_cast<std::uint32_t>(z), 0};
  return std::vector<Lanes>(4, lanes);
}

TEST(SimulatedMotion, FallsAsFarAsClosedFormSays) {
  Mechanics mechanics = free_mechanics(*order_of(4, tetrahedron));
  mechanics.gravity_m_s2 = {0.0, -8.0, 0.0};
  // Leapfrog has parabolas exactly: v t + g t^2 / 2, of -8 / 64^2 / 2 m.
  const double fallen = -16.0 * 0.5 * 8.0 * frame_s * frame_s / step_m;
  for (const Lanes& drift : drift_of(mechanics, tetrahedron_points, all_at(80, 0, 0))) {
    EXPECT_EQ(signed_lane(drift, 0), 160);
    EXPECT_EQ(signed_lane(drift, 1), static_cast<std::int32_t>(std::lround(fallen)));
    EXPECT_EQ(signed_lane(drift, 2), 0);
  }
}

TEST(SimulatedMotion, KeepsMomentumUnderSpringsAndGas) {
  Mechanics mechanics = free_mechanics(*order_of(4, tetrahedron));
  std::ranges::fill(mechanics.stiffnesses_n_m, 50.0F);
  mechanics.damping_n_s_m = 0.1;
  mechanics.gas = {1000.0, 1e-4, 65536, 0.0};
  const auto drift = drift_of(mechanics, tetrahedron_points, all_at(0, 0, 0));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    int sum = 0;
    for (const Lanes& lanes : drift) sum += signed_lane(lanes, axis);
    EXPECT_LE(std::abs(sum), 2) << "as much as four roundings make";
    EXPECT_GT(std::abs(signed_lane(drift[axis], axis)) + std::abs(signed_lane(drift[3], axis)), 100) << "it moves";
  }
}

TEST(SimulatedMotion, StaysAtRestWhereSpringsAreAtRest) {
  const auto order = order_of(4, tetrahedron);
  Mechanics mechanics = free_mechanics(*order);
  const auto edges = spring_edges(*order);
  ASSERT_EQ(edges.size(), 6U);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    mechanics.stiffnesses_n_m[i] = 100.0F;
    mechanics.rest_lengths_m[i] = static_cast<float>((edges[i][0] == 0 ? 1000.0 : 1000.0 * std::sqrt(2.0)) * step_m);
  }
  EXPECT_EQ(drift_of(mechanics, tetrahedron_points, all_at(0, 0, 0)), all_at(0, 0, 0));
}

TEST(SimulatedMotion, BouncesByRestitutionAndFriction) {
  Mechanics mechanics = free_mechanics(*order_of(4, tetrahedron));
  mechanics.substeps = 1;
  mechanics.planes = {{{0.0, 1.0, 0.0}, 0.0, 0.5, 0.25}};
  const auto order = order_of(4, tetrahedron);
  SimulatedMotion motion(order, tetrahedron, mechanics, step_m);
  auto velocities = all_at(800, -400, 0);
  std::vector<Lanes> drift;
  motion.predict(tetrahedron_points, velocities, drift);
  for (std::size_t slot = 0; slot < 4; ++slot) {
    const bool is_low = slot != 2;
    EXPECT_EQ(signed_lane(drift[slot], 1), is_low ? 0 : -800) << "no lower than the plane";
    for (std::size_t axis = 0; axis < 3; ++axis) {
      drift[slot].v[axis] = static_cast<std::uint32_t>(signed_lane(drift[slot], axis) >> fraction_bits);
    }
  }
  motion.correct(drift, velocities);
  EXPECT_EQ(signed_lane(velocities[0], 1), 200) << "half of what it came down with";
  EXPECT_EQ(signed_lane(velocities[0], 0), 650) << "less a quarter of the change of 600";
  EXPECT_EQ(signed_lane(velocities[2], 1), -400);
}

TEST(SimulatedMotion, GoesOnAsItDoesWhereNumbersEnd) {
  Mechanics mechanics = free_mechanics(*order_of(4, tetrahedron));
  std::ranges::fill(mechanics.stiffnesses_n_m, std::numeric_limits<float>::max());
  EXPECT_EQ(drift_of(mechanics, tetrahedron_points, all_at(3, -5, 7)), all_at(6, -10, 14));
}

TEST(SimulatedMotion, TakesABodyOfNothing) {
  const auto order = order_of(0, {});
  Mechanics mechanics = free_mechanics(*order);
  mechanics.masses_kg = {1.0F};
  mechanics.planes = {{{0.0, 1.0, 0.0}, 0.0, 0.5, 0.25}};
  ASSERT_TRUE(SimulatedMotion::check(*order, mechanics, step_m).ok());
  SimulatedMotion motion(order, {}, mechanics, step_m);
  std::vector<Lanes> drift(3);
  motion.predict({}, {}, drift);
  EXPECT_TRUE(drift.empty());
}

TEST(SimulatedMotion, TakesEdgesOfNoLength) {
  Mechanics mechanics = free_mechanics(*order_of(4, tetrahedron));
  std::ranges::fill(mechanics.stiffnesses_n_m, 100.0F);
  mechanics.gas = {1000.0, 1e-4, 91750, 0.0};
  EXPECT_EQ(drift_of(mechanics, Lattice(12, 17), all_at(0, 16, 0)), all_at(0, 32, 0));
}

TEST(SimulatedMotion, RefusesMechanicsThatDoNotFit) {
  const auto order = order_of(4, tetrahedron);
  const Mechanics good = free_mechanics(*order);
  ASSERT_TRUE(SimulatedMotion::check(*order, good, step_m).ok());
  const auto refused = [&](auto&& change) {
    Mechanics bad = good;
    change(bad);
    return SimulatedMotion::check(*order, bad, step_m).where();
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused([](Mechanics& m) { m.substeps = simulated_substeps_max + 1; }), "substeps");
  EXPECT_EQ(refused([](Mechanics& m) { m.substeps = 0; }), "substeps");
  EXPECT_EQ(refused([](Mechanics& m) { m.masses_kg.pop_back(); }), "masses_kg");
  EXPECT_EQ(refused([](Mechanics& m) { m.rest_lengths_m[0] = -1.0F; }), "rest_lengths_m");
  EXPECT_EQ(refused([](Mechanics& m) { m.stiffnesses_n_m[0] = std::numeric_limits<float>::infinity(); }),
            "stiffnesses_n_m");
  EXPECT_EQ(refused([nan](Mechanics& m) { m.damping_n_s_m = nan; }), "damping_n_s_m");
  EXPECT_EQ(refused([](Mechanics& m) { m.gas.volume_m3 = 0.0; }), "gas");
  EXPECT_EQ(refused([](Mechanics& m) { m.frame_s = 0.0; }), "frame_s");
  EXPECT_EQ(refused([nan](Mechanics& m) { m.gravity_m_s2[1] = nan; }), "gravity_m_s2");
  EXPECT_EQ(refused([](Mechanics& m) { m.planes = {{{0.0, 1.25, 0.0}}}; }), "planes");
  EXPECT_EQ(refused([nan](Mechanics& m) { m.planes = {{{0.0, 1.0, nan}}}; }), "planes");
  EXPECT_EQ(refused([](Mechanics& m) { m.planes = {{{0.0, 1.0, 0.0}, 1e306}}; }), "planes") << "in steps of the grid";
  EXPECT_EQ(refused([](Mechanics& m) { m.damping_n_s_m = m.frame_s = 1e200; }), "frame_s");
  EXPECT_EQ(refused([](Mechanics& m) { m.gravity_m_s2[2] = -1e308 * (m.frame_s = 1.0); }), "frame_s");
  EXPECT_EQ(refused([](Mechanics& m) { m.gas.volume_m3 = 1e300; }), "frame_s");
  EXPECT_EQ(refused([](Mechanics& m) { m.planes.resize(simulated_planes_max + 1); }), "planes");
}

std::vector<Lanes> lanes_of(const std::vector<std::int64_t>& numbers) {
  std::vector<Lanes> all(numbers.size() / 3);
  for (std::size_t i = 0; i < numbers.size(); ++i) all[i / 3].v[i % 3] = static_cast<std::uint32_t>(numbers[i]);
  return all;
}
std::vector<std::int64_t> numbers_of(const std::vector<Lanes>& lanes) {
  std::vector<std::int64_t> all;
  for (std::size_t i = 0; i < 3 * lanes.size(); ++i) all.push_back(signed_lane(lanes[i / 3], i % 3));
  return all;
}

TEST(SimulatedMotion, IsToTheBitWhatGoldenVectorsHave) {
  const auto records = support::read_golden("simulated_motion.txt");
  ASSERT_GE(records.size(), 7U);
  for (const auto& record : records) {
    SCOPED_TRACE(record[0].second);
    const auto text = [&](const char* key) { return support::values_of(record, key).at(0); };
    const std::vector<GoldenBody> bodies = bodies_of(record);
    ASSERT_EQ(bodies.size(), 1U);
    ASSERT_TRUE(bodies[0].mechanics);
    const double grid_step_m = std::stod(text("grid_step_m"));
    const bool is_good = record[0].first == "body";
    ASSERT_EQ(SimulatedMotion::check(*bodies[0].order, *bodies[0].mechanics, grid_step_m).ok(), is_good);
    if (!is_good) continue;
    const SimulatedMotionPtr simulation = simulation_of(bodies[0], grid_step_m);
    SimulatedMotion& motion = *simulation;
    Lattice points = support::parse_integers(text("points"));
    const auto drifts = support::values_of(record, "drift");
    const auto all_moves = support::values_of(record, "moves");
    const auto all_velocities = support::values_of(record, "velocities");
    std::vector<Lanes> velocities = lanes_of(support::parse_integers(all_velocities.at(0)));
    ASSERT_GE(drifts.size(), 3U);
    for (std::size_t frame = 0; frame < drifts.size(); ++frame) {
      std::vector<Lanes> drift;
      motion.predict(points, velocities, drift);
      ASSERT_EQ(numbers_of(drift), support::parse_integers(drifts[frame])) << frame;
      const auto moves = support::parse_integers(all_moves.at(frame));
      motion.correct(lanes_of(moves), velocities);
      ASSERT_EQ(numbers_of(velocities), support::parse_integers(all_velocities.at(frame + 1))) << frame;
      for (std::size_t i = 0; i < points.size(); ++i) points[i] += moves[i];
    }
  }
}

}  // namespace
}  // namespace pneuma::codec
