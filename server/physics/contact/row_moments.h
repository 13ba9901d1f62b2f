// The moments that rows of explicit steps put on pairs of free bodies: a row pushes both where they are, which is not
// one place while they keep a distance, and along the normal that it was found with; and what hits ends at the surface,
// not where its velocity would take it.
#pragma once

#include <span>
#include <vector>

#include "physics/state/state.h"

namespace pneuma::physics {

/// What contact turned pairs of bodies by in a tick, to be taken back at its end: each of a pair gets half. Soft bodies
/// are counted first, then rigid ones.
class RowMoments {
 public:
  /// Before the rows of a substep.
  void begin(std::size_t body_count, bool is_first_of_tick) {
    if (is_first_of_tick || moments_n_m_s_.size() != body_count) moments_n_m_s_.assign(body_count, Vec3d::Zero());
  }

  void add(std::size_t first, std::size_t second, const Vec3d& moment_n_m_s) {
    moments_n_m_s_[first] += 0.5 * moment_n_m_s;
    moments_n_m_s_[second] += 0.5 * moment_n_m_s;
  }

  /// Turns each body as a whole, by its velocities alone. One that is pinned or asleep has no angular momentum to keep.
  template <class Real>
  void turn_back(std::span<SoftState<Real>> soft, std::span<RigidState> rigid) const;

  [[nodiscard]] std::size_t bytes() const { return moments_n_m_s_.capacity() * sizeof(Vec3d); }

 private:
  std::vector<Vec3d> moments_n_m_s_;  // one a body
};

}  // namespace pneuma::physics
