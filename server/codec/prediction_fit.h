// The encoder's choice of weights. Another encoder may choose otherwise; what it chose is in the frame.
#pragma once

#include <optional>
#include <vector>

#include "codec/lanes.h"
#include "codec/mesh_order.h"
#include "codec/prediction.h"

namespace pneuma::codec {

/// What a fit sees of the rings: the ring_differences() of the last moves, and those of the first of these.
struct RingHistory {
  MoveHistory of_moves;
  std::vector<Lanes> of_ring;

  explicit RingHistory(std::size_t vertices) : of_ring(vertices) {
    for (auto& moves : of_moves) moves.resize(vertices);
  }
};

/// What weights take in a frame, about.
inline constexpr double weights_bits = 110.0;

/// The weights that leave the least of `moves`, by weighted squares on a sample of the vertices, given the moves before
/// them. Nothing where they would save less, against `last`, than they take in the frame.
[[nodiscard]] std::optional<DriftWeights> better_weights(const MeshOrder& order, const std::vector<Lanes>& moves,
                                                         const MoveHistory& history, const RingHistory& rings,
                                                         const DriftWeights& last);

}  // namespace pneuma::codec
