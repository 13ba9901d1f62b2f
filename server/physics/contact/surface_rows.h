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
  /// Finds the pairs of features that are within the kept distance, or would be where the substep ends. Returns how
  /// many there are. The candidates are measured (FeatureMeasures).
  [[nodiscard]] std::size_t find(std::span<const SurfacePair> pairs, std::span<const SurfaceBody> bodies);
  /// How many of them are of a pair of bodies, by its place.
  [[nodiscard]] std::size_t count_of(std::size_t pair) const;
  /// Appends a row for each of them, in the order of the keys, with the bodies' indices for those of their responses.
  /// What the solver is to reach is left to the caller.
  void append(std::span<const SurfacePair> pairs, std::span<const SurfaceBody> bodies,
              std::vector<ContactRow>& rows) const;

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

  std::vector<Found> found_;                      // once each, in the order of the keys
  std::array<std::vector<double>, 2> nearest_m_;  // of a pair's bodies, one a vertex: the nearest face of the other
};

}  // namespace pneuma::physics
