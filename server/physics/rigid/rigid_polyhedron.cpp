#include "physics/rigid/rigid_polyhedron.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "physics/mesh/mesh_builders.h"
#include "physics/rigid/separating_axis.h"

namespace pneuma::physics {
namespace {

/// A polyhedron with its corners and normals in the world.
class Placed {
 public:
  explicit Placed(const PolyhedronPose& pose) : solid_(pose.solid), centre_(pose.frame.origin) {
    corners.reserve(solid_.corners_m.size());
    for (const Vec3d& corner : solid_.corners_m) {
      corners.push_back(pose.frame.to_world(corner.cwiseProduct(pose.stretch)));
    }
    normals.reserve(solid_.sides.size());
    levels.reserve(solid_.sides.size());
    for (const Polyhedron::Side& side : solid_.sides) {
      // The normals of a cube, which alone is stretched, stay.
      normals.push_back(pose.frame.rotation * side.normal);
      const auto level = [&](std::uint32_t corner) { return normals.back().dot(corners[corner]); };
      double highest = -std::numeric_limits<double>::infinity();
      for (const std::uint32_t corner : solid_.corners_of(side)) highest = std::max(highest, level(corner));
      levels.push_back(highest);
      inner_radius_m = std::min(inner_radius_m, highest - normals.back().dot(centre_));
    }
    width_m = 2.0 * solid_.half_width_m * pose.stretch.minCoeff();
  }

  [[nodiscard]] std::span<const Polyhedron::Ridge> ridges() const { return solid_.ridges; }
  [[nodiscard]] std::size_t side_count() const { return solid_.sides.size(); }
  [[nodiscard]] std::span<const std::uint32_t> loop(std::size_t side) const {
    return solid_.corners_of(solid_.sides[side]);
  }
  [[nodiscard]] const Vec3d& centre() const { return centre_; }

  [[nodiscard]] std::size_t furthest_corner(const Vec3d& direction) const {
    const auto along = [&](const Vec3d& corner) { return direction.dot(corner); };
    return static_cast<std::size_t>(std::ranges::max_element(corners, {}, along) - corners.begin());
  }

  /// Of the sides at the corner that lies furthest against the direction, the one that looks most against it.
  [[nodiscard]] std::size_t side_against(const Vec3d& direction) const {
    const std::size_t corner = furthest_corner(-direction);
    std::size_t most = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t s = 0; s < side_count(); ++s) {
      const double along = normals[s].dot(direction);
      if (along >= least || std::ranges::find(loop(s), corner) == loop(s).end()) continue;
      least = along;
      most = s;
    }
    return most;
  }

  std::vector<Vec3d> corners;
  std::vector<Vec3d> normals;  // one a side
  std::vector<double> levels;
  double width_m = 0.0;
  double inner_radius_m = std::numeric_limits<double>::infinity();  // of the ball about the centre within it

 private:
  const Polyhedron& solid_;
  Vec3d centre_;
};

struct FaceAxis {
  double separation_m = -std::numeric_limits<double>::infinity();
  bool of_a = false;
  std::size_t side = 0;
};

FaceAxis best_face(const Placed& a, const Placed& b) {
  FaceAxis best;
  for (const bool of_a : {true, false}) {
    const Placed& own = of_a ? a : b;
    const Placed& other = of_a ? b : a;
    for (std::size_t s = 0; s < own.side_count(); ++s) {
      const Vec3d& n = own.normals[s];
      if (n.dot(other.centre()) - other.inner_radius_m - own.levels[s] <= best.separation_m) continue;
      const double separation_m = n.dot(other.corners[other.furthest_corner(-n)]) - own.levels[s];
      if (separation_m > best.separation_m) best = {separation_m, of_a, s};
    }
  }
  return best;
}

struct EdgeAxis {
  double separation_m = -std::numeric_limits<double>::infinity();
  Vec3d normal = Vec3d::UnitY();  // from b to a
  const Polyhedron::Ridge* of_a = nullptr;
  const Polyhedron::Ridge* of_b = nullptr;
};

// Whether the arcs of two edges' normals cross on the sphere, those of b turned round: only then is the pair a face of
// the difference of the two solids.
bool may_part(const Placed& a, const Polyhedron::Ridge& edge_a, const Vec3d& along_a, const Placed& b,
              const Polyhedron::Ridge& edge_b, const Vec3d& along_b) {
  const double first_b = -b.normals[edge_b.sides[0]].dot(along_a);
  const double second_b = -b.normals[edge_b.sides[1]].dot(along_a);
  if (first_b * second_b >= 0.0) return false;
  const double first_a = a.normals[edge_a.sides[0]].dot(along_b);
  const double second_a = a.normals[edge_a.sides[1]].dot(along_b);
  return first_a * second_a < 0.0 && second_b * first_a > 0.0;
}

/// The most that a unit vector between the normals of an edge reaches along `way`.
double reach_along(const Placed& solid, const Polyhedron::Ridge& edge, const Vec3d& way) {
  const Vec3d& first = solid.normals[edge.sides[0]];
  const Vec3d& second = solid.normals[edge.sides[1]];
  const double p = first.dot(way);
  const double q = second.dot(way);
  const double cosine = first.dot(second);
  if (p <= cosine * q || q <= cosine * p) return std::max(p, q);
  return std::sqrt((p * p + q * q - 2.0 * p * q * cosine) / (1.0 - cosine * cosine));
}

std::vector<const Polyhedron::Ridge*> edges_that_reach(const Placed& solid, const Vec3d& way, double least_m) {
  std::vector<const Polyhedron::Ridge*> edges;
  for (const Polyhedron::Ridge& edge : solid.ridges()) {
    if (reach_along(solid, edge, way) > least_m) edges.push_back(&edge);
  }
  return edges;
}

// The balls within two solids are at least as far apart along an axis as the solids are. So edges whose normals do not
// go far enough from one centre to the other are left out: of the 120 of a round solid, four stay; of a cube's 12,
// seven.
EdgeAxis best_edges(const Placed& a, const Placed& b, double least_m) {
  EdgeAxis best;
  best.separation_m = least_m;
  const Vec3d way = b.centre() - a.centre();
  const double reach_m = least_m + a.inner_radius_m + b.inner_radius_m;
  const auto edges_b = edges_that_reach(b, -way, reach_m);
  for (const Polyhedron::Ridge* edge_a : edges_that_reach(a, way, reach_m)) {
    const Vec3d& from_a = a.corners[edge_a->corners[0]];
    const Vec3d along_a = a.corners[edge_a->corners[1]] - from_a;
    for (const Polyhedron::Ridge* edge_b : edges_b) {
      const Vec3d& from_b = b.corners[edge_b->corners[0]];
      const Vec3d along_b = b.corners[edge_b->corners[1]] - from_b;
      if (!may_part(a, *edge_a, along_a, b, *edge_b, along_b)) continue;
      Vec3d out_of_a = along_a.cross(along_b);
      const double length = out_of_a.norm();
      if (length <= parallel_sine * along_a.norm() * along_b.norm()) continue;
      out_of_a *= sign_of(out_of_a.dot(from_a - a.centre())) / length;
      const double separation_m = out_of_a.dot(from_b - from_a);
      if (separation_m > best.separation_m) best = {separation_m, -out_of_a, edge_a, edge_b};
    }
  }
  return best;
}

MeshTouch touch_edges(const Placed& a, const Placed& b, const EdgeAxis& axis) {
  const Vec3d& p = a.corners[axis.of_a->corners[0]];
  const Vec3d& q = b.corners[axis.of_b->corners[0]];
  const Vec3d u = (a.corners[axis.of_a->corners[1]] - p).normalized();
  const Vec3d v = (b.corners[axis.of_b->corners[1]] - q).normalized();
  // The nearest points of two lines that are not parallel.
  const double cosine = u.dot(v);
  const Vec3d between = q - p;
  const double along = (between.dot(u) - cosine * between.dot(v)) / (1.0 - cosine * cosine);
  return {p + along * u - 0.5 * axis.separation_m * axis.normal, axis.normal, axis.separation_m};
}

using Outline = std::vector<Vec3d>;

/// Sutherland and Hodgman: keeps what lies below the plane n.p = level.
void clip(Outline& outline, const Vec3d& n, double level, Outline& kept) {
  kept.clear();
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const Vec3d& p = outline[i];
    const Vec3d& q = outline[(i + 1) % outline.size()];
    const double over_p = n.dot(p) - level;
    const double over_q = n.dot(q) - level;
    if (over_p <= 0.0) kept.push_back(p);
    if ((over_p < 0.0 && over_q > 0.0) || (over_p > 0.0 && over_q < 0.0)) {
      kept.push_back(p + over_p / (over_p - over_q) * (q - p));
    }
  }
  outline.swap(kept);
}

void touch_face(const Placed& a, const Placed& b, const FaceAxis& axis, double reach_m,
                std::vector<MeshTouch>& touches) {
  const Placed& reference = axis.of_a ? a : b;
  const Placed& other = axis.of_a ? b : a;
  const Vec3d& outward = reference.normals[axis.side];
  Outline outline;
  Outline scratch;
  for (const std::uint32_t corner : other.loop(other.side_against(outward))) outline.push_back(other.corners[corner]);
  const auto loop = reference.loop(axis.side);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3d& from = reference.corners[loop[i]];
    const Vec3d side = (reference.corners[loop[(i + 1) % loop.size()]] - from).cross(outward).normalized();
    clip(outline, side, side.dot(from), scratch);
  }
  const Vec3d normal = axis.of_a ? Vec3d(-outward) : outward;
  for (const Vec3d& point : outline) {
    const double distance_m = outward.dot(point) - reference.levels[axis.side];
    if (distance_m <= reach_m) touches.push_back({point - 0.5 * distance_m * outward, normal, distance_m});
  }
}

}  // namespace

PolyhedronPose polyhedron_pose(const Shape& shape, const Frame& frame) {
  static const std::shared_ptr<const Polyhedron> cube = *make_polyhedron(**make_box(Vec3d::Ones(), 1));
  if (const auto* box = std::get_if<BoxShape>(&shape)) return {*cube, box->half_extents_m, frame};
  return {*std::get<ConvexShape>(shape).solid, Vec3d::Ones(), frame};
}

void touch_polyhedra(const PolyhedronPose& a, const PolyhedronPose& b, double reach_m,
                     std::vector<MeshTouch>& touches) {
  const Placed in_world_a(a);
  const Placed in_world_b(b);
  const FaceAxis face = best_face(in_world_a, in_world_b);
  if (face.separation_m > reach_m) return;
  const double handicap_m = 0.5 * edge_handicap * std::min(in_world_a.width_m, in_world_b.width_m);
  const EdgeAxis edges = best_edges(in_world_a, in_world_b, face.separation_m + handicap_m);
  if (edges.of_a == nullptr) {
    touch_face(in_world_a, in_world_b, face, reach_m, touches);
  } else if (edges.separation_m <= reach_m) {
    touches.push_back(touch_edges(in_world_a, in_world_b, edges));
  }
}

void touch_segment(const ConvexShape& convex, const Vec3d& first, const Vec3d& way, std::vector<MeshTouch>& touches) {
  const Polyhedron& solid = *convex.solid;
  const auto add = [&](double share) -> Vec3d {
    const PolyhedronPoint nearest = nearest_point(solid, first + share * way);
    touches.push_back({nearest.position_m, nearest.normal, nearest.distance_m});
    return nearest.normal;
  };
  const double deepest = deepest_on_segment(convex, first, way);
  const Vec3d normal = add(deepest);
  if (way.isZero(0.0)) return;  // a ball's centre
  const auto along = [&](const Polyhedron::Side& side) { return side.normal.dot(normal); };
  const Polyhedron::Side& side = *std::ranges::max_element(solid.sides, {}, along);
  double low = 0.0;
  double high = 1.0;
  const auto loop = solid.corners_of(side);
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Vec3d& from = solid.corners_m[loop[i]];
    const Vec3d outwards = (solid.corners_m[loop[(i + 1) % loop.size()]] - from).cross(side.normal);
    const double over = outwards.dot(first - from);
    const double slope = outwards.dot(way);
    if (slope == 0.0 && over > 0.0) return;
    if (slope > 0.0) high = std::min(high, -over / slope);
    if (slope < 0.0) low = std::max(low, -over / slope);
  }
  if (low >= high) return;
  for (const double share : {low, high}) {
    if (share != deepest) add(share);
  }
}

}  // namespace pneuma::physics
