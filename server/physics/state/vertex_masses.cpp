#include "physics/state/vertex_masses.h"

#include <algorithm>
#include <functional>

namespace pneuma::physics {

std::vector<double> mass_shares(const SoftBody& body) {
  std::vector<double> shares = body.vertex_mass_scale;
  if (std::ranges::adjacent_find(shares, std::not_equal_to<>()) == shares.end()) return {};
  double sum = 0.0;
  for (const double scale : shares) sum += scale;
  const double mean = sum / static_cast<double>(shares.size());
  for (double& share : shares) share /= mean;
  return shares;
}

}  // namespace pneuma::physics
