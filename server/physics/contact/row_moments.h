// The moments that rows of explicit steps put on pairs of free bodies: a row pushes both where they are, which is not
// one place while they keep a distance, and along the normal that it was found with; and what hits ends at the surface,
// not where its velocity would take it.
#pragma once

#include <span>
#include <vector>

#include "physics/state/state.h"

namespace pneuma::physics {

/// What contact turned pairs of bodies by in a tick, to be taken back at its end, by one turn of both: that takes the
/// least energy. Halves spun a light body that a heavy one pressed to a lump. Soft bodies are counted first, then rigid
/// ones.
class RowMoments {
 public:
  /// Before the rows of a substep.
  template <class Real>
  void begin(std::span<const SoftState<Real>> soft, std::span<const RigidState> rigid, bool is_first_of_tick);

  void add(std::size_t first, std::size_t second, const Vec3d& moment_n_m_s) {
    const double both_kg_m2 = inertias_kg_m2_[first] + inertias_kg_m2_[second];
    const double share = both_kg_m2 > 0.0 ? inertias_kg_m2_[first] / both_kg_m2 : 0.5;
    moments_n_m_s_[first] += share * moment_n_m_s;
    moments_n_m_s_[second] += (1.0 - share) * moment_n_m_s;
  }

  /// Turns each body as a whole, by its velocities alone. One that is pinned or asleep has no angular momentum to keep.
  template <class Real>
  void turn_back(std::span<SoftState<Real>> soft, std::span<RigidState> rigid) const;

  [[nodiscard]] std::size_t bytes() const {
    return moments_n_m_s_.capacity() * sizeof(Vec3d) + inertias_kg_m2_.capacity() * sizeof(double);
  }

 private:
  std::vector<Vec3d> moments_n_m_s_;    // one a body
  std::vector<double> inertias_kg_m2_;  // likewise, as the tick began: over all axes
};

}  // namespace pneuma::physics
