#include "codec/prediction.h"

#include <algorithm>

namespace pneuma::codec {

namespace {

LaneVector all_lanes(std::int32_t value) {
  const auto lane = static_cast<std::uint32_t>(value);
  return LaneVector{lane, lane, lane, lane};
}

// From 1,024ths of a step.
constexpr int drift_shift = 10 - fraction_bits;

}  // namespace

void predict_drift(const MeshOrder& order, const MoveHistory& moves, const DriftWeights& weights,
                   std::vector<Lanes>& scratch, std::vector<Lanes>& drift) {
  const std::size_t count = order.size();
  drift.resize(count);
  scratch.resize(count);
  std::array<LaneVector, history_size> own;
  std::array<LaneVector, history_size> ring;
  for (std::size_t k = 0; k < history_size; ++k) {
    own[k] = all_lanes(weights.own[k]);
    ring[k] = all_lanes(weights.ring[k]);
  }
  const LaneVector ring_of_ring = all_lanes(weights.ring_of_ring);
  for (std::size_t slot = 0; slot < count; ++slot) {
    LaneVector of_own = {};
    LaneVector of_ring = ring_of_ring * ring_difference(order, slot, moves[0].data());
    for (std::size_t k = 0; k < history_size; ++k) {
      of_own += own[k] * moves[k][slot].v;
      of_ring += ring[k] * moves[k][slot].v;
    }
    drift[slot].v = of_own << 3;
    scratch[slot].v = of_ring;
  }
  constexpr std::uint32_t half = 1U << (drift_shift - 1);
  for (std::size_t slot = 0; slot < count; ++slot) {
    const LaneVector sum = drift[slot].v + ring_difference(order, slot, scratch.data());
    drift[slot].v = shifted_down(sum + LaneVector{half, half, half, half}, drift_shift);
  }
}

void expect_after(const MoveHistory& moves, std::size_t k, std::vector<Lanes>& drift) {
  if (k == 0) {
    std::ranges::fill(drift, Lanes{});
    return;
  }
  for (std::size_t slot = 0; slot < drift.size(); ++slot) drift[slot].v = moves[k - 1][slot].v << fraction_bits;
}

}  // namespace pneuma::codec
