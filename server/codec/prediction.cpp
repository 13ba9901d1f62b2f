#include "codec/prediction.h"

namespace pneuma::codec {

namespace {

LaneVector weight(std::int8_t value) {
  const auto lane = static_cast<std::uint32_t>(std::int32_t{value});
  return LaneVector{lane, lane, lane, lane};
}

}  // namespace

void predict_drift(const MeshOrder& order, const std::vector<Lanes>& move, const std::vector<Lanes>& move_before,
                   DriftWeights weights, std::vector<Lanes>& scratch, std::vector<Lanes>& drift) {
  const std::size_t count = order.size();
  const LaneVector of_move = weight(weights.move);
  const LaneVector of_move_before = weight(weights.move_before);
  const LaneVector of_ring = weight(weights.ring);
  const LaneVector of_ring_before = weight(weights.ring_before);
  drift.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    drift[i].v = (of_move * move[i].v + of_move_before * move_before[i].v) << 3;
  }
  if (weights.ring == 0 && weights.ring_before == 0) return;
  scratch.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    scratch[i].v = of_ring * move[i].v + of_ring_before * move_before[i].v;
  }
  const std::uint32_t* const ring = order.rings.data();
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t begin = order.ring_begins[i];
    const std::uint32_t end = order.ring_begins[i + 1];
    LaneVector sum = {0, 0, 0, 0};
    for (std::uint32_t j = begin; j < end; ++j) sum += scratch[ring[j]].v;
    const std::uint32_t degree = end - begin;
    drift[i].v += sum - LaneVector{degree, degree, degree, degree} * scratch[i].v;
  }
}

}  // namespace pneuma::codec
