#include "support/crossings.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "physics/rigid/sweep.h"
#include "support/exact_orientation.h"

namespace pneuma::support {
namespace {

void check_point(const Eigen::Vector3d& point_m) {
  for (const double value : point_m) {
    if (!(std::abs(value) <= exact_coordinate_max_m)) {
      throw std::invalid_argument("a coordinate is not finite, or is past exact_coordinate_max_m");
    }
  }
}

void check_mesh(const TriangleMesh& mesh) {
  for (const Eigen::Vector3d& position : mesh.positions_m) check_point(position);
  for (const auto& face : mesh.faces) {
    if (std::ranges::max(face) >= mesh.positions_m.size()) throw std::invalid_argument("a face has no such vertex");
  }
}

Triangle triangle_of(const TriangleMesh& mesh, std::size_t face) {
  const auto& [i, j, k] = mesh.faces[face];
  return {mesh.positions_m[i], mesh.positions_m[j], mesh.positions_m[k]};
}

/// A corner by itself on its side of the other triangle's plane, and the two corners after it, in order.
struct Apex {
  Triangle corners_m;
  int side;  // of corners_m[0]: 1 or -1
};

/// False where the triangle does not have a corner strictly on either side of the plane.
bool find_apex(const Triangle& triangle_m, const Triangle& plane_m, Apex& apex) {
  std::array<int, 3> sides{};
  for (std::size_t i = 0; i < 3; ++i) sides[i] = orientation(plane_m[0], plane_m[1], plane_m[2], triangle_m[i]);
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3;
    const std::size_t k = (i + 2) % 3;
    const bool alone = sides[i] != 0 && sides[j] != sides[i] && sides[k] != sides[i];
    if (alone && (sides[j] != 0 || sides[k] != 0)) {
      apex = {{triangle_m[i], triangle_m[j], triangle_m[k]}, sides[i]};
      return true;
    }
  }
  return false;
}

struct BoxedTriangle {
  Triangle corners_m;
  Eigen::AlignedBox3d box_m;
  std::size_t face;
};

Eigen::AlignedBox3d box_of(std::span<const Eigen::Vector3d> positions_m) {
  Eigen::AlignedBox3d box_m;
  for (const Eigen::Vector3d& position : positions_m) box_m.extend(position);
  return box_m;
}

/// Adds the faces whose boxes meet this box.
void add_boxed(const TriangleMesh& mesh, const Eigen::AlignedBox3d& within_m, std::vector<BoxedTriangle>& triangles) {
  for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
    const Triangle corners_m = triangle_of(mesh, face);
    const Eigen::AlignedBox3d box_m = box_of(corners_m);
    if (box_m.intersects(within_m)) triangles.push_back({corners_m, box_m, face});
  }
}

/// The pairs that cross among those with may_cross(i, j).
template <class MayCross>
std::size_t count_pairs(const std::vector<BoxedTriangle>& triangles, const MayCross& may_cross) {
  std::vector<std::uint32_t> order(triangles.size());
  std::iota(order.begin(), order.end(), 0u);
  std::size_t count = 0;
  physics::sort_and_sweep(
      order, [&](std::uint32_t i) { return triangles[i].box_m.min().x(); },
      [&](std::uint32_t i) { return triangles[i].box_m.max().x(); },
      [&](std::uint32_t i, std::uint32_t j) {
        if (may_cross(i, j) && triangles[i].box_m.intersects(triangles[j].box_m) &&
            crosses(triangles[i].corners_m, triangles[j].corners_m)) {
          ++count;
        }
      });
  return count;
}

double winding_number(const Eigen::Vector3d& point_m, const TriangleMesh& mesh) {
  double half_angles = 0.0;
  for (const auto& [i, j, k] : mesh.faces) {
    const Eigen::Vector3d a = mesh.positions_m[i] - point_m;
    const Eigen::Vector3d b = mesh.positions_m[j] - point_m;
    const Eigen::Vector3d c = mesh.positions_m[k] - point_m;
    const double a_m = a.norm();
    const double b_m = b.norm();
    const double c_m = c.norm();
    half_angles += std::atan2(a.cross(b).dot(c), a_m * b_m * c_m + a.dot(b) * c_m + b.dot(c) * a_m + c.dot(a) * b_m);
  }
  return half_angles / (2.0 * std::numbers::pi);
}

bool winds_around(const Eigen::Vector3d& point_m, const TriangleMesh& closed) {
  return winding_number(point_m, closed) > 0.5;
}

}  // namespace

// After Guigue and Devillers 2003, "Fast and robust triangle-triangle overlap test using orientation predicates". Each
// triangle cuts the line that the two planes share in an interval; the triangles cross if the intervals overlap. With
// both apexes on the positive side, a's interval is where the line meets the edges a0 a2 and a0 a1, in the direction
// normal(a) x normal(b), and b's is where it meets b0 b1 and b0 b2.
bool crosses(const Triangle& a_m, const Triangle& b_m) {
  Apex a{};
  Apex b{};
  if (!find_apex(a_m, b_m, a) || !find_apex(b_m, a_m, b)) return false;
  if (a.side < 0) std::swap(b.corners_m[1], b.corners_m[2]);
  if (b.side < 0) std::swap(a.corners_m[1], a.corners_m[2]);
  const auto& [a0, a1, a2] = a.corners_m;
  const auto& [b0, b1, b2] = b.corners_m;
  const bool a_begins_before_b_ends = orientation(a0, a2, b0, b2) > 0;
  const bool b_begins_before_a_ends = orientation(a0, a1, b0, b1) < 0;
  return a_begins_before_b_ends && b_begins_before_a_ends;
}

std::size_t count_crossings(const TriangleMesh& a, const TriangleMesh& b) {
  check_mesh(a);
  check_mesh(b);
  std::vector<BoxedTriangle> triangles;
  add_boxed(a, box_of(b.positions_m), triangles);
  const std::size_t of_a = triangles.size();
  add_boxed(b, box_of(a.positions_m), triangles);
  return count_pairs(triangles, [&](std::uint32_t i, std::uint32_t j) { return (i < of_a) != (j < of_a); });
}

std::size_t count_self_crossings(const TriangleMesh& mesh) {
  check_mesh(mesh);
  std::vector<BoxedTriangle> triangles;
  add_boxed(mesh, box_of(mesh.positions_m), triangles);
  return count_pairs(triangles, [&](std::uint32_t i, std::uint32_t j) {
    return std::ranges::find_first_of(mesh.faces[triangles[i].face], mesh.faces[triangles[j].face]) ==
           mesh.faces[triangles[i].face].end();
  });
}

bool is_inside(const Eigen::Vector3d& point_m, const TriangleMesh& closed) {
  check_point(point_m);
  check_mesh(closed);
  return winds_around(point_m, closed);
}

std::size_t count_inside(const TriangleMesh& a, const TriangleMesh& b) {
  check_mesh(a);
  check_mesh(b);
  const Eigen::AlignedBox3d box_m = box_of(b.positions_m);
  return static_cast<std::size_t>(std::ranges::count_if(a.positions_m, [&](const Eigen::Vector3d& position_m) {
    return box_m.contains(position_m) && winds_around(position_m, b);
  }));
}

}  // namespace pneuma::support
