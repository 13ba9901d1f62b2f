// Bounding volumes of a cloud of points: the paper's way to measure a body and to meet another (sections 3.1, 3.5, Fig.
// 5).
#pragma once

#include <span>

#include "physics/state/state.h"

namespace pneuma::physics {

template <class Real>
struct Aabb {
  Vec3<Real> min = Vec3<Real>::Zero();
  Vec3<Real> max = Vec3<Real>::Zero();
};
/// Centre: the mean of the points; radius: to the furthest.
template <class Real>
struct Ball {
  Vec3<Real> centre;
  Real radius_m;
};
/// Inscribed in the axis-aligned box: its centre and half extents. Exact for a ball that is squeezed along an axis.
template <class Real>
struct Ellipsoid {
  Vec3<Real> centre = Vec3<Real>::Zero();
  Vec3<Real> radii_m = Vec3<Real>::Zero();
};

template <class Real>
[[nodiscard]] Aabb<Real> fit_aabb(std::span<const Vec3<Real>> points);
template <class Real>
[[nodiscard]] Ball<Real> fit_ball(std::span<const Vec3<Real>> points);
template <class Real>
[[nodiscard]] Ellipsoid<Real> fit_ellipsoid(std::span<const Vec3<Real>> points);

template <class Real>
[[nodiscard]] Real volume_m3(const Aabb<Real>& box);
template <class Real>
[[nodiscard]] Real volume_m3(const Ball<Real>& ball);
template <class Real>
[[nodiscard]] Real volume_m3(const Ellipsoid<Real>& ellipsoid);

}  // namespace pneuma::physics
