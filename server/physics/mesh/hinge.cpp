#include "physics/mesh/hinge.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "physics/machine/portable_math.h"

namespace pneuma::physics {

namespace {

using Eigen::Vector3d;

// Of the edge's fourth power: below it the height of a face, and with it the direction of its normal, is rounding.
constexpr double normal_min_relative = 1e-16;

template <class Point>
std::array<Vector3d, 4> corners(const Hinge& hinge, std::span<const Point> x) {
  std::array<Vector3d, 4> result;
  for (std::size_t i = 0; i < 4; ++i) result[i] = x[hinge.vertices[i]].template cast<double>();
  return result;
}

}  // namespace

std::vector<std::array<std::uint32_t, 2>> opposite_vertices(const Mesh& mesh) {
  std::vector<std::array<std::uint32_t, 2>> opposite(mesh.edges.size(), {no_vertex, no_vertex});
  for (const Face& face : mesh.faces) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t from = face[corner];
      const std::uint32_t to = face[(corner + 1) % 3];
      const Edge edge{std::min(from, to), std::max(from, to)};
      const auto place = std::ranges::lower_bound(mesh.edges, edge) - mesh.edges.begin();
      opposite[static_cast<std::size_t>(place)][from < to ? 0 : 1] = face[(corner + 2) % 3];
    }
  }
  return opposite;
}

std::vector<Hinge> make_hinges(const Mesh& mesh) {
  const std::vector<std::array<std::uint32_t, 2>> opposite = opposite_vertices(mesh);
  std::vector<Hinge> hinges;
  for (std::size_t i = 0; i < mesh.edges.size(); ++i) {
    const auto [c, d] = opposite[i];
    if (c == no_vertex || d == no_vertex) continue;
    const auto [a, b] = mesh.edges[i];
    Hinge hinge{{a, b, c, d}};
    const std::array<Vector3d, 4> x = corners<Vector3d>(hinge, mesh.positions_m);
    const Vector3d along = x[1] - x[0];
    const double areas_m2 = 0.5 * (along.cross(x[2] - x[0]).norm() + along.cross(x[3] - x[0]).norm());
    hinge.weight = 3.0 * along.squaredNorm() / areas_m2;
    if (const auto angle = hinge_angle(x)) hinge.rest_angle_rad = angle->angle_rad;
    hinges.push_back(hinge);
  }
  return hinges;
}

std::optional<HingeAngle> hinge_angle(const std::array<Vector3d, 4>& x) {
  const Vector3d along = x[1] - x[0];
  const Vector3d to_c = x[2] - x[0];
  const Vector3d to_d = x[3] - x[0];
  const Vector3d normal_c = along.cross(to_c);
  const Vector3d normal_d = to_d.cross(along);
  const double along2 = along.squaredNorm();
  const double floor = normal_min_relative * along2 * along2;
  if (!(normal_c.squaredNorm() > floor) || !(normal_d.squaredNorm() > floor)) return std::nullopt;
  const double length = std::sqrt(along2);
  HingeAngle result;
  result.angle_rad = portable_atan2(normal_c.cross(normal_d).dot(along) / length, normal_c.dot(normal_d));
  // Each opposite vertex turns its face about the edge; the edge's vertices answer as a lever does.
  const Vector3d turn_c = -(length / normal_c.squaredNorm()) * normal_c;
  const Vector3d turn_d = -(length / normal_d.squaredNorm()) * normal_d;
  const double share_c = to_c.dot(along) / along2;
  const double share_d = to_d.dot(along) / along2;
  result.gradient = {-(1.0 - share_c) * turn_c - (1.0 - share_d) * turn_d, -share_c * turn_c - share_d * turn_d, turn_c,
                     turn_d};
  return result;
}

double bend_rad(const Hinge& hinge, const HingeAngle& angle) {
  return std::remainder(angle.angle_rad - hinge.rest_angle_rad, 2.0 * std::numbers::pi);
}

template <class Real>
void add_bending(std::span<const Hinge> hinges, double stiffness_n_m, std::span<const Eigen::Matrix<Real, 3, 1>> x,
                 std::span<Eigen::Matrix<Real, 3, 1>> force) {
  for (const Hinge& hinge : hinges) {
    const auto angle = hinge_angle(corners(hinge, x));
    if (!angle) continue;
    const double moment_n_m = stiffness_n_m * hinge.weight * bend_rad(hinge, *angle);
    for (std::size_t i = 0; i < 4; ++i) {
      force[hinge.vertices[i]] -= (moment_n_m * angle->gradient[i]).template cast<Real>();
    }
  }
}

double bending_energy_j(std::span<const Hinge> hinges, double stiffness_n_m, std::span<const Vector3d> x) {
  double energy_j = 0.0;
  for (const Hinge& hinge : hinges) {
    const auto angle = hinge_angle(corners(hinge, x));
    if (!angle) continue;
    const double bend = bend_rad(hinge, *angle);
    energy_j += 0.5 * stiffness_n_m * hinge.weight * bend * bend;
  }
  return energy_j;
}

template void add_bending<float>(std::span<const Hinge>, double, std::span<const Eigen::Vector3f>,
                                 std::span<Eigen::Vector3f>);
template void add_bending<double>(std::span<const Hinge>, double, std::span<const Vector3d>, std::span<Vector3d>);

}  // namespace pneuma::physics
