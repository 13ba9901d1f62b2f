#include "physics/mesh/polyhedron.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>

#include "base/limits.h"
#include "base/number_text.h"

namespace pneuma::physics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Of the mesh's diagonal. Files of single precision, or of six digits, are off by less.
constexpr double tolerance_share = 1e-5;
// Of the trace of the inertia: products of inertia this small are round-off, and the axes are the mesh's own.
constexpr double product_share = 1e-12;
// Of the radius: what is nearer than this is on the surface.
constexpr double touching_radius_share = 1e-14;
// Newton's steps to a surface. A flat face takes one; with corners and edges on the way, 300,000 ways took nine at
// most.
constexpr int entering_steps_max = 32;

std::string vertex_text(std::uint32_t vertex) {
  return "vertex " + std::to_string(vertex);
}

/// The mass and the shape of one mesh, step by step.
class Maker {
 public:
  explicit Maker(const Mesh& mesh) : mesh_(mesh), tolerance_m_(tolerance_share * diagonal_m(mesh.positions_m)) {}

  base::Result<std::shared_ptr<const Polyhedron>> make() {
    if (mesh_.positions_m.size() > base::rigid_mesh_vertices_max) {
      return base::Status{base::StatusCode::limit_exceeded,
                          "has " + std::to_string(mesh_.positions_m.size()) +
                              " vertices; the mesh of a rigid body may have at most " +
                              std::to_string(base::rigid_mesh_vertices_max)};
    }
    if (base::Status status = find_neighbours(); !status.ok()) return status;
    if (base::Status status = find_mass(); !status.ok()) return status;
    if (base::Status status = find_sides(); !status.ok()) return status;
    if (!find_loops() || !find_ridges()) {
      return base::invalid("has faces too thin to tell which way they look, or parts that do not hang together");
    }
    for (const Vector3d& corner : solid_.corners_m) {
      solid_.radius_m = std::max(solid_.radius_m, corner.norm());
      solid_.half_extents_m = solid_.half_extents_m.cwiseMax(corner.cwiseAbs());
    }
    return std::make_shared<const Polyhedron>(std::move(solid_));
  }

 private:
  [[nodiscard]] Vector3d at(std::uint32_t vertex) const { return mesh_.positions_m[vertex] - solid_.centre_m; }

  base::Status find_neighbours() {
    for (std::uint32_t f = 0; f < mesh_.faces.size(); ++f) {
      const Face& face = mesh_.faces[f];
      for (std::size_t k = 0; k < 3; ++k) face_of_[{face[k], face[(k + 1) % 3]}] = f;
    }
    for (const auto& [edge, face] : face_of_) {
      if (face_of_.contains({edge.second, edge.first})) continue;
      return base::invalid("is open at the edge from " + vertex_text(edge.first) + " to " + vertex_text(edge.second));
    }
    return {};
  }

  // Sums over the tetrahedra between the faces and a vertex: from there, digits survive far from the origin.
  base::Status find_mass() {
    const Vector3d origin = mesh_.positions_m[mesh_.faces.front()[0]];
    double volume = 0.0;
    Vector3d moment = Vector3d::Zero();
    Matrix3d squares = Matrix3d::Zero();
    for (const Face& face : mesh_.faces) {
      const Vector3d a = mesh_.positions_m[face[0]] - origin;
      const Vector3d b = mesh_.positions_m[face[1]] - origin;
      const Vector3d c = mesh_.positions_m[face[2]] - origin;
      const double part = a.dot(b.cross(c)) / 6.0;
      const Vector3d sum = a + b + c;
      volume += part;
      moment += part / 4.0 * sum;
      squares += part / 20.0 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
    }
    if (volume <= tolerance_m_ * tolerance_m_ * tolerance_m_ / tolerance_share) {
      return base::invalid("is inside out, or flat: it encloses " + base::number_text(volume) + " m^3");
    }
    const Vector3d centre = moment / volume;
    solid_.centre_m = origin + centre;
    solid_.volume_m3 = volume;
    const Matrix3d spread = squares / volume - centre * centre.transpose();
    const Matrix3d inertia = spread.trace() * Matrix3d::Identity() - spread;
    solid_.moments_m2 = inertia.diagonal();
    const double product = std::max({std::abs(inertia(0, 1)), std::abs(inertia(0, 2)), std::abs(inertia(1, 2))});
    if (product <= product_share * inertia.trace()) return {};
    const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(inertia);
    Matrix3d axes = principal.eigenvectors();
    if (axes.determinant() < 0.0) axes.col(2) *= -1.0;
    solid_.moments_m2 = principal.eigenvalues();
    solid_.axes = Eigen::Quaterniond(axes).normalized();
    return {};
  }

  // From the largest triangle on, whose plane is known best: each takes those around it that are level with it.
  base::Status find_sides() {
    std::vector<std::uint32_t> order(mesh_.faces.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::sort(
        order, {}, [this](std::uint32_t f) { return std::pair(-face_area_m2(mesh_.positions_m, mesh_.faces[f]), f); });
    side_of_.assign(mesh_.faces.size(), none);
    for (const std::uint32_t seed : order) {
      if (side_of_[seed] != none) continue;
      const auto& [a, b, c] = mesh_.faces[seed];
      Polyhedron::Side side;
      side.normal = (at(b) - at(a)).cross(at(c) - at(a)).normalized();
      side.level_m = side.normal.dot(at(a));
      if (base::Status status = check_below(side, seed); !status.ok()) return status;
      grow(side, seed);
      solid_.sides.push_back(side);
    }
    return {};
  }

  base::Status check_below(const Polyhedron::Side& side, std::uint32_t face) {
    double deepest_m = 0.0;
    double highest_m = -std::numeric_limits<double>::infinity();
    std::uint32_t highest = 0;
    for (std::uint32_t v = 0; v < mesh_.positions_m.size(); ++v) {
      const double height_m = side.normal.dot(at(v)) - side.level_m;
      deepest_m = std::min(deepest_m, height_m);
      if (height_m <= highest_m) continue;
      highest_m = height_m;
      highest = v;
    }
    if (highest_m > tolerance_m_) {
      return base::invalid("is not convex: " + vertex_text(highest) + " lies " + base::number_text(highest_m) +
                           " m above the plane of face " + std::to_string(face));
    }
    if (deepest_m > -2.0 * tolerance_m_)
      return base::invalid("is flat: all of it lies in the plane of face " + std::to_string(face));
    const double half_width_m = -0.5 * deepest_m;
    solid_.half_width_m = solid_.sides.empty() ? half_width_m : std::min(solid_.half_width_m, half_width_m);
    return {};
  }

  void grow(const Polyhedron::Side& side, std::uint32_t seed) {
    const auto number = static_cast<std::uint32_t>(solid_.sides.size());
    const auto is_level = [&](std::uint32_t v) {
      return std::abs(side.normal.dot(at(v)) - side.level_m) <= tolerance_m_;
    };
    std::vector<std::uint32_t> open{seed};
    side_of_[seed] = number;
    while (!open.empty()) {
      const Face face = mesh_.faces[open.back()];
      open.pop_back();
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t next = face_of_[{face[(k + 1) % 3], face[k]}];
        if (side_of_[next] != none || !std::ranges::all_of(mesh_.faces[next], is_level)) continue;
        side_of_[next] = number;
        open.push_back(next);
      }
    }
  }

  // A corner is where three sides meet or more. Walks around each side, from corner to corner.
  bool find_loops() {
    std::vector<std::vector<std::uint32_t>> sides_at(mesh_.positions_m.size());
    std::vector<std::map<std::uint32_t, std::uint32_t>> next(solid_.sides.size());
    for (const auto& [edge, face] : face_of_) {
      const std::uint32_t side = side_of_[face];
      std::vector<std::uint32_t>& here = sides_at[edge.first];
      if (std::ranges::find(here, side) == here.end()) here.push_back(side);
      if (side_of_[face_of_[{edge.second, edge.first}]] == side) continue;
      if (!next[side].try_emplace(edge.first, edge.second).second) return false;
    }
    std::vector<std::uint32_t> corner_of(mesh_.positions_m.size(), none);
    for (std::uint32_t v = 0; v < sides_at.size(); ++v) {
      if (sides_at[v].size() < 3) continue;
      corner_of[v] = static_cast<std::uint32_t>(solid_.corners_m.size());
      solid_.corners_m.push_back(at(v));
    }
    for (std::size_t s = 0; s < solid_.sides.size(); ++s) {
      Polyhedron::Side& side = solid_.sides[s];
      side.first = static_cast<std::uint32_t>(solid_.loops.size());
      if (next[s].empty()) return false;
      const std::uint32_t start = next[s].begin()->first;
      std::uint32_t v = start;
      std::size_t steps = 0;
      do {
        if (corner_of[v] != none) solid_.loops.push_back(corner_of[v]);
        const auto onwards = next[s].find(v);
        if (onwards == next[s].end() || ++steps > next[s].size()) return false;
        v = onwards->second;
      } while (v != start);
      side.count = static_cast<std::uint32_t>(solid_.loops.size()) - side.first;
      if (steps != next[s].size() || side.count < 3) return false;
      for (const Vector3d& corner : solid_.corners_m) side.level_m = std::max(side.level_m, side.normal.dot(corner));
    }
    return true;
  }

  bool find_ridges() {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> side_at;
    for (std::uint32_t s = 0; s < solid_.sides.size(); ++s) {
      const auto loop = solid_.corners_of(solid_.sides[s]);
      for (std::size_t k = 0; k < loop.size(); ++k) {
        if (!side_at.try_emplace({loop[k], loop[(k + 1) % loop.size()]}, s).second) return false;
      }
    }
    for (const auto& [edge, side] : side_at) {
      const auto other = side_at.find({edge.second, edge.first});
      if (other == side_at.end()) return false;
      if (edge.first < edge.second) solid_.ridges.push_back({{edge.first, edge.second}, {side, other->second}});
    }
    // Euler's formula, of one solid without holes.
    return solid_.corners_m.size() + solid_.sides.size() == solid_.ridges.size() + 2;
  }

  static constexpr std::uint32_t none = 0xffffffffU;
  const Mesh& mesh_;
  double tolerance_m_;
  Polyhedron solid_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> face_of_;  // by an edge in its direction
  std::vector<std::uint32_t> side_of_;                                        // one a face of the mesh
};

double height_m(const Polyhedron::Side& side, const Vector3d& point) {
  return side.normal.dot(point) - side.level_m;
}

bool is_over(const Polyhedron& solid, const Polyhedron::Side& side, const Vector3d& point) {
  const auto loop = solid.corners_of(side);
  const Vector3d* from = &solid.corners_m[loop.back()];
  for (const std::uint32_t corner : loop) {
    const Vector3d& to = solid.corners_m[corner];
    if (side.normal.dot((to - *from).cross(point - *from)) < 0.0) return false;
    from = &to;
  }
  return true;
}

PolyhedronPoint point_on(const Polyhedron::Side& side, const Vector3d& point) {
  const double distance_m = height_m(side, point);
  return {distance_m, side.normal, point - distance_m * side.normal};
}

}  // namespace

base::Result<std::shared_ptr<const Polyhedron>> make_polyhedron(const Mesh& mesh) {
  return Maker(mesh).make();
}

// From inside, the nearest of the planes is the nearest of the surface. From outside, a foot within a face that the
// point sees is the nearest point of the whole solid; where there is none, the nearest point is on an edge.
PolyhedronPoint nearest_point(const Polyhedron& solid, const Vector3d& point_m) {
  const auto highest =
      std::ranges::max_element(solid.sides, {}, [&](const Polyhedron::Side& side) { return height_m(side, point_m); });
  PolyhedronPoint nearest = point_on(*highest, point_m);
  if (nearest.distance_m <= 0.0 || is_over(solid, *highest, point_m)) return nearest;
  for (const Polyhedron::Side& side : solid.sides) {
    if (height_m(side, point_m) > 0.0 && is_over(solid, side, point_m)) return point_on(side, point_m);
  }
  double least = std::numeric_limits<double>::infinity();
  for (const Polyhedron::Ridge& ridge : solid.ridges) {
    const Vector3d& from = solid.corners_m[ridge.corners[0]];
    const Vector3d way = solid.corners_m[ridge.corners[1]] - from;
    const Vector3d at = from + std::clamp((point_m - from).dot(way) / way.squaredNorm(), 0.0, 1.0) * way;
    const double squared = (point_m - at).squaredNorm();
    if (squared >= least) continue;
    least = squared;
    nearest.position_m = at;
  }
  nearest.distance_m = std::sqrt(least);
  // So near to an edge, round-off says nothing of the direction; the face does.
  if (nearest.distance_m > touching_radius_share * solid.radius_m) {
    nearest.normal = (point_m - nearest.position_m) / nearest.distance_m;
  }
  return nearest;
}

// The distance to a convex solid is convex along a line. So Newton's steps come to its root from outside, and never
// past it.
std::optional<double> enter_polyhedron(const Polyhedron& solid, const Vector3d& start_m, const Vector3d& way_m,
                                       double distance_m) {
  double share = 0.0;
  for (int step = 0; step < entering_steps_max; ++step) {
    const PolyhedronPoint nearest = nearest_point(solid, start_m + share * way_m);
    const double slope = nearest.normal.dot(way_m);
    if (!(slope < 0.0)) return std::nullopt;
    const double over_m = nearest.distance_m - distance_m;
    if (over_m <= touching_radius_share * solid.radius_m) break;
    share -= over_m / slope;
    if (share > 1.0) return std::nullopt;
  }
  return share;
}

std::optional<double> hit_polyhedron_m(const Ray& ray, const Polyhedron& solid) {
  const Vector3d direction = ray.direction.stableNormalized();
  if (direction.isZero(0.0)) return std::nullopt;
  double enter_m = -std::numeric_limits<double>::infinity();
  double leave_m = std::numeric_limits<double>::infinity();
  for (const Polyhedron::Side& side : solid.sides) {
    const double over_m = height_m(side, ray.origin_m);
    const double climb = side.normal.dot(direction);
    if (climb == 0.0) {
      if (over_m > 0.0) return std::nullopt;
    } else if (climb < 0.0) {
      enter_m = std::max(enter_m, -over_m / climb);
    } else {
      leave_m = std::min(leave_m, -over_m / climb);
    }
  }
  if (!(enter_m <= leave_m) || !(leave_m >= 0.0)) return std::nullopt;
  return enter_m >= 0.0 ? enter_m : leave_m;
}

}  // namespace pneuma::physics
