#include "physics/state/bounds.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace pneuma::physics {

template <class Real>
Aabb<Real> fit_aabb(std::span<const Vec3<Real>> points) {
  assert(!points.empty());
  Aabb<Real> box{points[0], points[0]};
  for (const Vec3<Real>& p : points) {
    for (int k = 0; k < 3; ++k) {
      box.min[k] = p[k] < box.min[k] ? p[k] : box.min[k];
      box.max[k] = p[k] > box.max[k] ? p[k] : box.max[k];
    }
  }
  return box;
}

template <class Real>
Ball<Real> fit_ball(std::span<const Vec3<Real>> points) {
  assert(!points.empty());
  Vec3<Real> sum = Vec3<Real>::Zero();
  for (const Vec3<Real>& p : points) sum += p;
  const Vec3<Real> centre = sum / static_cast<Real>(points.size());
  Real furthest = 0;
  for (const Vec3<Real>& p : points) furthest = std::max(furthest, (p - centre).squaredNorm());
  return {centre, std::sqrt(furthest)};
}

template <class Real>
Ellipsoid<Real> fit_ellipsoid(std::span<const Vec3<Real>> points) {
  const Aabb<Real> box = fit_aabb(points);
  return {Real(0.5) * (box.min + box.max), Real(0.5) * (box.max - box.min)};
}

template <class Real>
Real volume_m3(const Aabb<Real>& box) {
  return (box.max - box.min).prod();
}

template <class Real>
Real volume_m3(const Ball<Real>& ball) {
  return Real(4) / Real(3) * std::numbers::pi_v<Real> * ball.radius_m * ball.radius_m * ball.radius_m;
}

// The paper's equation 6.
template <class Real>
Real volume_m3(const Ellipsoid<Real>& ellipsoid) {
  return Real(4) / Real(3) * std::numbers::pi_v<Real> * ellipsoid.radii_m.prod();
}

template Aabb<float> fit_aabb(std::span<const Vec3<float>>);
template Aabb<double> fit_aabb(std::span<const Vec3<double>>);
template Ball<float> fit_ball(std::span<const Vec3<float>>);
template Ball<double> fit_ball(std::span<const Vec3<double>>);
template Ellipsoid<float> fit_ellipsoid(std::span<const Vec3<float>>);
template Ellipsoid<double> fit_ellipsoid(std::span<const Vec3<double>>);
template float volume_m3(const Aabb<float>&);
template double volume_m3(const Aabb<double>&);
template float volume_m3(const Ball<float>&);
template double volume_m3(const Ball<double>&);
template float volume_m3(const Ellipsoid<float>&);
template double volume_m3(const Ellipsoid<double>&);

}  // namespace pneuma::physics
