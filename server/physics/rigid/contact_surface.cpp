#include "physics/rigid/contact_surface.h"

#include <algorithm>
#include <cmath>

namespace pneuma::physics {

ContactSurface combine(const Surface& a, const Surface& b) {
  ContactSurface both;
  both.restitution = std::max(a.restitution.value_or(0.0), b.restitution.value_or(0.0));
  both.friction =
      a.friction && b.friction ? std::sqrt(*a.friction * *b.friction) : a.friction.value_or(b.friction.value_or(0.0));
  both.thickness_m = a.thickness_m + b.thickness_m;
  return both;
}

double impact_speed(double normal_m_s, double gained_m_s, double resting_m_s) {
  const double impact_m_s = normal_m_s - gained_m_s;
  return impact_m_s < -resting_m_s ? impact_m_s : 0.0;
}

// The paper (section 3.5) splits the velocity into a part "parallel and [a part] tangent to collision surface" and
// reflects the tangent one. What bounces is the part along the normal, so that is the one reflected here, and
// restitution is its scalar; the tangential part's scalar is Coulomb's, so that a slope holds what rests on it if and
// only if tan(slope) <= friction.
Vec3d respond(const Vec3d& relative_m_s, const Vec3d& normal, double impact_m_s, const ContactSurface& surface) {
  const double approach_m_s = normal.dot(relative_m_s);
  if (approach_m_s >= 0.0) return relative_m_s;
  const double away_m_s = -surface.restitution * impact_m_s;
  const Vec3d tangential = relative_m_s - approach_m_s * normal;
  const double speed_m_s = tangential.norm();
  const double taken_m_s = surface.friction * (away_m_s - approach_m_s);
  const double scale = taken_m_s < speed_m_s ? 1.0 - taken_m_s / speed_m_s : 0.0;
  return away_m_s * normal + scale * tangential;
}

Eigen::Matrix3d turning_inverse_mass(const Vec3d& arm, const Eigen::Matrix3d& inverse_inertia_1_kg_m2) {
  Eigen::Matrix3d cross;
  cross << 0.0, -arm.z(), arm.y(), arm.z(), 0.0, -arm.x(), -arm.y(), arm.x(), 0.0;
  return cross.transpose() * inverse_inertia_1_kg_m2 * cross;
}

}  // namespace pneuma::physics
