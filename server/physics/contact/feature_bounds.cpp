#include "physics/contact/feature_bounds.h"

namespace pneuma::physics {

void FeatureBounds::set(const SurfacePair& pair, std::span<Candidate> candidates, std::span<const std::uint32_t> which,
                        std::span<const SurfaceBody> bodies) {
  for (const FeaturePair kind : {FeaturePair::vertex_face, FeaturePair::edge_edge}) {
    of_kind_.clear();
    for (const std::uint32_t i : which) {
      if (candidates[i].pair == kind) of_kind_.push_back(i);
    }
    if (!of_kind_.empty()) set_kind(kind, pair, candidates, bodies);
  }
}

void FeatureBounds::set(const SurfacePair& pair, std::span<Candidate> candidates, std::span<const SurfaceBody> bodies) {
  while (all_.size() < candidates.size()) all_.push_back(static_cast<std::uint32_t>(all_.size()));
  set(pair, candidates, std::span<const std::uint32_t>(all_).first(candidates.size()), bodies);
}

void FeatureBounds::set_kind(FeaturePair kind, const SurfacePair& pair, std::span<Candidate> candidates,
                             std::span<const SurfaceBody> bodies) {
  constexpr std::size_t width = FeatureBlock::width;
  const std::size_t count = (of_kind_.size() + width - 1) / width;
  blocks_.resize(count);
  bounds_m_.resize(count * width);
  for (std::size_t i = 0; i < count * width; ++i) {
    // What is left of the last block repeats its last candidate.
    const std::uint32_t candidate = of_kind_[std::min(i, of_kind_.size() - 1)];
    const FourPoints at = corners_of(pair, candidates[candidate], bodies).start(bodies);
    FeatureBlock& block = blocks_[i / width];
    for (std::size_t point = 0; point < 3; ++point) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<Eigen::Index>(axis);
        block.points[3 * point + axis][i % width] = static_cast<float>(at[point + 1][a] - at[0][a]);
      }
    }
  }
  (kind == FeaturePair::vertex_face ? kernels_->vertex_face : kernels_->edge_edge)(blocks_.data(), count,
                                                                                   bounds_m_.data());
  for (std::size_t i = 0; i < of_kind_.size(); ++i) {
    candidates[of_kind_[i]].apart_m = static_cast<double>(bounds_m_[i]);
  }
}

}  // namespace pneuma::physics
