// Whether surfaces have gone through each other: an oracle for tests of contact. It shares no arithmetic with the
// contact that it judges, and whether two triangles cross is decided without rounding.
//
// Two triangles cross if an inner point of one is an inner point of the other and they are not in one plane. All other
// meetings are touches, and do not count:
//   - a vertex or an edge that ends in the other triangle, or lies in it;
//   - an edge that meets an edge in one point, with both triangles ending there;
//   - triangles in one plane, overlapping or not.
// A triangle of zero area crosses nothing: it has no inner points.
//
// Surfaces that go through each other have a pair of triangles that cross, with one exception: all that they have in
// common lies on edges or in planes of both. Two equal meshes in one place are an example. Another is a box pushed into
// an equal box along an axis. count_inside is no help there, as the vertices lie on the surface: place bodies askew.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include <Eigen/Core>

namespace pneuma::support {

using Triangle = std::array<Eigen::Vector3d, 3>;  // positions in metres

/// A view of positions and faces kept elsewhere.
/// The functions below throw std::invalid_argument for a coordinate that is not finite or past exact_coordinate_max_m,
/// and for an index without a vertex. A mesh of NaN would cross nothing, and a test would pass.
struct TriangleMesh {
  std::span<const Eigen::Vector3d> positions_m;
  std::span<const std::array<std::uint32_t, 3>> faces;  // counter-clockwise seen from outside
};

/// As above; exact for coordinates that are finite and within exact_coordinate_max_m.
[[nodiscard]] bool crosses(const Triangle& a_m, const Triangle& b_m);

/// The pairs of a face of a and a face of b that cross.
[[nodiscard]] std::size_t count_crossings(const TriangleMesh& a, const TriangleMesh& b);
/// The pairs of faces of one mesh that have no vertex in common and cross.
[[nodiscard]] std::size_t count_self_crossings(const TriangleMesh& mesh);

/// Whether a closed mesh winds around the point more than half a time. The winding number is the sum of its faces'
/// solid angles over 4 pi (Van Oosterom and Strackee 1983). This one is rounded: a point on the surface may be either.
/// False in a mesh that is inside out.
[[nodiscard]] bool is_inside(const Eigen::Vector3d& point_m, const TriangleMesh& closed);
/// The positions of a that are inside of the closed mesh b.
[[nodiscard]] std::size_t count_inside(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace pneuma::support
