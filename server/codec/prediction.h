// What a vertex's move is expected to be: from its own last moves and those of its ring, and from the moves of
// neighbours that are known already. In whole numbers modulo 2^32 (proto/WIRE.md, "Prediction").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "codec/lanes.h"
#include "codec/mesh_order.h"

namespace pneuma::codec {

// Moves are predicted in 16ths of a grid step.
inline constexpr int fraction_bits = 4;

/// The moves of the last frames, the latest first.
inline constexpr std::size_t history_size = 4;
using MoveHistory = std::array<std::vector<Lanes>, history_size>;

/// The weights of a drift: of the last moves in 128ths, and in 1,024ths of how they differ from those of the ring (the
/// sum over the neighbours). The last is of that difference of the last move, once more.
struct DriftWeights {
  std::array<std::int32_t, history_size> own{};
  std::array<std::int32_t, history_size> ring{};
  std::int32_t ring_of_ring = 0;

  friend bool operator==(const DriftWeights&, const DriftWeights&) = default;
};
inline constexpr double own_weight_unit = 1.0 / 128.0;
inline constexpr double ring_weight_unit = 1.0 / 1024.0;

/// What each neighbour has more than the slot itself, added up.
inline LaneVector ring_difference(const MeshOrder& order, std::size_t slot, const Lanes* field) {
  LaneVector sum = {0, 0, 0, 0};
  for (const std::uint32_t neighbour : order.rings[slot]) sum += field[neighbour].v;
  const std::uint32_t begin = order.ring_rest_begins[slot];
  const std::uint32_t end = order.ring_rest_begins[slot + 1];
  for (std::uint32_t i = begin; i < end; ++i) sum += field[order.ring_rests[i]].v;
  const auto times = static_cast<std::uint32_t>(order.rings[slot].size()) + end - begin;
  return sum - LaneVector{times, times, times, times} * field[slot].v;
}
void ring_differences(const MeshOrder& order, const std::vector<Lanes>& field, std::vector<Lanes>& out);

/// Sets `drift` to the moves that the last ones make likely, in 16ths of a step. A spring-mass body answers to how its
/// vertices moved against their neighbours, so the ring terms are a step of its wave equation. `ring` holds the
/// ring_differences() of the last moves; it is left with others.
void predict_drift(const MeshOrder& order, const MoveHistory& moves, const DriftWeights& weights,
                   std::vector<Lanes>& ring, std::vector<Lanes>& drift);

/// Sets `drift` to the move that came after moves[k], for a list of them that is told backwards; 0 for the last one.
void expect_after(const MoveHistory& moves, std::size_t k, std::vector<Lanes>& drift);

/// The moves of slots less their drifts, in 16ths of a step. Entry 0 is of nothing.
using Errors = std::vector<Lanes>;

/// Each lane, signed, over `count`, rounded down; count is at most parents_max.
inline LaneVector divided(LaneVector lanes, std::uint32_t count) {
  using DoubleLanes [[gnu::vector_size(32)]] = double;
  using HalfLanes [[gnu::vector_size(32)]] = std::uint32_t;
  // floor(s / n) is the integer nearest to (s + 1/2) / n - 1/2, which is at least 1 / 2n from a tie.
  struct Division {
    double factor;
    double shift;
  };
  static constexpr std::array<Division, parents_max + 1> divisions = [] {
    std::array<Division, parents_max + 1> all{};
    for (std::size_t n = 1; n < all.size(); ++n) {
      const double inverse = 1.0 / static_cast<double>(n);
      all[n] = {inverse, 0.5 * inverse - 0.5};
    }
    return all;
  }();
  const Division division = divisions[count];
  const auto wide = __builtin_convertvector(std::bit_cast<SignedLaneVector>(lanes), DoubleLanes);
  const auto halves = reinterpret_cast<HalfLanes>((wide * division.factor + division.shift) + rounding_shift);
  return __builtin_shufflevector(halves, halves, 0, 2, 4, 6);
}

/// The mean of the errors of a slot's parents, each lane rounded down.
inline LaneVector mean_error(const MeshOrder::Parents& parents, const Lanes* errors) {
  LaneVector sum = errors[parents.slots[0]].v;
  for (std::size_t i = 1; i < parents_max; ++i) sum += errors[parents.slots[i]].v;
  return divided(sum, parents.count);
}

}  // namespace pneuma::codec
