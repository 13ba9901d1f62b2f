#include "physics/state/origin.h"

#include <cmath>
#include <type_traits>

#include "physics/state/bounds.h"

namespace pneuma::physics {

namespace {

// How many of its lengths a body may be from its origin: seldom moved, it still has 21 of the 24 bits for itself.
constexpr double lengths_max = 4.0;
// Half the body's extent over its distance. Up to 0.43 every coordinate is within a factor of two of the step taken,
// and their difference is exact (Sterbenz).
constexpr double half_extent_max = 0.4;

double lattice_edge_m(double length_m) {
  int exponent = 0;
  (void)std::frexp(length_m, &exponent);
  return std::ldexp(1.0, exponent);
}

}  // namespace

Vec3d origin_near(const Vec3d& centre_m, double length_m) {
  const double edge_m = lattice_edge_m(length_m);
  return edge_m * (centre_m / edge_m).array().round().matrix();
}

template <class Real>
void recentre(SoftState<Real>& body) {
  if constexpr (std::is_same_v<Real, float>) {
    const double far_m = lengths_max * lattice_edge_m(static_cast<double>(body.length_m));
    // No vertex is as far as that, nor then the centre: most bodies, most of the time.
    const Eigen::Map<const Eigen::ArrayXf> numbers(body.x.data()->data(), static_cast<Eigen::Index>(3 * body.x.size()));
    if (static_cast<double>(numbers.abs().maxCoeff()) <= far_m) return;
    const Aabb<Real> box = fit_aabb<Real>(body.x);
    const Vec3d low = box.min.template cast<double>();
    const Vec3d high = box.max.template cast<double>();
    const Vec3d centre = 0.5 * (low + high);
    const Vec3<Real> nearest = origin_near(centre, static_cast<double>(body.length_m)).cast<Real>();
    Vec3<Real> step = Vec3<Real>::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const double off_m = std::abs(centre[axis]);
      const bool is_exact = 0.5 * (high[axis] - low[axis]) <= half_extent_max * off_m;
      if (off_m > far_m && is_exact) step[axis] = nearest[axis];
    }
    if (step.isZero(0)) return;
    body.origin_m += step.template cast<double>();
    for (Vec3<Real>& x : body.x) x -= step;
    for (Vec3<Real>& place : body.place) place -= step;
    for (Vec3<Real>& place : body.near_place) place -= step;
  }
}

template void recentre<float>(SoftState<float>&);
template void recentre<double>(SoftState<double>&);

}  // namespace pneuma::physics
