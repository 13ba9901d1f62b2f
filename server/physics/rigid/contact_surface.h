// What happens where two surfaces meet: their common coefficients, and the change of velocity.
#pragma once

#include <algorithm>

#include "physics/scene/scene.h"

namespace pneuma::physics {

/// Restitution and friction where two surfaces meet: the larger restitution, the geometric mean of the frictions;
/// where only one surface states a value, that one; where none does, 0.
struct ContactSurface {
  double restitution = 0.0;
  double friction = 0.0;
  double thickness_m = 0.0;  // of both together
};
[[nodiscard]] ContactSurface combine(const Surface& a, const Surface& b);

// An approach slower than this many substeps of gravity ends at rest: with 1 the last, round-off sized bounces would go
// on, and 2 g dt is 4 cm/s at 480 substeps a second, a bounce of 0.1 mm.
inline constexpr double resting_substeps = 2.0;
// Of the body's length. What began the substep this near is in contact. If its body as a whole does not approach
// either, it is pressed by the body's own forces: it does not hit, and so it does not bounce.
inline constexpr double touching_share = 1e-9;
// Of the body's length. A point at rest is set on the surface and lies within round-off of it; only what is deeper
// counts as in the solid.
inline constexpr double skin_share = 1e-10;

/// The approach speed (<= 0) that restitution acts on; 0 for what rests or is pressed. `normal_m_s` <= 0: at the end of
/// the substep; `gained_m_s`: how much of it gravity added after the impact.
[[nodiscard]] double impact_speed(double normal_m_s, double gained_m_s, double resting_m_s);

/// The impulse (N s) that contact gives to the first of two things that meet, the second gets its opposite: restitution
/// along the normal, then Coulomb's share of what stops the sliding. `by_impulse(n)` is the change of `relative_m_s`,
/// the velocity of the first seen from the second, by an impulse: linear and symmetric. With a restitution of at most 1
/// neither part adds energy. Nothing where the two do not give way along the normal.
template <class ByImpulse>
[[nodiscard]] Vec3d contact_impulse(const Vec3d& relative_m_s, const Vec3d& normal, double impact_m_s,
                                    const ContactSurface& surface, const ByImpulse& by_impulse) {
  const double approach_m_s = relative_m_s.dot(normal);
  if (approach_m_s >= 0.0) return Vec3d::Zero();
  const Vec3d by_normal = by_impulse(normal);
  if (!(by_normal.dot(normal) > 0.0)) return Vec3d::Zero();  // neither gives way
  const double normal_n_s = (-surface.restitution * impact_m_s - approach_m_s) / by_normal.dot(normal);
  const Vec3d pressed = relative_m_s + normal_n_s * by_normal;
  const Vec3d sliding = pressed - pressed.dot(normal) * normal;
  const double speed_m_s = sliding.norm();
  if (!(speed_m_s > 0.0)) return normal_n_s * normal;
  const Vec3d direction = sliding / speed_m_s;
  const double stopping_n_s = speed_m_s / direction.dot(by_impulse(direction));
  return normal_n_s * normal - std::min(stopping_n_s, surface.friction * normal_n_s) * direction;
}

/// What turning adds to the inverse mass at the end of `arm` of a body that turns about the arm's start: [r]^T I^-1 [r]
/// with [r] y = r x y.
[[nodiscard]] Eigen::Matrix3d turning_inverse_mass(const Vec3d& arm, const Eigen::Matrix3d& inverse_inertia_1_kg_m2);

}  // namespace pneuma::physics
