// The energy that the contacts of a coupled step took.
#pragma once

#include "physics/contact/coupled_passes.h"

namespace pneuma::physics {

/// What a change of bodies' motion as wholes does: energy linear_j s + square_j s^2 for a share s of it.
struct GivenEnergy {
  double taken_j = 0.0;  // by contact, of all bodies: what may be given back
  double linear_j = 0.0;
  double square_j = 0.0;

  /// The largest that gives back no more than was taken.
  [[nodiscard]] double share_max() const;
};

/// About its centre of mass, in the world's axes.
[[nodiscard]] Eigen::Matrix3d inertia_kg_m2(const RigidState& rigid);

/// Of a collider, where the row touches it, m/s; 0 where the row's other side gives way, which drives nothing.
template <class Real>
[[nodiscard]] Vec3d driving_velocity(const ContactRow& row, const CoupledWorld<Real>& world,
                                     const CoupledPasses& passes);

/// What all bodies have less of after the passes than they had before the substep, with what colliders drove them by
/// (J). Below 0 where they have more.
template <class Real>
[[nodiscard]] double taken_energy_j(const CoupledWorld<Real>& world, const CoupledPasses& passes);

/// Of what is in contact, before the substep or after it, whichever is more (J).
template <class Real>
[[nodiscard]] double kinetic_energy_j(const CoupledWorld<Real>& world, const CoupledPasses& passes);

/// What lifts the soft bodies in contact by the distance that they keep (J).
template <class Real>
[[nodiscard]] double lift_energy_j(const CoupledWorld<Real>& world, const CoupledPasses& passes);

}  // namespace pneuma::physics
