// Shows that the mechanics that a stream tells of a body are the body's own: from where its vertices are and as fast as
// they move, they lead to where the simulation has them a tick later, in every built-in scene whose bodies have any.
#include "app/mechanics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "support/recording.h"

namespace pneuma {
namespace {

constexpr double frame_s = 1.0 / 60.0;
constexpr double step_m = 1e-4;

/// A body's vertices and velocities as the prediction takes them.
struct Observed {
  codec::Lattice points;
  std::vector<codec::Lanes> velocities;
};

Observed observe(const physics::World& world, std::size_t body, const codec::MeshOrder& order) {
  std::vector<double> at_m(3 * order.size());
  std::vector<double> speed_m_s(at_m.size());
  world.copy_positions(body, at_m);
  world.copy_velocities(body, speed_m_s);
  Observed seen{codec::Lattice(at_m.size()), std::vector<codec::Lanes>(order.size())};
  for (std::size_t i = 0; i < at_m.size(); ++i) {
    const std::size_t from = 3 * std::size_t{order.vertices[i / 3]} + i % 3;
    seen.points[i] = std::llround(at_m[from] / step_m);
    const long long eighths = std::llround(speed_m_s[from] * frame_s / (step_m * codec::velocity_unit));
    seen.velocities[i / 3].v[i % 3] = static_cast<std::uint32_t>(eighths);
  }
  return seen;
}

/// Of a body alone.
std::optional<codec::Mechanics> mechanics_of(const physics::World& world, std::size_t body,
                                             const codec::MeshOrder& order) {
  app::MechanicsTerms terms{.frame_s = frame_s, .grid_step_m = step_m, .work_left = app::offered_work_max};
  return app::mechanics_of(world, body, order, terms);
}

/// How far the vertices move in the next tick, and how far that is off: the root of the mean square, in grid steps.
struct Prediction {
  double moved = 0.0;  // against their mean
  double off = 0.0;
};

/// What is changed in a body's mechanics before it is predicted by them.
using Change = std::function<void(codec::Mechanics&)>;

Prediction next_tick(physics::World& world, std::size_t body, const Change& change) {
  const auto order = support::order_of(*world.soft_body(body).mesh);
  auto mechanics = mechanics_of(world, body, *order);
  if (!mechanics) throw std::runtime_error("the body has no mechanics");
  change(*mechanics);
  codec::SimulatedMotion motion(order, support::indices_of(*world.soft_body(body).mesh), *mechanics, step_m);
  const Observed before = observe(world, body, *order);
  std::vector<codec::Lanes> drift;
  motion.predict(before.points, before.velocities, drift);
  physics::Workers one_thread(1);
  world.step_tick(one_thread);
  const Observed after = observe(world, body, *order);
  const auto moved_by = [&](std::size_t i) { return static_cast<double>(after.points[i] - before.points[i]); };
  const auto vertices = static_cast<double>(order->size());
  std::array<double, 3> mean{};
  for (std::size_t i = 0; i < before.points.size(); ++i) mean[i % 3] += moved_by(i) / vertices;
  Prediction sums;
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    const double moved = moved_by(i) - mean[i % 3];
    const double off = moved_by(i) - static_cast<double>(static_cast<std::int32_t>(drift[i / 3].v[i % 3])) / 16.0;
    sums.moved += moved * moved;
    sums.off += off * off;
  }
  return {std::sqrt(sums.moved / vertices), std::sqrt(sums.off / vertices)};
}

constexpr double rounding = 0.75;       // of points and moves: each is off by half a step at most
constexpr double share_of_move = 0.05;  // what the fewer substeps of a prediction miss

double bound(const Prediction& prediction) {
  return rounding + share_of_move * prediction.moved;
}

/// The scene with these changes, stepped as closely as mechanics foresee it, or more so.
physics::World closely_stepped(const std::string& scene, const std::vector<std::string>& assignments) {
  std::vector<std::string> all{"stepping.integrator=MIDPOINT", "stepping.substeps=16", "stepping.on_unstable=SUBSTEP"};
  all.insert(all.end(), assignments.begin(), assignments.end());
  return support::world_of(scene, all);
}

/// By how much the prediction of the first body is past its bound, at most, with what is changed in its mechanics.
double past_bound(const std::vector<std::string>& assignments, const Change& change) {
  physics::World world = closely_stepped("bouncing-ball", assignments);
  double past = -rounding;
  for (int tick = 0; tick < 5; ++tick) {
    const Prediction prediction = next_tick(world, 0, change);
    past = std::max(past, prediction.off - bound(prediction));
  }
  return past;
}

/// Of the bodies that have mechanics; false where none has.
bool expect_predicted(const std::string& scene, const std::vector<std::string>& assignments = {}) {
  physics::World world = closely_stepped(scene, assignments);
  bool any = false;
  for (std::size_t body = 0; body < world.soft_body_count(); ++body) {
    const auto order = support::order_of(*world.soft_body(body).mesh);
    if (!mechanics_of(world, body, *order)) continue;
    any = true;
    for (int tick = 0; tick < 5; ++tick) {
      const Prediction prediction = next_tick(world, body, [](codec::Mechanics&) {});
      EXPECT_LE(prediction.off, bound(prediction))
          << scene << ", body " << body << ", tick " << tick << ", moved " << prediction.moved;
    }
  }
  return any;
}

TEST(MechanicsOfBuiltInScene, LeadWhereTheBodiesGo) {
  std::vector<std::string> predicted;
  // Bodies of these touch or are held from the first tick on, which no mechanics know.
  const std::set<std::string> held{"ball-pit", "hero", "rope-and-balloons"};
  for (const std::string& scene : scene_io::builtin_scene_names()) {
    if (!held.contains(scene) && expect_predicted(scene)) predicted.push_back(scene);
  }
  // The hand's springs would take too many substeps, and the cloth is in the wind; of the others the gas flows or the
  // steps are implicit.
  EXPECT_EQ(predicted, (std::vector<std::string>{"bouncing-ball", "cost-curve", "five-balls", "five-balls-paper",
                                                 "hanging-ball"}));
}

TEST(Mechanics, KnowAnyGasMassesSpringsAndPlanes) {
  EXPECT_TRUE(expect_predicted("bouncing-ball", {"soft_bodies[0].gas.law=ADIABATIC", "atmosphere.pressure_pa=60"}));
  EXPECT_TRUE(expect_predicted("bouncing-ball", {"soft_bodies[0].velocity.y=-3", "soft_bodies[0].position.y=0.7",
                                                 "soft_bodies[0].surface.thickness_m=0.1"}))
      << "it hits the floor";
  EXPECT_TRUE(expect_predicted("bouncing-ball", {"soft_bodies[0].gas.moles=0", "soft_bodies[0].pins=[3,8]"}));
  std::string scales = "1";
  for (int vertex = 1; vertex < 162; ++vertex) scales += vertex % 3 == 0 ? ",1.5" : ",0.75";
  EXPECT_TRUE(expect_predicted("bouncing-ball", {"soft_bodies[0].springs.vertex_stiffness_scale=[" + scales + "]",
                                                 "soft_bodies[0].vertex_mass_scale=[" + scales + "]"}));
}

TEST(Mechanics, AreAllNeededToPredict) {
  const Change nothing = [](codec::Mechanics&) {};
  const std::vector<std::string> adiabatic{"soft_bodies[0].gas.law=ADIABATIC", "soft_bodies[0].springs.rest_scale=0.8"};
  EXPECT_LE(past_bound(adiabatic, nothing), 0.0);
  EXPECT_GT(past_bound(adiabatic, [](codec::Mechanics& m) { m.gas.exponent_65536ths = 65536; }), 0.0);
  EXPECT_GT(past_bound(adiabatic, [](codec::Mechanics& m) { m.gas.pressure_pa = 0.0; }), 0.0);
  EXPECT_GT(past_bound(adiabatic, [](codec::Mechanics& m) { m.gravity_m_s2 = {}; }), 0.0);
  std::vector<std::string> damped = adiabatic;
  damped.push_back("soft_bodies[0].springs.damping_n_s_m=0.15");
  EXPECT_LE(past_bound(damped, nothing), 0.0);
  EXPECT_GT(past_bound(damped, [](codec::Mechanics& m) { m.damping_n_s_m = 0.0; }), 0.0);
  std::string scales = "1";
  for (int vertex = 1; vertex < 162; ++vertex) scales += vertex % 3 == 0 ? ",1.5" : ",0.75";
  std::vector<std::string> scaled = adiabatic;
  scaled.push_back("soft_bodies[0].springs.vertex_stiffness_scale=[" + scales + "]");
  EXPECT_LE(past_bound(scaled, nothing), 0.0);
  EXPECT_GT(past_bound(scaled, [](codec::Mechanics& m) { m.stiffnesses_n_m = {m.stiffnesses_n_m[0]}; }), 0.0);
}

TEST(Mechanics, AreNotToldWhereOtherForcesMoveTheBody) {
  EXPECT_FALSE(
      expect_predicted("bouncing-ball", {"soft_bodies[0].springs.bend_stiffness_n_m=0.1", "stepping.substeps=0"}));
  EXPECT_FALSE(expect_predicted("bouncing-ball", {"soft_bodies[0].gas.flow_mol_s=0.001"}));
  EXPECT_FALSE(expect_predicted("bouncing-ball", {"soft_bodies[0].drag.normal=1", "atmosphere.density_kg_m3=1.2"}));
  EXPECT_FALSE(expect_predicted("bouncing-ball", {"soft_bodies[0].volume.method=BOX"}));
  EXPECT_FALSE(expect_predicted("bouncing-ball", {"soft_bodies[0].pressure_spread=VERTEX_NORMALS"}));
  EXPECT_FALSE(expect_predicted("bouncing-ball", {"stepping.integrator=XPBD"}));
  EXPECT_FALSE(
      expect_predicted("bouncing-ball", {"soft_bodies[0].springs.stiffness_n_m=20000", "stepping.substeps=0"}));
}

}  // namespace
}  // namespace pneuma
