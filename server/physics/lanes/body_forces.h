// The forces on one body at any places and velocities, for the methods that solve for where a substep ends.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "physics/lanes/lane_step.h"

namespace pneuma::physics {

/// Springs and gas by the lane kernels' ring pass, in the scalar that the body steps in; what they do not know by
/// forces/force_terms.h. Room for one body at a time.
template <class Real>
class BodyForces {
 public:
  /// Leaves the body's volume and pressure at what they are at x. A grab may be as stiff as it was asked to be.
  void evaluate(SoftState<Real>& body, const LaneTables<Real>& lanes, const SubstepContext& context,
                std::span<const Vec3d> x, std::span<const Vec3d> v);

  // Of the last evaluation; 0 on pinned particles.
  [[nodiscard]] std::span<const Vec3d> force_n() const { return force_; }
  [[nodiscard]] std::span<const Vec3d> volume_gradient_m2() const { return volume_gradient_; }  // empty without gas

  [[nodiscard]] std::size_t bytes() const;

 private:
  void pass_over_rings(SoftState<Real>& body, const LaneTables<Real>& lanes, bool gas, std::span<const Vec3d> x,
                       std::span<const Vec3d> v, const Vec3d& origin);
  void find_volume_gradient(const Mesh& mesh, std::span<const Vec3d> x);

  LaneArray<Real> lane_x_, lane_v_, lane_force_, lane_gradient_;
  std::vector<Vec3<Real>> other_x_, other_v_, other_force_;  // where the kernels do not know a force
  std::vector<Vec3d> force_, volume_gradient_;
};

}  // namespace pneuma::physics
