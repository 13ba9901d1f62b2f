// Sort and sweep along an axis: the broad phase of soft bodies among each other and of rigid ones.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

namespace pneuma::physics {

/// Calls meet(a, b) for each two of `order` whose intervals low(i)..high(i) overlap, once, in no order to rely on.
/// Leaves `order` sorted by low.
template <class Low, class High, class Meet>
void sort_and_sweep(std::vector<std::uint32_t>& order, const Low& low, const High& high, const Meet& meet) {
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    const double low_a = low(a);
    const double low_b = low(b);
    return low_a != low_b ? low_a < low_b : a < b;
  });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const double end = high(order[i]);
    for (std::size_t j = i + 1; j < order.size() && low(order[j]) <= end; ++j) meet(order[i], order[j]);
  }
}

}  // namespace pneuma::physics
