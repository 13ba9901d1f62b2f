// Shows that picking finds the nearest surface point, the first hit of a ray and the share of each vertex: against
// points and rays whose answer is known, and against brute force (a dense sampling of every triangle; a walk along the
// ray).
#include "physics/mesh/picking.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <utility>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "physics/mesh/mesh_builders.h"

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

class Random {
 public:
  Vector3d vector(double extent) {
    std::uniform_real_distribution<double> coordinate(-extent, extent);
    const double x = coordinate(engine_);
    const double y = coordinate(engine_);
    return {x, y, coordinate(engine_)};
  }

 private:
  std::mt19937_64 engine_{7};
};

std::shared_ptr<const Mesh> picked_ball() {
  return *make_icosphere(2, 1.0);
}
std::shared_ptr<const Mesh> brick() {
  return *make_box({0.5, 1.0, 2.0}, 3);
}

double distance_to_brick_m(const Vector3d& p) {
  const Vector3d outside = p.cwiseAbs() - Vector3d(0.5, 1.0, 2.0);
  return outside.maxCoeff() > 0.0 ? outside.cwiseMax(0.0).norm() : -outside.maxCoeff();
}

TEST(NearestSurfacePoint, IsAtTheClosedFormDistanceFromABox) {
  const auto mesh = brick();
  Random random;
  for (int i = 0; i < 500; ++i) {
    const Vector3d point = random.vector(3.0);
    const MeshPoint nearest = nearest_surface_point(mesh->positions_m, mesh->faces, point);
    EXPECT_NEAR(nearest.distance_m, distance_to_brick_m(point), 1e-12) << point.transpose();
    EXPECT_NEAR(distance_to_brick_m(nearest.position_m), 0.0, 1e-12);
  }
}

TEST(NearestSurfacePoint, IsNoFurtherThanAnySampleOfASkewTriangle) {
  Random random;
  for (int round = 0; round < 50; ++round) {
    const std::vector<Vector3d> corners{random.vector(1.0), random.vector(1.0), random.vector(1.0)};
    const std::vector<Face> faces{{0, 1, 2}};
    const Vector3d point = random.vector(2.0);
    const MeshPoint nearest = nearest_surface_point(corners, faces, point);
    const int steps = 60;
    double sampled_m = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const Vector3d sample = (i * corners[0] + j * corners[1] + (steps - i - j) * corners[2]) / steps;
        sampled_m = std::min(sampled_m, (sample - point).norm());
      }
    }
    EXPECT_LE(nearest.distance_m, sampled_m + 1e-12);
    EXPECT_GE(nearest.distance_m, sampled_m - 0.06);  // half of the widest sample cell
    EXPECT_NEAR(nearest.barycentric.sum(), 1.0, 1e-12);
    EXPECT_GE(nearest.barycentric.minCoeff(), 0.0);
  }
}

TEST(FirstHit, IsWhereARayFromOutsideEntersABox) {
  const auto mesh = brick();
  Random random;
  int hits = 0;
  for (int i = 0; i < 500; ++i) {
    const Ray ray{random.vector(1.0) + Vector3d(0, 0, 6), random.vector(1.0) - Vector3d(0, 0, 3)};
    const auto hit = first_hit(mesh->positions_m, mesh->faces, ray);
    const auto expected_m = hit_box_m(ray, {0.5, 1.0, 2.0});
    ASSERT_EQ(hit.has_value(), expected_m.has_value());
    if (!hit) continue;
    ++hits;
    EXPECT_NEAR(hit->distance_m, *expected_m, 1e-12);
    EXPECT_NEAR((hit->position_m - (ray.origin_m + hit->distance_m * ray.direction.normalized())).norm(), 0.0, 1e-12);
    EXPECT_NEAR(hit->barycentric.sum(), 1.0, 1e-12);
  }
  EXPECT_GT(hits, 50);
}

TEST(FirstHit, FindsTheWayOutFromInside) {
  const auto mesh = picked_ball();
  Random random;
  for (int i = 0; i < 100; ++i) {
    const auto hit = first_hit(mesh->positions_m, mesh->faces, {Vector3d::Zero(), random.vector(1.0)});
    ASSERT_TRUE(hit.has_value());
    EXPECT_LE(hit->distance_m, 1.0 + 1e-12);
    EXPECT_GE(hit->distance_m, 0.96);  // the flattest face of the 320
  }
}

TEST(FirstHit, IsNothingBehindBesideOrWithoutADirection) {
  const auto mesh = picked_ball();
  EXPECT_FALSE(first_hit(mesh->positions_m, mesh->faces, {{0, 0, 3}, {0, 0, 1}}));
  EXPECT_FALSE(first_hit(mesh->positions_m, mesh->faces, {{0, 1.5, 3}, {0, 0, -1}}));
  EXPECT_FALSE(first_hit(mesh->positions_m, mesh->faces, {{0, 0, 3}, {0, 0, 0}}));
}

TEST(HitSphere, IsAtTheClosedFormDistance) {
  EXPECT_DOUBLE_EQ(*hit_sphere_m({{0, 0, 5}, {0, 0, -2}}, 2.0), 3.0);
  EXPECT_DOUBLE_EQ(*hit_sphere_m({{0, 0, 0}, {1, 1, 1}}, 2.0), 2.0);  // from inside
  EXPECT_DOUBLE_EQ(*hit_sphere_m({{3, 0, 5}, {0, 0, -1}}, 5.0), 1.0);
  EXPECT_FALSE(hit_sphere_m({{2.1, 0, 5}, {0, 0, -1}}, 2.0));
  EXPECT_FALSE(hit_sphere_m({{0, 0, 5}, {0, 0, 1}}, 2.0));
  EXPECT_FALSE(hit_sphere_m({{0, 0, 0}, {0, 0, 0}}, 2.0));
  EXPECT_NEAR(*hit_sphere_m({{0, 0, 1e6}, {0, 0, -1}}, 1e-3), 1e6 - 1e-3, 1e-9);
}

TEST(HitBox, IsAtTheClosedFormDistance) {
  EXPECT_DOUBLE_EQ(*hit_box_m({{0, 0, 5}, {0, 0, -3}}, {1, 1, 2}), 3.0);
  EXPECT_DOUBLE_EQ(*hit_box_m({{0, 0, 0}, {0, 1, 0}}, {1, 4, 2}), 4.0);  // from inside
  EXPECT_DOUBLE_EQ(*hit_box_m({{-3, -3, 0}, {1, 1, 0}}, {1, 1, 1}), std::sqrt(8.0));
  EXPECT_FALSE(hit_box_m({{1.1, 0, 5}, {0, 0, -1}}, {1, 1, 2}));
  EXPECT_FALSE(hit_box_m({{0, 0, 5}, {0, 0, 1}}, {1, 1, 2}));
  EXPECT_FALSE(hit_box_m({{0, 0, 5}, {0, 0, 0}}, {1, 1, 2}));
}

TEST(NearestVertex, IsTheLowestOfTheNearest) {
  const std::vector<Vector3d> positions{{0, 0, 3}, {1, 0, 0}, {-1, 0, 0}};
  EXPECT_EQ(nearest_vertex(positions, {0, 0, 0}), 1U);
  EXPECT_EQ(nearest_vertex(positions, {-0.1, 0, 0}), 2U);
}

TEST(WeightsNear, SumToOneAndFallToZeroAtTheRadius) {
  const auto mesh = picked_ball();
  const Vector3d point(0, 1, 0);
  const double radius_m = 0.6;
  const std::vector<VertexWeight> weights = weights_near(mesh->positions_m, point, radius_m);
  std::size_t inside = 0;
  for (const Vector3d& position : mesh->positions_m) inside += (position - point).norm() < radius_m ? 1 : 0;
  ASSERT_EQ(weights.size(), inside);
  ASSERT_GT(inside, 5U);
  double sum = 0.0;
  for (const VertexWeight& a : weights) {
    sum += a.weight;
    const double distance_a_m = (mesh->positions_m[a.vertex] - point).norm();
    for (const VertexWeight& b : weights) {
      if ((mesh->positions_m[b.vertex] - point).norm() < distance_a_m) {
        EXPECT_GE(b.weight, a.weight);
      }
    }
  }
  EXPECT_NEAR(sum, 1.0, 1e-14);
  // A vertex that has just come inside counts for nearly nothing.
  const std::vector<Vector3d> pair{{0, 0, 0}, {1, 0, 0}};
  const std::vector<VertexWeight> edge = weights_near(pair, {0, 0, 0}, 1.0 + 1e-6);
  ASSERT_EQ(edge.size(), 2U);
  EXPECT_LT(edge[1].weight, 1e-11);
}

TEST(WeightsNear, AreTheNearestVertexAloneWhereNoneIsInside) {
  const auto mesh = picked_ball();
  for (const double radius_m : {0.0, 0.1}) {
    const std::vector<VertexWeight> weights = weights_near(mesh->positions_m, {0, 0, 3}, radius_m);
    ASSERT_EQ(weights.size(), 1U);
    EXPECT_EQ(weights[0].vertex, nearest_vertex(mesh->positions_m, {0, 0, 3}));
    EXPECT_EQ(weights[0].weight, 1.0);
  }
}

// Two sheets a centimetre apart, joined at one side: near, but far along the skin.
TEST(WeightsAlongSkin, KeepToTheSkinAndFallFromTheCentre) {
  constexpr std::uint32_t columns = 6;
  std::vector<Vector3d> positions;
  std::vector<Edge> edges;
  for (std::uint32_t i = 0; i < 2 * columns; ++i) {
    const bool is_above = i >= columns;
    positions.emplace_back(0.1 * (is_above ? 2 * columns - 1 - i : i), is_above ? 0.01 : 0.0, 0.0);
    if (i > 0) edges.push_back({i - 1, i});
  }
  const std::vector<VertexWeight> weights = weights_along_skin(positions, edges, 1, 0.25, 100);
  ASSERT_EQ(weights.size(), 4U);  // 0 to 3
  double sum = 0.0;
  for (std::uint32_t i = 0; i < 4; ++i) {
    const double share = 0.1 * std::abs(static_cast<double>(i) - 1.0) / 0.25;
    EXPECT_EQ(weights[i].vertex, i);
    EXPECT_NEAR(weights[i].weight / weights[1].weight, std::pow(1.0 - share * share, 2.0), 1e-12);
    sum += weights[i].weight;
  }
  EXPECT_NEAR(sum, 1.0, 1e-14);
}

TEST(WeightsAlongSkin, TakeTheShortestWay) {
  const auto mesh = picked_ball();
  const double radius_m = 1.2;
  const std::vector<VertexWeight> weights = weights_along_skin(mesh->positions_m, mesh->edges, 0, radius_m, 1'000);
  ASSERT_GT(weights.size(), 8U);
  // What a vertex's weight says of its way: no further than by any neighbour of it.
  const double most = std::ranges::max(weights, {}, &VertexWeight::weight).weight;
  std::map<std::uint32_t, double> ways_m;
  for (const VertexWeight& each : weights) {
    ways_m[each.vertex] = radius_m * std::sqrt(std::max(0.0, 1.0 - std::sqrt(each.weight / most)));
  }
  std::map<std::uint32_t, double> by_neighbours_m;  // the shortest
  for (const auto& [first, second] : mesh->edges) {
    const double length_m = (mesh->positions_m[first] - mesh->positions_m[second]).norm();
    for (const auto& [from, to] : {std::pair(first, second), std::pair(second, first)}) {
      if (!ways_m.contains(from)) continue;
      const double to_m = ways_m.contains(to) ? ways_m[to] : radius_m;
      EXPECT_LE(to_m, ways_m[from] + length_m + 1e-6);
      const auto [known, is_new] = by_neighbours_m.try_emplace(to, ways_m[from] + length_m);
      if (!is_new) known->second = std::min(known->second, ways_m[from] + length_m);
    }
  }
  for (const auto& [vertex, way_m] : ways_m) {
    if (vertex != 0) {
      EXPECT_NEAR(way_m, by_neighbours_m[vertex], 1e-4) << vertex;
    }
  }
}

// Whatever the radius, the weights are numbers and the centre's is the largest.
TEST(WeightsAlongSkin, HoldAtTheEndsOfTheRange) {
  const auto mesh = picked_ball();
  for (const double radius_m : {5e-324, 1e-200, 1e-9, 1e7, 1e300}) {
    const std::vector<VertexWeight> weights =
        weights_along_skin(mesh->positions_m, mesh->edges, 7, radius_m, mesh->positions_m.size());
    ASSERT_EQ(weights.size(), radius_m < 1.0 ? 1U : mesh->positions_m.size());
    double sum = 0.0;
    for (const VertexWeight& each : weights) sum += each.weight;
    EXPECT_NEAR(sum, 1.0, 1e-12);
    const VertexWeight most = std::ranges::max(weights, {}, &VertexWeight::weight);
    EXPECT_EQ(most.vertex, 7U);
    EXPECT_EQ(std::ranges::count(weights, most.weight, &VertexWeight::weight), 1);
  }
  EXPECT_EQ(weights_along_skin(mesh->positions_m, mesh->edges, 7, 1e7, 9).size(), 10U);
}

TEST(WeightsAlongSkin, AreTheCentreAloneWithoutARadius) {
  const auto mesh = picked_ball();
  const std::vector<VertexWeight> weights = weights_along_skin(mesh->positions_m, mesh->edges, 5, 0.0, 1);
  ASSERT_EQ(weights.size(), 1U);
  EXPECT_EQ(weights[0].vertex, 5U);
  EXPECT_EQ(weights[0].weight, 1.0);
}

}  // namespace
}  // namespace pneuma::physics
