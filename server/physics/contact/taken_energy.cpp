#include "physics/contact/taken_energy.h"

#include <algorithm>
#include <cmath>

#include "physics/forces/measures.h"
#include "physics/rigid/rigid_mass.h"

namespace pneuma::physics {
namespace {

template <class Real>
double taken_from_soft_j(std::size_t index, const CoupledWorld<Real>& world, const CoupledPasses& passes) {
  const CoupledBody& body = passes.bodies[index];
  const auto energy_j = [&](std::span<const Vec3d> x, std::span<const Vec3d> u) {
    double sum = potential_j(world.soft[index], {.x = x}, world.substep.surroundings);
    for (std::size_t i = 0; i < u.size(); ++i) sum += 0.5 * body.masses_kg()[i] * u[i].squaredNorm();
    return sum;
  };
  return energy_j(body.start, body.u0) - energy_j(passes.surface(index).from, body.u);
}

template <class Real>
double taken_from_rigid_j(std::size_t index, const CoupledWorld<Real>& world, const CoupledPasses& passes) {
  const RigidState& rigid = world.rigid[index];
  const Eigen::Matrix3d inertia = inertia_kg_m2(rigid);
  const auto kinetic_j = [&](const Vec3d& velocity, const Vec3d& turning) {
    return 0.5 * rigid.body.mass_kg * velocity.squaredNorm() + 0.5 * turning.dot(inertia * turning);
  };
  return kinetic_j(rigid.velocity, rigid.angular_velocity) -
         kinetic_j(passes.rigid_velocities_m_s[index], passes.rigid_turnings_rad_s[index]);
}

// Of a row between rigid bodies, or one and a collider, as they give way: what its impulse does to their energy is
// not the soft bodies'.
template <class Real>
Vec3d mean_velocity(const ContactRow& row, const CoupledWorld<Real>& world, const CoupledPasses& passes) {
  const auto at = [&](const Support& side) -> Vec3d {
    const std::size_t k = side.body - passes.bodies.size();
    if (k >= world.rigid.size()) return Vec3d::Zero();
    const RigidState& rigid = world.rigid[k];
    return velocity_at(Vec3d(0.5 * (rigid.velocity + passes.rigid_velocities_m_s[k])),
                       Vec3d(0.5 * (rigid.angular_velocity + passes.rigid_turnings_rad_s[k])), side.arm);
  };
  return at(row.first) - at(row.second);
}

}  // namespace

double GivenEnergy::share_max() const {
  const double allowed_j = std::max(0.0, taken_j);
  if (!(square_j > 0.0 && linear_j + square_j > allowed_j)) return 1.0;
  const double share = (-linear_j + std::sqrt(linear_j * linear_j + 4.0 * square_j * allowed_j)) / (2.0 * square_j);
  return std::clamp(share, 0.0, 1.0);
}

Eigen::Matrix3d inertia_kg_m2(const RigidState& rigid) {
  const Eigen::Matrix3d rotation = principal_orientation(rigid).toRotationMatrix();
  return rotation * rigid.inverse_inertia_1_kg_m2.cwiseInverse().asDiagonal() * rotation.transpose();
}

template <class Real>
Vec3d driving_velocity(const ContactRow& row, const CoupledWorld<Real>& world, const CoupledPasses& passes) {
  const std::size_t soft_count = passes.bodies.size();
  const std::size_t first = soft_count + world.rigid.size();
  if (row.second.body < first || row.second.body == soft_count + passes.solids.size()) return Vec3d::Zero();
  const SolidPlace& solid = passes.solids[row.second.body - soft_count];
  return velocity_at(solid.velocity, solid.angular_velocity, row.second.arm);
}

template <class Real>
double taken_energy_j(const CoupledWorld<Real>& world, const CoupledPasses& passes) {
  double sum_j = 0.0;
  for (std::size_t i = 0; i < passes.bodies.size(); ++i) {
    if (passes.bodies[i].in_contact && passes.bodies[i].is_free) sum_j += taken_from_soft_j(i, world, passes);
  }
  for (std::size_t k = 0; k < world.rigid.size(); ++k) sum_j += taken_from_rigid_j(k, world, passes);
  for (const ContactRow& row : passes.rows) {
    const bool is_rigid = row.first.body >= passes.bodies.size();
    sum_j += row.impulse_n_s.dot(is_rigid ? mean_velocity(row, world, passes) : driving_velocity(row, world, passes));
  }
  return sum_j;
}

template <class Real>
double kinetic_energy_j(const CoupledWorld<Real>& world, const CoupledPasses& passes) {
  double sum_j = 0.0;
  for (std::size_t i = 0; i < passes.bodies.size(); ++i) {
    const CoupledBody& body = passes.bodies[i];
    if (!body.in_contact) continue;
    for (std::size_t k = 0; k < body.u.size(); ++k) {
      sum_j += 0.5 * world.soft[i].mass_kg(k) * std::max(body.u0[k].squaredNorm(), body.u[k].squaredNorm());
    }
  }
  for (std::size_t k = 0; k < world.rigid.size(); ++k) {
    const Vec3d& before_m_s = world.rigid[k].velocity;
    const Vec3d& after_m_s = passes.rigid_velocities_m_s[k];
    if (before_m_s == after_m_s) continue;
    sum_j += 0.5 * world.rigid[k].body.mass_kg * std::max(before_m_s.squaredNorm(), after_m_s.squaredNorm());
  }
  return sum_j;
}

template <class Real>
double lift_energy_j(const CoupledWorld<Real>& world, const CoupledPasses& passes) {
  double sum_j = 0.0;
  for (std::size_t i = 0; i < passes.bodies.size(); ++i) {
    if (!passes.bodies[i].in_contact) continue;
    sum_j += passes.surface(i).shell_m * world.soft[i].body.mass_kg * world.substep.surroundings.gravity.norm();
  }
  return sum_j;
}

#define PNEUMA_INSTANTIATE(Real)                                                                       \
  template Vec3d driving_velocity(const ContactRow&, const CoupledWorld<Real>&, const CoupledPasses&); \
  template double taken_energy_j(const CoupledWorld<Real>&, const CoupledPasses&);                     \
  template double kinetic_energy_j(const CoupledWorld<Real>&, const CoupledPasses&);                   \
  template double lift_energy_j(const CoupledWorld<Real>&, const CoupledPasses&);
PNEUMA_INSTANTIATE(float)
PNEUMA_INSTANTIATE(double)
#undef PNEUMA_INSTANTIATE

}  // namespace pneuma::physics
