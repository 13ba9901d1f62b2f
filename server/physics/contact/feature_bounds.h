// How far apart candidates are at least, many at a time.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "physics/contact/bound_kernels.h"
#include "physics/contact/surface_body.h"
#include "physics/lanes/isa.h"

namespace pneuma::physics {

class FeatureBounds {
 public:
  /// Sets `apart_m` of the pair's candidates that `which` lists: no more than their distance where the substep (or the
  /// pass) finds them.
  void set(const SurfacePair& pair, std::span<Candidate> candidates, std::span<const std::uint32_t> which,
           std::span<const SurfaceBody> bodies);
  /// Of all of them.
  void set(const SurfacePair& pair, std::span<Candidate> candidates, std::span<const SurfaceBody> bodies);

  [[nodiscard]] std::size_t bytes() const {
    return blocks_.capacity() * sizeof(FeatureBlock) + bounds_m_.capacity() * sizeof(float) +
           (of_kind_.capacity() + all_.capacity()) * sizeof(std::uint32_t);
  }

 private:
  void set_kind(FeaturePair kind, const SurfacePair& pair, std::span<Candidate> candidates,
                std::span<const SurfaceBody> bodies);

  const BoundKernels* kernels_ = &bound_kernels(isa_in_use());
  std::vector<FeatureBlock> blocks_;
  std::vector<float> bounds_m_;
  std::vector<std::uint32_t> of_kind_, all_;
};

}  // namespace pneuma::physics
