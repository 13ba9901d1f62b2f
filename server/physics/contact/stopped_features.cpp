#include "physics/contact/stopped_features.h"

#include <algorithm>
#include <utility>

namespace pneuma::physics {

StoppedFeatures::StoppedFeatures(std::span<const FeatureCorners> stopped) {
  const auto key = [](const Vertex& of) { return std::pair(of.body, of.vertex); };
  for (const FeatureCorners& corners : stopped) {
    for (std::size_t i = 0; i < 4; ++i) {
      vertices_.push_back({.body = corners.bodies[i], .vertex = corners.vertices[i]});
    }
  }
  std::ranges::sort(vertices_, {}, key);
  const auto repeated = std::ranges::unique(vertices_, {}, key);
  vertices_.erase(repeated.begin(), repeated.end());
  joined_.begin(vertices_.size());
  const auto index_of = [&](const FeatureCorners& corners, std::size_t i) {
    const auto found = std::ranges::lower_bound(vertices_, std::pair(corners.bodies[i], corners.vertices[i]), {}, key);
    return static_cast<std::uint32_t>(found - vertices_.begin());
  };
  for (const FeatureCorners& corners : stopped) {
    for (std::size_t i = 1; i < 4; ++i) joined_.join(index_of(corners, 0), index_of(corners, i));
  }
}

// Each goes to the mean velocity, by what it did not move. The mean is weighted by that too, which keeps the momentum.
void StoppedFeatures::stop() {
  struct Sum {
    double mass_kg = 0.0;
    Vec3d momentum_n_s = Vec3d::Zero();
    double held = 0.0;
    Vec3d held_m_s = Vec3d::Zero();
  };
  std::vector<Sum> sums(vertices_.size());
  for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
    const Vertex& vertex = vertices_[i];
    Sum& sum = sums[joined_.lowest_with(i)];
    if (vertex.is_held) {
      sum.held += 1.0;
      sum.held_m_s += vertex.velocity_m_s;
    } else {
      sum.mass_kg += (1.0 - vertex.share) * vertex.mass_kg;
      sum.momentum_n_s += (1.0 - vertex.share) * vertex.mass_kg * vertex.velocity_m_s;
    }
  }
  for (std::uint32_t i = 0; i < vertices_.size(); ++i) {
    Vertex& vertex = vertices_[i];
    const Sum& sum = sums[joined_.lowest_with(i)];
    if (vertex.is_held || vertex.mass_kg == 0.0 || (sum.held == 0.0 && sum.mass_kg == 0.0)) continue;
    const Vec3d mean_m_s = sum.held > 0.0 ? Vec3d(sum.held_m_s / sum.held) : Vec3d(sum.momentum_n_s / sum.mass_kg);
    vertex.velocity_m_s = mean_m_s + vertex.share * (vertex.velocity_m_s - mean_m_s);
  }
}

}  // namespace pneuma::physics
