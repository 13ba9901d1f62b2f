// Soft bodies that overlap a solid, as a scene or an edit may put them, leave it as wholes: their springs hold nothing
// of it, and they are no faster afterwards.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/state/bounds.h"
#include "physics/state/state.h"

namespace pneuma::physics {

template <class Real>
class CarriedOut {
 public:
  /// Before a tick: gives each body that has a vertex deep in a solid a velocity out of it, at most 1 m/s, and a rigid
  /// body that may yield its share. A pinned body and one that lies on both sides of a solid get none.
  void begin(std::span<SoftState<Real>> soft, std::span<RigidState> rigid, std::span<const ColliderState> colliders);
  /// After it: takes away what is left of these velocities.
  void end(std::span<SoftState<Real>> soft, std::span<RigidState> rigid);
  /// One a soft body, then one a rigid body; none where nobody is carried.
  [[nodiscard]] std::span<const Vec3d> velocities_m_s() const { return velocities_m_s_; }

 private:
  std::vector<Vec3d> velocities_m_s_;
  std::vector<std::uint8_t> leaves_fixed_;  // one a soft body: it overlaps nothing that yields
};

}  // namespace pneuma::physics
