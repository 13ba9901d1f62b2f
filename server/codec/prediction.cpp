#include "codec/prediction.h"

#include <algorithm>

#include "codec/clones.h"

namespace pneuma::codec {

namespace {

LaneVector all_lanes(std::int32_t value) {
  const auto lane = static_cast<std::uint32_t>(value);
  return LaneVector{lane, lane, lane, lane};
}

// From 1,024ths of a step.
constexpr int drift_shift = 10 - fraction_bits;

}  // namespace

PNEUMA_CLONED void ring_differences(const MeshOrder& order, const std::vector<Lanes>& field, std::vector<Lanes>& out) {
  out.resize(order.size());
  for (std::size_t slot = 0; slot < order.size(); ++slot) out[slot].v = ring_difference(order, slot, field.data());
}

PNEUMA_CLONED void predict_drift(const MeshOrder& order, const MoveHistory& moves, const DriftWeights& weights,
                                 std::vector<Lanes>& ring, std::vector<Lanes>& drift) {
  const std::size_t count = order.size();
  drift.resize(count);
  std::array<LaneVector, history_size> of_own;
  std::array<LaneVector, history_size> of_ring;
  for (std::size_t k = 0; k < history_size; ++k) {
    of_own[k] = all_lanes(weights.own[k]);
    of_ring[k] = all_lanes(weights.ring[k]);
  }
  const LaneVector ring_of_ring = all_lanes(weights.ring_of_ring);
  for (std::size_t slot = 0; slot < count; ++slot) {
    LaneVector own = {};
    LaneVector field = ring_of_ring * ring[slot].v;
    for (std::size_t k = 0; k < history_size; ++k) {
      own += of_own[k] * moves[k][slot].v;
      field += of_ring[k] * moves[k][slot].v;
    }
    drift[slot].v = own << 3;
    ring[slot].v = field;
  }
  constexpr std::uint32_t half = 1U << (drift_shift - 1);
  for (std::size_t slot = 0; slot < count; ++slot) {
    const LaneVector sum = drift[slot].v + ring_difference(order, slot, ring.data());
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
