// Bending: springs on the angle between neighbouring faces. The discrete shells energy of Grinspun, Hirani, Desbrun and
// Schroeder ("Discrete Shells", 2003, section 3), halved as a spring's is:
//   W = k/2 sum over inner edges of 3 |e|^2 / (A1 + A2) (theta - theta_rest)^2,  lengths and areas of the rest shape.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "physics/mesh/mesh.h"

namespace pneuma::physics {

inline constexpr std::uint32_t no_vertex = std::numeric_limits<std::uint32_t>::max();

/// Of each edge (a, b) of the mesh: the third vertices of the face that runs from a to b and of the one that runs back;
/// no_vertex where the mesh is open.
[[nodiscard]] std::vector<std::array<std::uint32_t, 2>> opposite_vertices(const Mesh& mesh);

struct Hinge {
  std::array<std::uint32_t, 4> vertices{};  // the edge's two, then the opposite two
  double rest_angle_rad = 0.0;              // 0 where the faces are in one plane
  double weight = 0.0;                      // 3 |e|^2 / (A1 + A2)
};

/// One a pair of faces that share an edge, in the order of the edges.
[[nodiscard]] std::vector<Hinge> make_hinges(const Mesh& mesh);

struct HingeAngle {
  double angle_rad = 0.0;
  std::array<Eigen::Vector3d, 4> gradient{};  // rad/m, in the order of the vertices; they sum to 0
};

/// Nothing where a face has no area. Gradients after Bridson, Marino and Fedkiw, "Simulation of Clothing with Folds and
/// Wrinkles" (2003).
[[nodiscard]] std::optional<HingeAngle> hinge_angle(const std::array<Eigen::Vector3d, 4>& corners_m);

/// The angle past rest, between -pi and pi.
[[nodiscard]] double bend_rad(const Hinge& hinge, const HingeAngle& angle);

/// Adds -grad W at positions x. `Real` is float or double; the sums of a hinge are in double.
template <class Real>
void add_bending(std::span<const Hinge> hinges, double stiffness_n_m, std::span<const Eigen::Matrix<Real, 3, 1>> x,
                 std::span<Eigen::Matrix<Real, 3, 1>> force);

[[nodiscard]] double bending_energy_j(std::span<const Hinge> hinges, double stiffness_n_m,
                                      std::span<const Eigen::Vector3d> x);

}  // namespace pneuma::physics
