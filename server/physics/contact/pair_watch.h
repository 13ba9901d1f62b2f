// The features of two surfaces, or of one, that are near each other: found once, and watched over the substeps until
// the bodies have moved too far for the list.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "physics/contact/candidates.h"
#include "physics/contact/feature_measures.h"
#include "physics/contact/surface_body.h"

namespace pneuma::physics {

class PairWatch {
 public:
  PairWatch(std::uint32_t first, std::uint32_t second) : pair_{first, second} {}

  /// Sets the pair's candidates: all features that are, where the substep finds them, within `within_m` and the most
  /// that the substep may move them towards each other; measured (FeatureMeasures). What it keeps between calls saves
  /// work and shows in no result but the order.
  void look(double within_m, std::span<SurfaceBody> bodies, CandidateFinder& finder, FeatureMeasures& measures,
            SurfacePair& pair);
  /// Whether the last look has all that are within that much of each other, or come there in the substep. Sets how far
  /// the pair has drifted since then.
  [[nodiscard]] bool holds(double within_m, std::span<const SurfaceBody> bodies, SurfacePair& pair) const;

  [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> bodies() const { return {pair_.first, pair_.second}; }
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = pair_.candidates.capacity() * sizeof(Candidate) + apart_m_.capacity() * sizeof(double);
    for (const auto* lists : {&near_, &due_}) {
      for (const std::vector<std::uint32_t>& list : *lists) sum += list.capacity() * sizeof(std::uint32_t);
    }
    return sum;
  }

 private:
  /// Of both bodies at one time.
  struct Drifts {
    SurfaceDrift first, second;
  };
  [[nodiscard]] Drifts drifts(std::span<const SurfaceBody> bodies) const {
    return {bodies[pair_.first].drift, bodies[pair_.second].drift};
  }
  [[nodiscard]] double drifted_m(const Drifts& since, std::span<const SurfaceBody> bodies) const;
  void find(double reach_m, std::span<SurfaceBody> bodies, CandidateFinder& finder, FeatureMeasures& measures);
  void list_near(double within_m);

  // Indices of candidates by their kind.
  using ByKind = std::array<std::vector<std::uint32_t>, 2>;

  SurfacePair pair_;
  std::vector<double> apart_m_;  // one a candidate: how far the bodies may come, look by look, before the two can touch
  ByKind near_;                  // these are looked at by each substep
  double near_m_ = 0.0;          // the others are further apart
  double reach_m_ = -1.0;        // as what is not listed
  Drifts found_, looked_;
  double come_m_ = 0.0;  // since the list was made: the way there, as bodies that part may come back
  double looked_m_ = 0.0;
  bool watched_ = false;
  ByKind due_;
};

}  // namespace pneuma::physics
