#include "physics/rigid/rigid_mass.h"

#include <algorithm>

namespace pneuma::physics {
namespace {

bool any_of(const std::array<bool, 3>& locked) {
  return locked[0] || locked[1] || locked[2];
}

Vec3d capsule_inertia_kg_m2(const CapsuleShape& capsule, double mass_kg) {
  const double r = capsule.radius_m;
  const double h = capsule.half_height_m;
  const double middle_kg = mass_kg * 2.0 * h / (2.0 * h + 4.0 / 3.0 * r);
  const double ends_kg = mass_kg - middle_kg;
  const double along = (0.5 * middle_kg + 0.4 * ends_kg) * r * r;
  // A half ball's centre of mass is 3/8 r from its flat side.
  const double across = middle_kg * (0.25 * r * r + h * h / 3.0) + ends_kg * (0.4 * r * r + h * h + 0.75 * h * r);
  return {across, along, across};
}

}  // namespace

Vec3d principal_inertia_kg_m2(const Shape& shape, double mass_kg) {
  if (const auto* sphere = std::get_if<SphereShape>(&shape)) {
    return Vec3d::Constant(0.4 * mass_kg * sphere->radius_m * sphere->radius_m);
  }
  if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) return capsule_inertia_kg_m2(*capsule, mass_kg);
  const Vec3d squares = std::get<BoxShape>(shape).half_extents_m.cwiseAbs2();
  return mass_kg / 3.0 * (Vec3d::Constant(squares.sum()) - squares);
}

double inverse_mass_along_1_kg(const RigidState& body, const Vec3d& direction) {
  if (!any_of(body.body.locked.translation)) return body.inverse_mass_1_kg;
  return inverse_masses_1_kg(body).cwiseProduct(direction).dot(direction);
}

// Not the free part of the whole inverse: that would let the body turn as if nothing held it about the locked axes.
Eigen::Matrix3d inverse_inertia_1_kg_m2(const RigidState& body) {
  const std::array<bool, 3>& locked = body.body.locked.rotation;
  const Eigen::Matrix3d rotation = body.orientation.toRotationMatrix();
  if (!any_of(locked)) return rotation * body.inverse_inertia_1_kg_m2.asDiagonal() * rotation.transpose();
  const Eigen::Matrix3d inertia =
      rotation * body.inverse_inertia_1_kg_m2.cwiseInverse().asDiagonal() * rotation.transpose();
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();
  const auto free = std::ranges::count(locked, false);
  const Eigen::Index a = !locked[0] ? 0 : !locked[1] ? 1 : 2;
  if (free == 1) inverse(a, a) = 1.0 / inertia(a, a);
  if (free == 2) {
    const Eigen::Index b = !locked[2] ? 2 : 1;
    const double determinant = inertia(a, a) * inertia(b, b) - inertia(a, b) * inertia(a, b);
    inverse(a, a) = inertia(b, b) / determinant;
    inverse(b, b) = inertia(a, a) / determinant;
    inverse(a, b) = inverse(b, a) = -inertia(a, b) / determinant;
  }
  return inverse;
}

Vec3d inverse_inertia_times(const RigidState& body, const Vec3d& x) {
  if (any_of(body.body.locked.rotation)) return inverse_inertia_1_kg_m2(body) * x;
  return body.orientation * body.inverse_inertia_1_kg_m2.cwiseProduct(body.orientation.conjugate() * x);
}

}  // namespace pneuma::physics
