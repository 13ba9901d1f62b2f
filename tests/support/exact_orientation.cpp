#include "support/exact_orientation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include <Eigen/Geometry>
#include <boost/multiprecision/cpp_int.hpp>

namespace pneuma::support {
namespace {

using Integer = boost::multiprecision::cpp_int;
using IntegerVector = std::array<Integer, 3>;

constexpr int fraction_bits = std::numeric_limits<double>::digits - 1;

/// How many units of 2^exponent: a whole number, as `exponent` is that of the last bit of the finest coordinate.
Integer units(double value, int exponent) {
  if (value == 0.0) return 0;
  const int last_bit = std::ilogb(value) - fraction_bits;
  return Integer(static_cast<std::int64_t>(std::ldexp(value, -last_bit))) << (last_bit - exponent);
}

int orientation_in_integers(const std::array<Eigen::Vector3d, 4>& points_m) {
  int exponent = std::numeric_limits<int>::max();
  for (const Eigen::Vector3d& point : points_m) {
    for (const double value : point) {
      if (value != 0.0) exponent = std::min(exponent, std::ilogb(value) - fraction_bits);
    }
  }
  const auto from_first = [&](std::size_t i) {
    IntegerVector difference;
    for (int axis = 0; axis < 3; ++axis) {
      difference[static_cast<std::size_t>(axis)] =
          units(points_m[i][axis], exponent) - units(points_m[0][axis], exponent);
    }
    return difference;
  };
  const IntegerVector u = from_first(1);
  const IntegerVector v = from_first(2);
  const IntegerVector w = from_first(3);
  const Integer volume =
      w[0] * (u[1] * v[2] - u[2] * v[1]) + w[1] * (u[2] * v[0] - u[0] * v[2]) + w[2] * (u[0] * v[1] - u[1] * v[0]);
  return volume.sign();
}

}  // namespace

int orientation(const Eigen::Vector3d& a_m, const Eigen::Vector3d& b_m, const Eigen::Vector3d& c_m,
                const Eigen::Vector3d& d_m) {
  const Eigen::Vector3d u = b_m - a_m;
  const Eigen::Vector3d v = c_m - a_m;
  const Eigen::Vector3d w = d_m - a_m;
  const double volume = u.cross(v).dot(w);
  const Eigen::Vector3d terms(std::abs(u[1] * v[2]) + std::abs(u[2] * v[1]),
                              std::abs(u[2] * v[0]) + std::abs(u[0] * v[2]),
                              std::abs(u[0] * v[1]) + std::abs(u[1] * v[0]));
  const double permanent = terms.dot(w.cwiseAbs());
  // Rounding is off by no more than (7 + 56 e) e of the permanent, e = 2^-53 (Shewchuk 1997, "Adaptive precision
  // floating-point arithmetic and fast robust geometric predicates", section 4.3). What 8 e leaves over covers products
  // that underflow: they lose up to 2e100 * 6 * 2^-1075, far less than e * 1e-200.
  constexpr double relative_error = 4.0 * std::numeric_limits<double>::epsilon();
  constexpr double permanent_min = 1e-200;
  if (permanent > permanent_min && std::abs(volume) > relative_error * permanent) return volume > 0.0 ? 1 : -1;
  return orientation_in_integers({a_m, b_m, c_m, d_m});
}

}  // namespace pneuma::support
