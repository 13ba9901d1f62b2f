// Shows that rays and points find the surfaces of a world: those of trees are those of all faces, each shape is met
// where its own distance says, and what is found names the body, its face and its outside.
#include "physics/queries.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

#include "physics/mesh/mesh_tree.h"
#include "unit/physics/lively_world.h"
#include "unit/physics/mesh/convex_meshes.h"

namespace pneuma::physics {
namespace {

class Draws {
 public:
  double number(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vec3d vector(double extent) {
    const double x = number(-extent, extent);
    const double y = number(-extent, extent);
    return {x, y, number(-extent, extent)};
  }

 private:
  std::mt19937_64 engine_{11};
};

TEST(FaceTree, FindsWhatALookAtEveryFaceFinds) {
  Draws random;
  for (const MeshPtr& mesh : {*make_icosphere(2, 1.0), *make_box({0.5, 1.0, 0.7}, 3), *make_grid(7, 5, 1.5, 1.0)}) {
    std::vector<Vec3d> positions_m = mesh->positions_m;
    for (Vec3d& position : positions_m) position += random.vector(0.05);
    const FacesAt surface{positions_m, mesh->faces};
    const FaceTree tree = make_face_tree(surface);
    const FaceTree flat = one_leaf(surface);
    std::size_t met = 0;
    for (int i = 0; i < 500; ++i) {
      const Vec3d origin = random.vector(2.0);
      const Ray ray{origin, random.vector(0.8) - origin};
      const auto wanted = first_hit(positions_m, mesh->faces, ray);
      for (const FaceTree* each : {&tree, &flat}) {
        const auto found = first_hit_in(*each, surface, ray);
        ASSERT_EQ(found.has_value(), wanted.has_value());
        if (!found) continue;
        ++met;
        EXPECT_EQ(found->face, wanted->face);
        EXPECT_EQ(found->distance_m, wanted->distance_m);
      }
      const Vec3d point = random.vector(2.0);
      const double nearest_m = nearest_surface_point(positions_m, mesh->faces, point).distance_m;
      EXPECT_NEAR(nearest_in(tree, surface, point).distance_m, nearest_m, 1e-8 * nearest_m);
      EXPECT_EQ(nearest_in(tree, surface, point).face, nearest_in(flat, surface, point).face);
    }
    EXPECT_GT(met, 100U);
  }
}

// A ray along the side of a box must not slip between it and what is in it.
TEST(FaceTree, ARayInTheBordersOfItsBoxesMeetsWhatLiesThere) {
  const MeshPtr mesh = *make_box({0.1, 0.3, 0.7}, 4);
  const FacesAt surface{mesh->positions_m, mesh->faces};
  const FaceTree tree = make_face_tree(surface);
  for (const Vec3d& corner : mesh->positions_m) {
    for (int axis = 0; axis < 3; ++axis) {
      const Ray ray{corner - 3.0 * Vec3d::Unit(axis), Vec3d::Unit(axis)};
      EXPECT_EQ(first_hit_in(tree, surface, ray).has_value(),
                first_hit(mesh->positions_m, mesh->faces, ray).has_value());
    }
  }
}

std::vector<Shape> every_shape() {
  ConvexShape convex{"octahedron", octahedron(0.8), nullptr};
  convex.solid = filled(*convex.mesh);
  return {PlaneShape{Vec3d(1.0, 2.0, -0.5).normalized()},
          SphereShape{0.6},
          BoxShape{Vec3d(0.3, 0.5, 0.8)},
          EllipsoidShape{Vec3d(0.9, 0.4, 0.6)},
          CapsuleShape{0.3, 0.5},
          RoomShape{Vec3d(1.2, 0.9, 1.0)},
          MeshShape{"ball", *make_icosphere(1, 0.7)},
          convex};
}

// Walks along the ray: its way ends where the distance is 0, and until there it is on one side.
TEST(SurfaceHit, IsWhereTheDistanceOfTheShapeFirstIsNone) {
  Draws random;
  for (const Shape& shape : every_shape()) {
    const bool has_sides = !std::holds_alternative<MeshShape>(shape);
    std::size_t met = 0;
    for (int i = 0; i < 200; ++i) {
      const Vec3d origin = random.vector(1.5);
      const Ray ray{origin, 3.0 * (random.vector(0.5) - origin)};
      const auto hit_m = surface_hit_m(shape, ray);
      const Vec3d direction = ray.direction.normalized();
      const double end_m = hit_m.value_or(20.0);
      const double sign = surface_distance(shape, ray.origin_m) < 0.0 ? -1.0 : 1.0;
      if (hit_m) {
        ++met;
        EXPECT_NEAR(surface_distance(shape, ray.origin_m + *hit_m * direction), 0.0, 1e-10) << shape.index();
      }
      for (int k = 1; k < 100; ++k) {
        const double distance_m = surface_distance(shape, ray.origin_m + 0.01 * k * end_m * direction);
        if (has_sides) {
          EXPECT_GE(sign * distance_m, -1e-9) << shape.index();
        }
        if (!has_sides) {
          EXPECT_GT(distance_m, 0.0);
        }
      }
    }
    EXPECT_GT(met, 20U) << shape.index();
    EXPECT_FALSE(surface_hit_m(shape, {Vec3d(0.1, 0.2, 0.1), Vec3d::Zero()}).has_value()) << "no direction";
  }
}

/// The lively scene with a mesh among its colliders.
Scene queried_scene() {
  Scene scene = lively_scene();
  Collider wedge;
  wedge.name = "wedge";
  wedge.shape = MeshShape{"wedge", octahedron(0.6)};
  wedge.position = {2.0, -1.0, 0.5};
  wedge.orientation = Quatd(0.8, 0.6, 0.0, 0.0);
  scene.colliders.push_back(wedge);
  return scene;
}

TEST(SurfaceQueries, TheFirstOfAllSurfacesIsMet) {
  World world = make(queried_scene());
  run(world, 20);
  SurfaceQueries all(world, all_bodies(world));
  Draws random;
  std::set<std::string> met;
  for (int i = 0; i < 2'000; ++i) {
    const Ray ray{random.vector(2.5), random.vector(1.0)};
    const auto first = all.first_hit(ray);
    ASSERT_TRUE(first.has_value()) << "the room is all about";
    met.insert(name_of(world, first->body));
    const Vec3d direction = ray.direction.normalized();
    EXPECT_LT((first->position - (ray.origin_m + first->distance_m * direction)).norm(), 1e-9);
    EXPECT_NEAR(first->normal.norm(), 1.0, 1e-12);
    EXPECT_EQ(first->on_face.has_value(), first->body.kind == BodyKind::soft);
    for (const BodyRef body : all_bodies(world)) {
      SurfaceQueries one(world, {body});
      const auto of_one = one.first_hit(ray);
      if (of_one) {
        EXPECT_GE(of_one->distance_m, first->distance_m);
      }
      if (body == first->body) {
        EXPECT_EQ(of_one->distance_m, first->distance_m);
      }
    }
    EXPECT_FALSE(all.first_hit(ray, 0.999 * first->distance_m).has_value());
    EXPECT_TRUE(all.first_hit(ray, 1.001 * first->distance_m).has_value());
  }
  EXPECT_EQ(met, (std::set<std::string>{"a", "b", "stone", "room", "wedge"}));
}

TEST(SurfaceQueries, ThePlaceOnAFaceIsThatOfItsWeights) {
  World world = make(queried_scene());
  run(world, 20);
  const std::vector<double> x_m = positions(world, 0);
  SurfaceQueries skin(world, {{BodyKind::soft, 0}});
  const Vec3d centre = world.measure(0).centre_of_mass;
  Draws random;
  for (int i = 0; i < 50; ++i) {
    const auto met = skin.first_hit({centre + 3.0 * random.vector(1.0).normalized(), Vec3d::Zero()});
    EXPECT_FALSE(met.has_value());
    const Vec3d out = random.vector(1.0).normalized();
    const auto hit = skin.first_hit({centre + 3.0 * out, -out});
    ASSERT_TRUE(hit && hit->on_face);
    EXPECT_GT(hit->normal.dot(out), 0.0) << "outwards";
    const Face& face = world.soft_body(0).mesh->faces[hit->on_face->face];
    Vec3d place = Vec3d::Zero();
    for (int k = 0; k < 3; ++k) {
      place += hit->on_face->barycentric[k] * Vec3d::Map(&x_m[std::size_t{3} * face[static_cast<std::size_t>(k)]]);
    }
    EXPECT_LT((place - hit->position).norm(), 1e-12);
  }
}

TEST(SurfaceQueries, TheNearestPlaceIsOnTheSurfaceAndKnowsInsideFromOutside) {
  World world = make(queried_scene());
  run(world, 20);
  SurfaceQueries all(world, all_bodies(world));
  const Vec3d centre = world.measure(0).centre_of_mass;
  SurfaceQueries skin(world, {{BodyKind::soft, 0}});
  const auto inside = skin.nearest(centre);
  ASSERT_TRUE(inside.has_value());
  EXPECT_LT(inside->distance_m, -0.2);
  Draws random;
  for (int i = 0; i < 100; ++i) {
    const Vec3d point = random.vector(2.5);
    const auto nearest = all.nearest(point);
    ASSERT_TRUE(nearest.has_value());
    EXPECT_NEAR((nearest->position - point).norm(), std::abs(nearest->distance_m), 1e-9);
    const double side = nearest->normal.dot(point - nearest->position);
    EXPECT_GE(nearest->distance_m * side, -1e-12) << "behind its outside where it is negative";
    for (const BodyRef body : all_bodies(world)) {
      SurfaceQueries one(world, {body});
      EXPECT_GE(std::abs(one.nearest(point)->distance_m), std::abs(nearest->distance_m) - 1e-12);
    }
    EXPECT_FALSE(all.nearest(point, 0.999 * std::abs(nearest->distance_m)).has_value());
  }
}

// The tree that later questions are answered by gives what the first ones got.
TEST(SurfaceQueries, HoweverManyAreAskedEachIsAnsweredAlike) {
  World world = make(queried_scene());
  run(world, 5);
  Draws random;
  std::vector<Ray> rays;
  for (int i = 0; i < 100; ++i) rays.push_back({random.vector(2.5), random.vector(1.0)});
  SurfaceQueries many(world, all_bodies(world));
  for (const Ray& ray : rays) {
    SurfaceQueries fresh(world, all_bodies(world));
    const auto a = many.first_hit(ray);
    const auto b = fresh.first_hit(ray);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    EXPECT_EQ(a->body, b->body);
    EXPECT_EQ(a->position, b->position);
  }
}

TEST(BodyBox, IsTheLeastAboutABody) {
  World world = make(queried_scene());
  run(world, 20);
  const FaceTree::Box stone = box_about(world, {BodyKind::rigid, 0});
  const Vec3d at = world.rigid_bodies()[0].position;
  EXPECT_LT((stone.low_m - (at - Vec3d::Constant(0.3))).norm(), 1e-12);
  EXPECT_LT((stone.high_m - (at + Vec3d::Constant(0.3))).norm(), 1e-12);
  const std::vector<double> x_m = positions(world, 1);
  const FaceTree::Box ball = box_about(world, {BodyKind::soft, 1});
  for (int axis = 0; axis < 3; ++axis) {
    double low_m = x_m[static_cast<std::size_t>(axis)];
    for (std::size_t i = static_cast<std::size_t>(axis); i < x_m.size(); i += 3) low_m = std::min(low_m, x_m[i]);
    EXPECT_EQ(ball.low_m[axis], low_m);
  }
}

TEST(BodyNames, AreFoundAmongAllKinds) {
  const World world = make(queried_scene());
  for (const BodyRef body : all_bodies(world)) EXPECT_EQ(find_body(world, name_of(world, body)), body);
  EXPECT_EQ(find_body(world, "wedge"), (BodyRef{BodyKind::collider, 1}));
  EXPECT_FALSE(find_body(world, "nobody").has_value());
}

}  // namespace
}  // namespace pneuma::physics
