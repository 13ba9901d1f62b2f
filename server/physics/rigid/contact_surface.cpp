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

Eigen::Matrix3d turning_inverse_mass(const Vec3d& arm, const Eigen::Matrix3d& inverse_inertia_1_kg_m2) {
  Eigen::Matrix3d cross;
  cross << 0.0, -arm.z(), arm.y(), arm.z(), 0.0, -arm.x(), -arm.y(), arm.x(), 0.0;
  return cross.transpose() * inverse_inertia_1_kg_m2 * cross;
}

}  // namespace pneuma::physics
