// On which side of a plane through three points a fourth lies, without rounding.
#pragma once

#include <Eigen/Core>

namespace pneuma::support {

/// Past this magnitude a coordinate's products could overflow or underflow unseen.
inline constexpr double exact_coordinate_max_m = 1e100;

/// The sign of ((b - a) x (c - a)) . (d - a): 1 where d is on the side that the normal of a, b, c points to, -1 on the
/// other side, 0 in the plane. 0 too where a, b and c are on a line. Exact for all coordinates that are finite and
/// within exact_coordinate_max_m.
[[nodiscard]] int orientation(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m, const Eigen::Vector3d& c_m,
                              const Eigen::Vector3d& d_m);

}  // namespace pneuma::support
