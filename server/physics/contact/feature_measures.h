// How far apart candidates are and where, many at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/feature_kernels.h"
#include "physics/contact/surface_body.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {

class FeatureMeasures {
 public:
  /// Measures the candidates of the pair, from one on, where the substep (or the pass) finds them.
  void measure(SurfacePair& pair, std::span<const SurfaceBody> bodies, std::size_t first = 0);

  /// Likewise those of one kind that `which` lists, and calls visit(i, candidate) for each, with a copy of it.
  template <class Visit>
  void for_measured(FeaturePair kind, const SurfacePair& pair, std::span<const std::uint32_t> which,
                    std::span<const SurfaceBody> bodies, const Visit& visit) {
    if (which.empty()) return;
    run(kind, pair, which, bodies);
    for (std::size_t i = 0; i < which.size(); ++i) {
      Candidate candidate = pair.candidates[which[i]];
      take(nearest_[i / FeatureBlock::width], i % FeatureBlock::width, candidate);
      visit(which[i], candidate);
    }
  }

  [[nodiscard]] std::size_t bytes() const {
    return blocks_.capacity() * sizeof(FeatureBlock) + nearest_.capacity() * sizeof(NearestBlock) +
           of_kind_.capacity() * sizeof(std::uint32_t);
  }

 private:
  void run(FeaturePair kind, const SurfacePair& pair, std::span<const std::uint32_t> which,
           std::span<const SurfaceBody> bodies);
  static void take(const NearestBlock& nearest, std::size_t lane, Candidate& candidate);

  const FeatureKernels* kernels_ = &feature_kernels(isa_in_use());
  std::vector<FeatureBlock> blocks_;
  std::vector<NearestBlock> nearest_;
  std::vector<std::uint32_t> of_kind_;
};

}  // namespace pneuma::physics
