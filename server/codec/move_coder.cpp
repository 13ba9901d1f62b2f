#include "codec/move_coder.h"

#include <algorithm>

namespace pneuma::codec {

namespace {

// A residual's size counts four times in the sums that choose levels, so that quarter octaves begin below one step.
constexpr std::uint32_t size_unit = 4;
// So that no sum of sizes overflows.
constexpr std::uint64_t size_max = 1U << 24;
// So many times a slot's expected size is its level's.
constexpr std::uint32_t level_unit = 4;

std::uint32_t magnitude(std::uint32_t value) {
  return static_cast<std::int32_t>(value) < 0 ? 0 - value : value;
}

std::uint32_t signed_shift(std::uint32_t value, int bits) {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(value) >> bits);
}

std::uint32_t size_of_residual(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const std::uint64_t sum = magnitude(x) + 2 * (std::uint64_t{magnitude(y)} + magnitude(z));
  return static_cast<std::uint32_t>(std::min(size_unit * sum, size_max));
}

/// The nearest whole steps to a predicted move.
std::uint32_t nearest(std::uint32_t predicted) {
  return signed_shift(predicted + (1U << (fraction_bits - 1)), fraction_bits);
}
/// The nearest double steps to it, for a point of this parity.
std::uint32_t nearest_double(std::uint32_t predicted, std::uint32_t parity) {
  return signed_shift(predicted - (parity << fraction_bits) + (1U << fraction_bits), fraction_bits + 1);
}

/// The entry of Found.
LaneVector found_at(LaneVector move, LaneVector drift, std::uint32_t size) {
  LaneVector found = (move << fraction_bits) - drift;
  found[3] = size;
  return found;
}

std::uint32_t level_at(std::uint32_t size_of_parents, std::uint32_t body_size) {
  return std::min(level_of(level_unit * size_of_parents + body_size), level_max);
}

constexpr std::uint32_t weights_level = 44;

}  // namespace

std::uint32_t put_moves(const MeshOrder& order, const std::vector<Lanes>& moves, MoveScratch& scratch,
                        std::vector<Triple>& triples) {
  const std::size_t count = order.size();
  scratch.found.resize(count + 1);
  triples.resize(triples.size() + count);
  Triple* const out = triples.data() + (triples.size() - count);
  Lanes* const found = scratch.found.data();
  // Of the middling size: a mean of levels, which a few far vertices do not move.
  std::uint64_t level_sum = 0;
  for (std::size_t slot = 0; slot < count; ++slot) {
    const LaneVector mean = mean_of_parents(order.parents[slot], found);
    const LaneVector drift = scratch.drift[slot].v;
    const LaneVector predicted = drift + mean;
    const LaneVector move = moves[slot].v;
    const std::uint32_t parity = move[0] & 1U;
    const std::uint32_t x = move[0] - nearest(predicted[0]);
    const std::uint32_t y = signed_shift(move[1] - parity, 1) - nearest_double(predicted[1], parity);
    const std::uint32_t z = signed_shift(move[2] - parity, 1) - nearest_double(predicted[2], parity);
    const std::uint32_t size = size_of_residual(x, y, z);
    found[slot + 1].v = found_at(move, drift, size);
    level_sum += level_of(level_unit * size);
    out[slot] = {static_cast<std::int32_t>(x), static_cast<std::int32_t>(y), static_cast<std::int32_t>(z), mean[3]};
  }
  const auto mean_level = static_cast<std::uint32_t>(level_sum / std::max<std::size_t>(count, 1));
  const std::uint32_t level = std::min(mean_level + 2, level_max);
  const std::uint32_t body_size = size_of(level);
  for (std::size_t slot = 0; slot < count; ++slot) out[slot].level = level_at(out[slot].level, body_size);
  return level;
}

void take_moves(const MeshOrder& order, std::uint32_t level, MoveScratch& scratch, SymbolReader& reader,
                std::vector<Lanes>& moves) {
  const std::size_t count = order.size();
  scratch.found.resize(count + 1);
  moves.resize(count);
  SymbolReader symbols = reader;
  Lanes* const found = scratch.found.data();
  const std::uint32_t body_size = size_of(level);
  for (std::size_t slot = 0; slot < count; ++slot) {
    if (symbols.failed()) break;
    const LaneVector mean = mean_of_parents(order.parents[slot], found);
    const LaneVector drift = scratch.drift[slot].v;
    const LaneVector predicted = drift + mean;
    const Triple residual = symbols.take(level_at(mean[3], body_size));
    const auto x = static_cast<std::uint32_t>(residual.x);
    const auto y = static_cast<std::uint32_t>(residual.y);
    const auto z = static_cast<std::uint32_t>(residual.z);
    const std::uint32_t move_x = nearest(predicted[0]) + x;
    const std::uint32_t parity = move_x & 1U;
    const LaneVector move = {move_x, 2 * (nearest_double(predicted[1], parity) + y) + parity,
                             2 * (nearest_double(predicted[2], parity) + z) + parity, 0};
    moves[slot].v = move;
    found[slot + 1].v = found_at(move, drift, size_of_residual(x, y, z));
  }
  reader = symbols;
}

void put_weights(const DriftWeights& weights, std::vector<Triple>& triples) {
  const auto& own = weights.own;
  const auto& ring = weights.ring;
  triples.push_back({own[0], own[1], own[2], weights_level});
  triples.push_back({own[3], ring[0], ring[1], weights_level});
  triples.push_back({ring[2], ring[3], weights.ring_of_ring, weights_level});
}

DriftWeights take_weights(SymbolReader& symbols) {
  std::array<Triple, 3> triples{};
  for (Triple& triple : triples) {
    if (!symbols.failed()) triple = symbols.take(weights_level);
  }
  const auto& [a, b, c] = triples;
  return {{a.x, a.y, a.z, b.x}, {b.y, b.z, c.x, c.y}, c.z};
}

}  // namespace pneuma::codec
