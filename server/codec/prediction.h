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
};
inline constexpr double own_weight_unit = 1.0 / 128.0;
inline constexpr double ring_weight_unit = 1.0 / 1024.0;

/// What each neighbour has more than the slot itself, added up.
inline LaneVector ring_difference(const MeshOrder& order, std::size_t slot, const Lanes* field) {
  const std::uint32_t begin = order.ring_begins[slot];
  const std::uint32_t end = order.ring_begins[slot + 1];
  LaneVector sum = {0, 0, 0, 0};
  for (std::uint32_t i = begin; i < end; ++i) sum += field[order.rings[i]].v;
  const std::uint32_t degree = end - begin;
  return sum - LaneVector{degree, degree, degree, degree} * field[slot].v;
}

/// Sets `drift` to the moves that the last ones make likely, in 16ths of a step. A spring-mass body answers to how its
/// vertices moved against their neighbours, so the ring terms are a step of its wave equation. `scratch` is of any
/// size.
void predict_drift(const MeshOrder& order, const MoveHistory& moves, const DriftWeights& weights,
                   std::vector<Lanes>& scratch, std::vector<Lanes>& drift);

/// Sets `drift` to the move that came after moves[k], for a list of them that is told backwards; 0 for the last one.
void expect_after(const MoveHistory& moves, std::size_t k, std::vector<Lanes>& drift);

/// What coding has found at a slot: in the first three lanes the move less its drift (16ths), in the fourth the size
/// of its residuals. Entry 0 is of nothing.
using Found = std::vector<Lanes>;

/// Each lane, signed, over `count`, rounded down; count is at most parents_max.
inline LaneVector divided(LaneVector lanes, std::uint32_t count) {
  using Halves [[gnu::vector_size(8)]] = std::int32_t;
  using DoubleLanes [[gnu::vector_size(16)]] = double;
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
  // Added to a double below 2^51 in size, it leaves the nearest integer in the low bits of the mantissa.
  constexpr double rounding_shift = 0x1.8p52;
  const Division division = divisions[count];
  const auto halves = std::bit_cast<std::array<Halves, 2>>(lanes);
  const DoubleLanes low = __builtin_convertvector(halves[0], DoubleLanes) * division.factor + division.shift;
  const DoubleLanes high = __builtin_convertvector(halves[1], DoubleLanes) * division.factor + division.shift;
  const auto low_words = std::bit_cast<LaneVector>(low + rounding_shift);
  const auto high_words = std::bit_cast<LaneVector>(high + rounding_shift);
  return LaneVector{low_words[0], low_words[2], high_words[0], high_words[2]};
}

/// The mean of what was found at a slot's parents, each lane rounded down.
inline LaneVector mean_of_parents(const MeshOrder::Parents& parents, const Lanes* found) {
  LaneVector sum = found[parents.slots[0]].v;
  for (std::size_t i = 1; i < parents_max; ++i) sum += found[parents.slots[i]].v;
  return divided(sum, parents.count);
}

}  // namespace pneuma::codec
