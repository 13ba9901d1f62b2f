#include "physics/contact/feature_measures.h"

#include <algorithm>
#include <array>

namespace pneuma::physics {
namespace {

// Nearer than this, m, features have no direction apart.
constexpr double distance_min_m = 1e-12;

}  // namespace

void FeatureMeasures::measure(SurfacePair& pair, std::span<const SurfaceBody> bodies, std::size_t first) {
  for (const FeaturePair kind : {FeaturePair::vertex_face, FeaturePair::edge_edge}) {
    of_kind_.clear();
    for (auto i = static_cast<std::uint32_t>(first); i < pair.candidates.size(); ++i) {
      if (pair.candidates[i].pair == kind) of_kind_.push_back(i);
    }
    for_measured(kind, pair, of_kind_, bodies,
                 [&](std::uint32_t i, const Candidate& candidate) { pair.candidates[i] = candidate; });
  }
}

void FeatureMeasures::run(FeaturePair kind, const SurfacePair& pair, std::span<const std::uint32_t> which,
                          std::span<const SurfaceBody> bodies) {
  constexpr std::size_t width = FeatureBlock::width;
  const std::size_t of_first = kind == FeaturePair::vertex_face ? 1 : 2;
  const std::size_t count = (which.size() + width - 1) / width;
  blocks_.resize(count);
  nearest_.resize(count);
  const std::array<const Vec3d*, 2> from{bodies[pair.first].from.data(), bodies[pair.second].from.data()};
  for (std::size_t i = 0; i < count * width; ++i) {
    // What is left of the last block repeats its last candidate.
    const Candidate& candidate = pair.candidates[which[std::min(i, which.size() - 1)]];
    const Vec3d* of_a = from[candidate.swapped ? 1 : 0];
    const Vec3d* of_b = from[candidate.swapped ? 0 : 1];
    const Vec3d& start = of_a[candidate.corners[0]];
    FeatureBlock& block = blocks_[i / width];
    for (std::size_t corner = 1; corner < 4; ++corner) {
      const Vec3d& at = (corner < of_first ? of_a : of_b)[candidate.corners[corner]];
      const std::size_t row = 3 * (corner - 1);
      block.points[row][i % width] = at.x() - start.x();
      block.points[row + 1][i % width] = at.y() - start.y();
      block.points[row + 2][i % width] = at.z() - start.z();
    }
  }
  (kind == FeaturePair::vertex_face ? kernels_->vertex_face : kernels_->edge_edge)(blocks_.data(), count,
                                                                                   nearest_.data());
}

void FeatureMeasures::take(const NearestBlock& nearest, std::size_t lane, Candidate& candidate) {
  candidate.apart_m = nearest.distances_m[lane];
  const double scale = candidate.apart_m > distance_min_m ? 1.0 / candidate.apart_m : 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    candidate.apart[static_cast<Eigen::Index>(axis)] = scale * nearest.apart_m[axis][lane];
    candidate.shares[axis] = nearest.shares[axis][lane];
  }
}

}  // namespace pneuma::physics
