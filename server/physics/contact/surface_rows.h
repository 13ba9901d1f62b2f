// The rows of surfaces against each other and themselves.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/row.h"
#include "physics/contact/surface_body.h"

namespace pneuma::physics {

/// Of the kept distance: what comes no nearer than this much beyond it needs no row.
inline constexpr double row_slack_share = 0.5;

class RowFinder {
 public:
  /// Appends a row for each pair of features that is within the kept distance, or would be where the substep ends; each
  /// once, in the order of the keys, with the bodies' indices for those of their responses. What the solver is to reach
  /// is left to the caller. The candidates are measured (FeatureMeasures).
  void find(std::span<const SurfacePair> pairs, std::span<const SurfaceBody> bodies, std::vector<ContactRow>& rows);

  [[nodiscard]] std::size_t bytes() const {
    return found_.capacity() * sizeof(Found) + (nearest_m_[0].capacity() + nearest_m_[1].capacity()) * sizeof(double);
  }

 private:
  // Of a candidate that needs a row, before it is known whether another one names the same.
  struct Found {
    FeatureKey key;
    double gap_m = 0.0;
    std::uint32_t pair = 0;
    std::uint32_t candidate = 0;
  };
  void look(std::uint32_t pair, std::span<const SurfacePair> pairs, std::span<const SurfaceBody> bodies);
  void find_nearest(const SurfacePair& pair, std::span<const SurfaceBody> bodies);
  [[nodiscard]] bool is_beside(const Candidate& candidate) const;

  std::vector<Found> found_;
  std::array<std::vector<double>, 2> nearest_m_;  // of a pair's bodies, one a vertex: the nearest face of the other
};

}  // namespace pneuma::physics
