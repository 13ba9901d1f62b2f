#include "physics/mesh/picking.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <queue>
#include <utility>

#include <Eigen/Geometry>

namespace pneuma::physics {
namespace {

using Eigen::Vector3d;

// In a patch so wide that all weigh the same, the centre still weighs most.
constexpr double closeness_beside_centre_max = 1.0 - 1e-9;

/// Barycentric weights of the point of triangle abc nearest to p: that of the plane where it falls inside, else the
/// nearest of the three sides (Ericson, Real-Time Collision Detection, 5.1.5, by the same regions).
Vector3d nearest_barycentric(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& p) {
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const double a1 = ab.dot(p - a);
  const double a2 = ac.dot(p - a);
  if (a1 <= 0.0 && a2 <= 0.0) return {1.0, 0.0, 0.0};
  const double b1 = ab.dot(p - b);
  const double b2 = ac.dot(p - b);
  if (b1 >= 0.0 && b2 <= b1) return {0.0, 1.0, 0.0};
  const double c1 = ab.dot(p - c);
  const double c2 = ac.dot(p - c);
  if (c2 >= 0.0 && c1 <= c2) return {0.0, 0.0, 1.0};

  const double to_c = a1 * b2 - b1 * a2;
  if (to_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0) {
    const double t = a1 / (a1 - b1);
    return {1.0 - t, t, 0.0};
  }
  const double to_b = c1 * a2 - a1 * c2;
  if (to_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0) {
    const double t = a2 / (a2 - c2);
    return {1.0 - t, 0.0, t};
  }
  const double to_a = b1 * c2 - c1 * b2;
  if (to_a <= 0.0 && b2 - b1 >= 0.0 && c1 - c2 >= 0.0) {
    const double t = (b2 - b1) / ((b2 - b1) + (c1 - c2));
    return {0.0, 1.0 - t, t};
  }
  return Vector3d(to_a, to_b, to_c) / (to_a + to_b + to_c);
}

Vector3d blend(const Vector3d& barycentric, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return barycentric[0] * a + barycentric[1] * b + barycentric[2] * c;
}

/// Moller and Trumbore (1997): weights of b and c, and the distance along the unit `direction`.
std::optional<Vector3d> hit_triangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& origin,
                                     const Vector3d& direction) {
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const Vector3d across = direction.cross(ac);
  const double determinant = ab.dot(across);
  if (determinant == 0.0) return std::nullopt;
  const Vector3d from_a = origin - a;
  const double at_b = from_a.dot(across) / determinant;
  if (!(at_b >= 0.0 && at_b <= 1.0)) return std::nullopt;
  const Vector3d along = from_a.cross(ab);
  const double at_c = direction.dot(along) / determinant;
  if (!(at_c >= 0.0 && at_b + at_c <= 1.0)) return std::nullopt;
  const double distance = ac.dot(along) / determinant;
  if (!(distance >= 0.0)) return std::nullopt;
  return Vector3d(at_b, at_c, distance);
}

/// The first of two crossings that is not behind the ray's origin.
std::optional<double> first_ahead(double enter_m, double leave_m) {
  if (!(enter_m <= leave_m) || leave_m < 0.0) return std::nullopt;
  return enter_m >= 0.0 ? enter_m : leave_m;
}

}  // namespace

MeshPoint nearest_surface_point(std::span<const Vector3d> positions_m, std::span<const Face> faces,
                                const Vector3d& point_m) {
  assert(!faces.empty());
  MeshPoint nearest;
  double nearest_squared = std::numeric_limits<double>::infinity();
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const Vector3d& a = positions_m[faces[f][0]];
    const Vector3d& b = positions_m[faces[f][1]];
    const Vector3d& c = positions_m[faces[f][2]];
    const Vector3d barycentric = nearest_barycentric(a, b, c, point_m);
    const Vector3d position = blend(barycentric, a, b, c);
    const double squared = (position - point_m).squaredNorm();
    if (squared < nearest_squared) {
      nearest_squared = squared;
      nearest = {f, barycentric, position, std::sqrt(squared)};
    }
  }
  return nearest;
}

std::optional<MeshPoint> first_hit(std::span<const Vector3d> positions_m, std::span<const Face> faces, const Ray& ray) {
  const Vector3d direction = ray.direction.stableNormalized();
  std::optional<MeshPoint> first;
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    const Vector3d& a = positions_m[faces[f][0]];
    const Vector3d& b = positions_m[faces[f][1]];
    const Vector3d& c = positions_m[faces[f][2]];
    const std::optional<Vector3d> hit = hit_triangle(a, b, c, ray.origin_m, direction);
    if (!hit || (first && (*hit)[2] >= first->distance_m)) continue;
    const Vector3d barycentric(1.0 - (*hit)[0] - (*hit)[1], (*hit)[0], (*hit)[1]);
    first = MeshPoint{f, barycentric, blend(barycentric, a, b, c), (*hit)[2]};
  }
  return first;
}

std::optional<double> hit_sphere_m(const Ray& ray, double radius_m) {
  const Vector3d direction = ray.direction.stableNormalized();
  if (direction.isZero(0.0)) return std::nullopt;
  // From the ray's point nearest to the centre, half a chord either way: no difference of large squares far from the
  // sphere.
  const double to_nearest_m = -ray.origin_m.dot(direction);
  const double miss_m = ray.origin_m.cross(direction).norm();
  if (!(miss_m <= radius_m)) return std::nullopt;
  const double half_chord_m = std::sqrt((radius_m - miss_m) * (radius_m + miss_m));
  return first_ahead(to_nearest_m - half_chord_m, to_nearest_m + half_chord_m);
}

std::optional<double> hit_box_m(const Ray& ray, const Vector3d& half_extents_m) {
  const Vector3d direction = ray.direction.stableNormalized();
  if (direction.isZero(0.0)) return std::nullopt;
  double enter_m = -std::numeric_limits<double>::infinity();
  double leave_m = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double origin_m = ray.origin_m[axis];
    const double extent_m = half_extents_m[axis];
    if (direction[axis] == 0.0) {
      if (!(std::abs(origin_m) <= extent_m)) return std::nullopt;
      continue;
    }
    const double low_m = (-extent_m - origin_m) / direction[axis];
    const double high_m = (extent_m - origin_m) / direction[axis];
    enter_m = std::max(enter_m, std::min(low_m, high_m));
    leave_m = std::min(leave_m, std::max(low_m, high_m));
  }
  return first_ahead(enter_m, leave_m);
}

// Two balls and the cylinder between them: together they are convex, so the ray is within from the first to the last.
std::optional<double> hit_capsule_m(const Ray& ray, double radius_m, double half_height_m) {
  const Vector3d direction = ray.direction.stableNormalized();
  if (direction.isZero(0.0)) return std::nullopt;
  double enter_m = std::numeric_limits<double>::infinity();
  double leave_m = -std::numeric_limits<double>::infinity();
  const auto chord_of = [radius_m](const Vector3d& origin_m, const Vector3d& along) -> std::optional<Eigen::Vector2d> {
    const double to_nearest_m = -origin_m.dot(along);
    const double miss_m = origin_m.cross(along).norm();
    if (!(miss_m <= radius_m)) return std::nullopt;
    const double half_chord_m = std::sqrt((radius_m - miss_m) * (radius_m + miss_m));
    return Eigen::Vector2d(to_nearest_m - half_chord_m, to_nearest_m + half_chord_m);
  };
  const auto include = [&](double low_m, double high_m) {
    if (!(low_m <= high_m)) return;
    enter_m = std::min(enter_m, low_m);
    leave_m = std::max(leave_m, high_m);
  };
  for (const double end_m : {-half_height_m, half_height_m}) {
    if (const auto chord = chord_of(ray.origin_m - end_m * Vector3d::UnitY(), direction)) {
      include((*chord)[0], (*chord)[1]);
    }
  }
  const double sine = std::hypot(direction.x(), direction.z());
  if (sine > 0.0) {
    const Vector3d across(direction.x() / sine, 0.0, direction.z() / sine);
    if (const auto chord = chord_of({ray.origin_m.x(), 0.0, ray.origin_m.z()}, across)) {
      double low_m = (*chord)[0] / sine;
      double high_m = (*chord)[1] / sine;
      if (direction.y() != 0.0) {
        const double bottom_m = (-half_height_m - ray.origin_m.y()) / direction.y();
        const double top_m = (half_height_m - ray.origin_m.y()) / direction.y();
        low_m = std::max(low_m, std::min(bottom_m, top_m));
        high_m = std::min(high_m, std::max(bottom_m, top_m));
      } else if (std::abs(ray.origin_m.y()) > half_height_m) {
        high_m = -std::numeric_limits<double>::infinity();
      }
      include(low_m, high_m);
    }
  }
  if (!(enter_m <= leave_m)) return std::nullopt;
  return first_ahead(enter_m, leave_m);
}

std::uint32_t nearest_vertex(std::span<const Vector3d> positions_m, const Vector3d& point_m) {
  assert(!positions_m.empty());
  const auto nearest = std::min_element(positions_m.begin(), positions_m.end(), [&](const auto& a, const auto& b) {
    return (a - point_m).squaredNorm() < (b - point_m).squaredNorm();
  });
  return static_cast<std::uint32_t>(nearest - positions_m.begin());
}

std::vector<VertexWeight> weights_near(std::span<const Vector3d> positions_m, const Vector3d& point_m,
                                       double radius_m) {
  std::vector<VertexWeight> weights;
  double sum = 0.0;
  const double radius_squared = radius_m * radius_m;
  for (std::uint32_t i = 0; i < positions_m.size() && radius_m > 0.0; ++i) {
    const double closeness = 1.0 - (positions_m[i] - point_m).squaredNorm() / radius_squared;
    if (!(closeness > 0.0)) continue;
    weights.push_back({i, closeness * closeness});
    sum += weights.back().weight;
  }
  if (!(sum > 0.0)) return {{nearest_vertex(positions_m, point_m), 1.0}};
  for (VertexWeight& share : weights) share.weight /= sum;
  return weights;
}

std::vector<VertexWeight> weights_along_skin(std::span<const Vector3d> positions_m, std::span<const Edge> edges,
                                             std::uint32_t centre, double radius_m, std::size_t most) {
  // No way is shorter than the straight one, so only edges within the radius count.
  const auto is_near = [&](std::uint32_t vertex) {
    return (positions_m[vertex] - positions_m[centre]).norm() < radius_m;
  };
  std::vector<Edge> steps;  // each edge from either end
  for (const auto& [first, second] : edges) {
    if (!is_near(first) || !is_near(second)) continue;
    steps.push_back({first, second});
    steps.push_back({second, first});
  }
  std::ranges::sort(steps);
  // Dijkstra's algorithm.
  using Reached = std::pair<double, std::uint32_t>;  // by a way of so many metres
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  next.emplace(0.0, centre);
  std::map<std::uint32_t, double> ways_m;
  while (!next.empty() && ways_m.size() <= most) {
    const auto [way_m, vertex] = next.top();
    next.pop();
    if (!ways_m.try_emplace(vertex, way_m).second) continue;
    const auto end_of = [](const Edge& step) { return step[0]; };
    for (const auto& [from, to] : std::ranges::equal_range(steps, vertex, {}, end_of)) {
      const double further_m = way_m + (positions_m[to] - positions_m[from]).norm();
      if (further_m < radius_m) next.emplace(further_m, to);
    }
  }
  std::vector<VertexWeight> weights;
  double sum = 0.0;
  for (const auto& [vertex, way_m] : ways_m) {
    // Divided first: the square of a tiny radius is 0.
    const double part = vertex == centre ? 0.0 : way_m / radius_m;
    const double closeness = vertex == centre ? 1.0 : std::min(1.0 - part * part, closeness_beside_centre_max);
    weights.push_back({vertex, closeness * closeness});
    sum += weights.back().weight;
  }
  for (VertexWeight& share : weights) share.weight /= sum;
  return weights;
}

}  // namespace pneuma::physics
