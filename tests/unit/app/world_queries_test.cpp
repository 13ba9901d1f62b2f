// Shows that rays, points and boxes are answered one for one, and that what cannot be is refused by the field's name.
#include "app/world_queries.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "base/limits.h"
#include "unit/physics/lively_world.h"

namespace pneuma::app {
namespace {

using base::StatusCode;

physics::World lively() {
  return physics::make(physics::lively_scene());
}

v1::Raycast downwards(std::initializer_list<double> xs) {
  v1::Raycast request;
  for (const double x : xs) {
    v1::Raycast::Ray& ray = *request.add_rays();
    ray.mutable_origin()->set_x(x);
    ray.mutable_origin()->set_y(2.9);
    ray.mutable_direction()->set_y(-0.5);
  }
  return request;
}

TEST(Raycast, HasAnAnswerForEachRayInOrder) {
  const physics::World world = lively();
  v1::Raycast request = downwards({-1.0, 0.0, -2.5});
  request.mutable_rays(2)->set_length_m(1.0);
  const auto reply = cast_rays(world, request);
  ASSERT_TRUE(reply.ok()) << reply.status().message();
  ASSERT_EQ(reply->points_size(), 3);
  EXPECT_EQ(reply->points(0).body(), "stone");
  EXPECT_NEAR(reply->points(0).distance_m(), 0.6, 1e-12);
  EXPECT_NEAR(reply->points(0).position().y(), 2.3, 1e-12);
  EXPECT_NEAR(reply->points(0).normal().y(), 1.0, 1e-12);
  EXPECT_FALSE(reply->points(0).has_face());
  EXPECT_EQ(reply->points(1).body(), "a");
  EXPECT_TRUE(reply->points(1).has_face());
  const v1::Vec3& weights = reply->points(1).weights();
  EXPECT_NEAR(weights.x() + weights.y() + weights.z(), 1.0, 1e-12);
  EXPECT_TRUE(reply->points(2).body().empty()) << "the floor of the room is further";
  EXPECT_FALSE(reply->points(2).has_position());
}

TEST(Raycast, LooksAtThoseThatAreNamed) {
  v1::Raycast request = downwards({-1.0});
  request.add_bodies("room");
  EXPECT_EQ(cast_rays(lively(), request)->points(0).body(), "room");
}

TEST(Raycast, RefusesByName) {
  const physics::World world = lively();
  v1::Raycast no_way = downwards({0.0, 0.0});
  no_way.mutable_rays(1)->clear_direction();
  EXPECT_EQ(cast_rays(world, no_way).status().where(), "raycast.rays[1].direction");
  v1::Raycast far = downwards({0.0});
  far.mutable_rays(0)->mutable_origin()->set_z(std::nan(""));
  EXPECT_EQ(cast_rays(world, far).status().where(), "raycast.rays[0].origin.z");
  v1::Raycast back = downwards({0.0});
  back.mutable_rays(0)->set_length_m(-1.0);
  EXPECT_EQ(cast_rays(world, back).status().where(), "raycast.rays[0].length_m");
  v1::Raycast nobody = downwards({0.0});
  nobody.add_bodies("a");
  nobody.add_bodies("nobody");
  EXPECT_EQ(cast_rays(world, nobody).status().code(), StatusCode::not_found);
  EXPECT_EQ(cast_rays(world, nobody).status().where(), "raycast.bodies[1]");
  v1::Raycast many = downwards({0.0});
  for (std::size_t i = 0; i < base::query_points_max; ++i) *many.add_rays() = many.rays(0);
  EXPECT_EQ(cast_rays(world, many).status().code(), StatusCode::limit_exceeded);
  many.mutable_rays()->RemoveLast();
  EXPECT_EQ(static_cast<std::size_t>(cast_rays(world, many)->points_size()), base::query_points_max);
}

TEST(Raycast, ABodyIsNamedOnce) {
  v1::Raycast request = downwards({0.0});
  for (int i = 0; i < 2; ++i) request.add_bodies("a");
  EXPECT_EQ(cast_rays(lively(), request).status().where(), "raycast.bodies[1]");
}

TEST(Raycast, TakesADirectionOfAnyLength) {
  for (const double length : {1e-300, 1e300}) {
    v1::Raycast request = downwards({-1.0});
    request.mutable_rays(0)->mutable_direction()->set_y(-length);
    EXPECT_EQ(cast_rays(lively(), request)->points(0).body(), "stone");
  }
}

// In the middle of a ball, each point is as near to all of its faces.
TEST(NearestPoint, IsRefusedWhereItLooksAtTooManyFaces) {
  physics::Scene scene;
  scene.soft_bodies = {physics::ball("large")};
  scene.soft_bodies[0].mesh = *physics::make_icosphere(6, 0.5);
  const physics::World world = physics::make(scene);
  v1::NearestPoint request;
  for (int i = 0; i < 20; ++i) request.add_points();
  EXPECT_TRUE(find_nearest(world, request).ok());
  while (request.points_size() < static_cast<int>(base::query_points_max)) request.add_points();
  const base::Status much = find_nearest(world, request).status();
  EXPECT_EQ(much.code(), StatusCode::limit_exceeded);
  EXPECT_EQ(much.where(), "nearest_point.points");
}

TEST(NearestPoint, LooksAtTheFacesOfMeshCollidersToo) {
  physics::Scene scene;
  physics::Collider shell;
  shell.name = "shell";
  shell.shape = physics::MeshShape{"shell", *physics::make_icosphere(6, 0.5)};
  scene.colliders = {shell};
  const physics::World world = physics::make(scene);
  v1::NearestPoint request;
  while (request.points_size() < static_cast<int>(base::query_points_max)) request.add_points();
  EXPECT_EQ(find_nearest(world, request).status().code(), StatusCode::limit_exceeded);
}

TEST(NearestPoint, TellsTheSideAndTheReach) {
  const physics::World world = lively();
  v1::NearestPoint request;
  request.add_points()->set_x(-1.0);
  request.mutable_points(0)->set_y(2.1);
  request.add_points()->set_x(-1.0);
  request.mutable_points(1)->set_y(1.2);
  request.add_bodies("stone");
  request.set_within_m(0.45);
  const auto reply = find_nearest(world, request);
  ASSERT_TRUE(reply.ok());
  EXPECT_NEAR(reply->points(0).distance_m(), -0.2, 1e-12);
  EXPECT_NEAR(reply->points(0).position().y(), 2.3, 1e-12);
  EXPECT_TRUE(reply->points(1).body().empty()) << "half a metre away";
  request.clear_within_m();
  EXPECT_NEAR(find_nearest(world, request)->points(1).distance_m(), 0.5, 1e-12);
  request.set_within_m(std::numeric_limits<double>::infinity());
  EXPECT_EQ(find_nearest(world, request).status().where(), "nearest_point.within_m");
}

TEST(BodiesInBox, AreThoseWhoseBoxesReachIn) {
  const physics::World world = lively();
  v1::BodiesInBox request;
  request.mutable_low()->set_x(-0.8);
  request.mutable_low()->set_y(1.2);
  request.mutable_high()->set_x(0.1);
  request.mutable_high()->set_y(2.5);
  const auto reply = find_bodies(world, request);
  ASSERT_TRUE(reply.ok());
  ASSERT_EQ(reply->boxes_size(), 2);
  EXPECT_EQ(reply->boxes(0).body(), "a");
  EXPECT_EQ(reply->boxes(1).body(), "stone");
  EXPECT_NEAR(reply->boxes(1).low().x(), -1.3, 1e-12);
  EXPECT_NEAR(reply->boxes(1).high().y(), 2.3, 1e-12);
  request.mutable_low()->set_y(3.0);
  EXPECT_EQ(find_bodies(world, request).status().where(), "bodies_in_box.high");
}

}  // namespace
}  // namespace pneuma::app
