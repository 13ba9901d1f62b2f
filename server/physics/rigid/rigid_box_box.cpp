#include "physics/rigid/rigid_box_box.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "physics/rigid/separating_axis.h"

namespace pneuma::physics {
namespace {

struct Axis {
  Vec3d normal = Vec3d::UnitY();  // from b to a
  double separation_m = -std::numeric_limits<double>::infinity();
  int edge_a = -1;  // both -1: a face's
  int edge_b = -1;
  bool face_of_a = false;
  int face = 0;
};

double radius_along(const BoxPose& box, const Vec3d& n) {
  return box.half_extents_m.dot((box.frame.rotation.transpose() * n).cwiseAbs());
}

double separation_along(const BoxPose& a, const BoxPose& b, Vec3d& n) {
  const double along = n.dot(a.frame.origin - b.frame.origin);
  n *= sign_of(along);
  return std::abs(along) - radius_along(a, n) - radius_along(b, n);
}

Axis best_face(const BoxPose& a, const BoxPose& b) {
  Axis best;
  for (const bool of_a : {true, false}) {
    for (int k = 0; k < 3; ++k) {
      Vec3d n = (of_a ? a : b).frame.rotation.col(k);
      const double separation = separation_along(a, b, n);
      if (separation > best.separation_m) best = {n, separation, -1, -1, of_a, k};
    }
  }
  return best;
}

Axis best_edges(const BoxPose& a, const BoxPose& b) {
  Axis best;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      Vec3d n = a.frame.rotation.col(i).cross(b.frame.rotation.col(j));
      const double sine = n.norm();
      if (sine < parallel_sine) continue;
      n /= sine;
      const double separation = separation_along(a, b, n);
      if (separation > best.separation_m) best = {n, separation, i, j, false, 0};
    }
  }
  return best;
}

/// The middle of the edge along axis `along` that lies furthest in `direction`.
Vec3d edge_middle(const BoxPose& box, int along, const Vec3d& direction) {
  Vec3d local = Vec3d::Zero();
  for (int k = 0; k < 3; ++k) {
    if (k != along) local[k] = sign_of(direction.dot(box.frame.rotation.col(k))) * box.half_extents_m[k];
  }
  return box.frame.to_world(local);
}

Manifold touch_edges(const BoxPose& a, const BoxPose& b, const Axis& axis) {
  const Vec3d p = edge_middle(a, axis.edge_a, -axis.normal);
  const Vec3d q = edge_middle(b, axis.edge_b, axis.normal);
  const Vec3d u = a.frame.rotation.col(axis.edge_a);
  const Vec3d v = b.frame.rotation.col(axis.edge_b);
  // The nearest points of two lines that are not parallel.
  const double cosine = u.dot(v);
  const Vec3d between = q - p;
  const double s = (between.dot(u) - cosine * between.dot(v)) / (1.0 - cosine * cosine);
  const Vec3d on_a = p + s * u;
  Manifold manifold;
  manifold.normal = axis.normal;
  manifold.points[0] = {on_a - 0.5 * axis.separation_m * axis.normal, axis.separation_m};
  manifold.count = 1;
  return manifold;
}

struct Polygon {
  std::array<Vec3d, 8> corners;
  std::size_t count = 0;
};

/// Sutherland and Hodgman: keeps what lies below the plane n.p = level.
Polygon clip(const Polygon& polygon, const Vec3d& n, double level) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const Vec3d& p = polygon.corners[i];
    const Vec3d& q = polygon.corners[(i + 1) % polygon.count];
    const double over_p = n.dot(p) - level;
    const double over_q = n.dot(q) - level;
    if (over_p <= 0.0 && kept.count < kept.corners.size()) kept.corners[kept.count++] = p;
    if ((over_p < 0.0 && over_q > 0.0) || (over_p > 0.0 && over_q < 0.0)) {
      if (kept.count < kept.corners.size()) kept.corners[kept.count++] = p + over_p / (over_p - over_q) * (q - p);
    }
  }
  return kept;
}

/// The face of the box that looks most against n.
Polygon face_against(const BoxPose& box, const Vec3d& n) {
  const Vec3d local = box.frame.rotation.transpose() * n;
  Eigen::Index k = 0;
  local.cwiseAbs().maxCoeff(&k);
  const Eigen::Index i = (k + 1) % 3;
  const Eigen::Index j = (k + 2) % 3;
  Vec3d corner = Vec3d::Zero();
  corner[k] = -sign_of(local[k]) * box.half_extents_m[k];
  Polygon face;
  constexpr std::array<std::array<double, 2>, 4> around{{{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};
  for (const auto& [along_i, along_j] : around) {
    corner[i] = along_i * box.half_extents_m[i];
    corner[j] = along_j * box.half_extents_m[j];
    face.corners[face.count++] = box.frame.to_world(corner);
  }
  return face;
}

Manifold touch_face(const BoxPose& a, const BoxPose& b, const Axis& axis, double reach_m) {
  const BoxPose& reference = axis.face_of_a ? a : b;
  const Vec3d outward = axis.face_of_a ? Vec3d(-axis.normal) : axis.normal;
  Polygon polygon = face_against(axis.face_of_a ? b : a, outward);
  for (int k = 0; k < 3; ++k) {
    if (k == axis.face) continue;
    const Vec3d side = reference.frame.rotation.col(k);
    const double middle = side.dot(reference.frame.origin);
    polygon = clip(polygon, side, middle + reference.half_extents_m[k]);
    polygon = clip(polygon, -side, -middle + reference.half_extents_m[k]);
  }
  const double level = outward.dot(reference.frame.origin) + reference.half_extents_m[axis.face];
  Manifold manifold;
  manifold.normal = axis.normal;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const double distance_m = outward.dot(polygon.corners[i]) - level;
    if (distance_m > reach_m) continue;
    manifold.points[manifold.count++] = {polygon.corners[i] - 0.5 * distance_m * outward, distance_m};
  }
  return manifold;
}

}  // namespace

Manifold touch_boxes(const BoxPose& a, const BoxPose& b, double reach_m) {
  const Axis face = best_face(a, b);
  if (face.separation_m > reach_m) return {};
  const Axis edges = best_edges(a, b);
  if (edges.separation_m > reach_m) return {};
  const double handicap_m = edge_handicap * std::min(a.half_extents_m.minCoeff(), b.half_extents_m.minCoeff());
  if (edges.separation_m > face.separation_m + handicap_m) return touch_edges(a, b, edges);
  return touch_face(a, b, face, reach_m);
}

}  // namespace pneuma::physics
