// What a vertex's move is expected to be: from its own last two moves and those of its ring, and from the moves of
// neighbours that are known already. In whole numbers modulo 2^32 (proto/WIRE.md, "Prediction").
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "codec/lanes.h"
#include "codec/mesh_order.h"

namespace pneuma::codec {

// Moves are predicted in 256ths of a grid step.
inline constexpr int fraction_bits = 8;

/// How the errors of neighbours' drifts are carried over to a vertex.
enum class Neighbours : std::uint8_t { ignored, mean, parallelogram };

/// The weights of a drift: of the last two moves in 32nds, and in 256ths of how they differ from those of the ring
/// (the sum over the neighbours). {32, 0, 0, 0} is steady motion, {64, -32, 0, 0} steady acceleration.
struct DriftWeights {
  std::int8_t move = 0;
  std::int8_t move_before = 0;
  std::int8_t ring = 0;
  std::int8_t ring_before = 0;
};
inline constexpr DriftWeights steady_motion{.move = 32};
inline constexpr double move_weight_unit = 1.0 / 32.0;
inline constexpr double ring_weight_unit = 1.0 / 256.0;

/// Sets `drift` to the moves that the last two make likely, in 256ths of a step.
/// A spring-mass body answers to how its vertices moved against their neighbours, so the ring terms are a step of its
/// wave equation. `scratch` is of any size.
void predict_drift(const MeshOrder& order, const std::vector<Lanes>& move, const std::vector<Lanes>& move_before,
                   DriftWeights weights, std::vector<Lanes>& scratch, std::vector<Lanes>& drift);

/// What coding has found at a slot: in the first three lanes the move less its drift (256ths), in the fourth the size
/// of its residual. Entry 0 is of nothing.
using Found = std::vector<Lanes>;

/// What neighbours add to the drift of a slot, and in the fourth lane the sum of their residuals' sizes.
template <Neighbours neighbours>
LaneVector from_neighbours(const MeshOrder& order, std::size_t slot, const Lanes* found) {
  if constexpr (neighbours == Neighbours::parallelogram) {
    const auto& p = order.parallelograms[slot];
    const LaneVector ahead = found[p[0]].v + found[p[1]].v + found[p[2]].v + found[p[3]].v;
    const LaneVector behind = found[p[4]].v + found[p[5]].v;
    const LaneVector sum = shifted_down(ahead - behind, 1);
    return LaneVector{sum[0], sum[1], sum[2], ahead[3]};
  } else {
    const auto& p = order.parents[slot];
    const LaneVector sum = found[p[0]].v + found[p[1]].v + found[p[2]].v + found[p[3]].v;
    if constexpr (neighbours == Neighbours::ignored) return LaneVector{0, 0, 0, sum[3]};
    const LaneVector mean = shifted_down(sum, 2);
    return LaneVector{mean[0], mean[1], mean[2], sum[3]};
  }
}

}  // namespace pneuma::codec
