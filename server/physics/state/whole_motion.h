// A soft body's motion as a whole: that of the rigid body with its mass, momentum and angular momentum.
#pragma once

#include <cstddef>

#include <Eigen/Dense>

#include "physics/scene/shape.h"

namespace pneuma::physics {

struct WholeMotion {
  double mass_kg = 0.0;
  Vec3d centre = Vec3d::Zero();                             // of mass, m
  Vec3d velocity = Vec3d::Zero();                           // m/s
  Vec3d spin_kg_m2_s = Vec3d::Zero();                       // about the centre
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();  // about the centre
  // 0 of a body that lies on a line, about which nothing turns.
  Eigen::Matrix3d inverse_inertia_1_kg_m2 = Eigen::Matrix3d::Zero();

  [[nodiscard]] bool turns() const { return !inverse_inertia_1_kg_m2.isZero(0.0); }
  [[nodiscard]] Vec3d turning_rad_s() const { return inverse_inertia_1_kg_m2 * spin_kg_m2_s; }
  [[nodiscard]] Vec3d at(const Vec3d& place) const { return velocity_at(velocity, turning_rad_s(), place - centre); }
};

/// Of `count` particles, whose mass (kg), place (m) and velocity (m/s) are asked for by their index.
template <class Mass, class Place, class Velocity>
[[nodiscard]] WholeMotion whole_motion(std::size_t count, const Mass& mass_kg, const Place& place,
                                       const Velocity& velocity) {
  // Of the squares of the arms: a body with less about an axis lies along it.
  constexpr double turning_share_min = 1e-9;
  WholeMotion whole;
  for (std::size_t i = 0; i < count; ++i) {
    whole.mass_kg += mass_kg(i);
    whole.centre += mass_kg(i) * place(i);
    whole.velocity += mass_kg(i) * velocity(i);
  }
  whole.centre /= whole.mass_kg;
  whole.velocity /= whole.mass_kg;
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3d arm = place(i) - whole.centre;
    const Vec3d momentum = mass_kg(i) * (velocity(i) - whole.velocity);
    products += mass_kg(i) * arm * arm.transpose();
    whole.spin_kg_m2_s += arm.cross(momentum);
  }
  whole.inertia_kg_m2 = products.trace() * Eigen::Matrix3d::Identity() - products;
  const double size = whole.inertia_kg_m2.trace();
  if (whole.inertia_kg_m2.determinant() > turning_share_min * size * size * size) {
    whole.inverse_inertia_1_kg_m2 = whole.inertia_kg_m2.inverse();
  }
  return whole;
}

}  // namespace pneuma::physics
