#include "physics/contact/contact_note.h"

namespace pneuma::physics {

void TouchTally::add(BodyRef first, BodyRef second, const Vec3d& push_n_s, const Vec3d& position, const Vec3d& normal) {
  const double impulse_n_s = push_n_s.dot(normal);
  if (first == second || !(impulse_n_s > 0.0) || !push_n_s.allFinite()) return;
  const bool in_order = first < second;
  Sum& sum = sums_[in_order ? std::pair(first, second) : std::pair(second, first)];
  const double sign = in_order ? 1.0 : -1.0;
  sum.impulse_n_s += impulse_n_s;
  sum.push_n_s += sign * push_n_s;
  sum.position_n_s_m += impulse_n_s * position;
  sum.normal_n_s += sign * impulse_n_s * normal;
}

std::vector<BodyTouch> TouchTally::touches() const {
  std::vector<BodyTouch> touches;
  touches.reserve(sums_.size());
  for (const auto& [pair, sum] : sums_) {
    touches.push_back({pair.first, pair.second, sum.impulse_n_s, sum.push_n_s, sum.position_n_s_m / sum.impulse_n_s,
                       sum.normal_n_s.stableNormalized()});
  }
  return touches;
}

std::size_t TouchTally::bytes() const {
  constexpr std::size_t links = 4 * sizeof(void*);  // of a tree's node
  return sums_.size() * (sizeof(decltype(sums_)::value_type) + links);
}

}  // namespace pneuma::physics
