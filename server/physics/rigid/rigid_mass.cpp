#include "physics/rigid/rigid_mass.h"

#include <algorithm>

#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

bool any_of(const std::array<bool, 3>& locked) {
  return locked[0] || locked[1] || locked[2];
}

}  // namespace

Vec3d principal_inertia_kg_m2(const Shape& shape, double mass_kg) {
  return of_rigid_shape(shape, Vec3d(Vec3d::Zero()), [&](const auto& rigid, const auto& one) {
    return rigid.principal_inertia_kg_m2(one, mass_kg);
  });
}

std::optional<Quatd> principal_axes(const Shape& shape) {
  return of_rigid_shape(shape, std::optional<Quatd>(),
                        [](const auto& rigid, const auto& one) { return rigid.principal_axes(one); });
}

double inverse_mass_along_1_kg(const RigidState& body, const Vec3d& direction) {
  if (!any_of(body.body.locked.translation)) return body.inverse_mass_1_kg;
  return inverse_masses_1_kg(body).cwiseProduct(direction).dot(direction);
}

// Not the free part of the whole inverse: that would let the body turn as if nothing held it about the locked axes.
Eigen::Matrix3d inverse_inertia_1_kg_m2(const RigidState& body) {
  const std::array<bool, 3>& locked = body.body.locked.rotation;
  const Eigen::Matrix3d rotation = principal_orientation(body).toRotationMatrix();
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
  const Quatd axes = principal_orientation(body);
  return axes * body.inverse_inertia_1_kg_m2.cwiseProduct(axes.conjugate() * x);
}

}  // namespace pneuma::physics
