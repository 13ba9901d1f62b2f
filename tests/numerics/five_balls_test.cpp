// Shows that the built-in five-balls (the paper's Fig. 1: 162 vertices and 320 faces each, in a rotating room) live on
// for ten minutes: none leaves the room, loses its shape or is stopped.
#include "numerics/worlds.h"
#include "scene_io/load.h"
#include "scene_io/translate.h"

namespace pneuma::physics {
namespace {

/// How far the body's furthest vertex is outside the room.
double outside_m(const World& world, std::size_t body) {
  const ColliderState& room = world.colliders()[0];
  const Vec3d half_m = std::get<RoomShape>(room.collider.shape).half_extents_m;
  double outside = -half_m.maxCoeff();
  for (const Vec3d& x : positions_of(world, body)) {
    const Vec3d local = room.orientation.conjugate() * (x - room.position);
    outside = std::max(outside, (local.cwiseAbs() - half_m).maxCoeff());
  }
  return outside;
}

TEST(FiveBalls, StayWholeInTheRotatingRoomForTenMinutes) {
  const base::Result<v1::Scene> built_in = scene_io::builtin_scene("five-balls");
  ASSERT_TRUE(built_in.ok()) << built_in.status().message();
  const base::Result<Scene> scene = scene_io::to_physics(*built_in);
  ASSERT_TRUE(scene.ok()) << scene.status().message();
  World world = make_world(*scene);
  ASSERT_EQ(world.soft_body_count(), 5U);
  ASSERT_EQ(world.soft_body(0).mesh->positions_m.size(), 162U);
  const double start_m3 = world.measure(0).volume_m3;
  Workers workers(1);
  for (int second = 1; second <= 600; ++second) {
    for (int tick = 0; tick < 60; ++tick) world.step_tick(workers);
    for (std::size_t i = 0; i < 5; ++i) {
      const BodyMeasures sums = world.measure(i);
      ASSERT_FALSE(world.is_frozen(i)) << "ball " << i << " at " << second << " s";
      ASSERT_LT(outside_m(world, i), 0.01) << "ball " << i << " at " << second << " s";
      ASSERT_GT(sums.volume_m3, 0.7 * start_m3) << "ball " << i << " at " << second << " s";
      ASSERT_LT(sums.volume_m3, 1.5 * start_m3) << "ball " << i << " at " << second << " s";
      ASSERT_LT(sums.max_speed_m_s, 30.0) << "ball " << i << " at " << second << " s";
    }
  }
  EXPECT_NEAR(world.time_s(), 600.0, 1e-9);
}

}  // namespace
}  // namespace pneuma::physics
