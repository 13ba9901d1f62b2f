#include "codec/move_coder.h"

#include <algorithm>

#include "codec/clones.h"

namespace pneuma::codec {

namespace {

// A residual's size counts four times in the sums that choose levels, so that quarter octaves begin below one step.
constexpr int size_shift = 2;
// So that no sum of sizes overflows.
constexpr std::int32_t size_max = 1 << 24;
// So many times a slot's expected size is its level's.
constexpr std::uint32_t level_unit = 4;

constexpr LaneVector first_lane{~0U, 0, 0, 0};
constexpr LaneVector last_lane{0, 0, 0, ~0U};

SignedLaneVector as_signed(LaneVector lanes) {
  return std::bit_cast<SignedLaneVector>(lanes);
}
LaneVector all_lanes(std::uint32_t value) {
  return LaneVector{value, value, value, value};
}
/// The lanes of `mask` from `a`, the others from `b`.
LaneVector chosen(LaneVector mask, LaneVector a, LaneVector b) {
  return (mask & a) | (~mask & b);
}

/// Of the residuals in the first three lanes; in all lanes.
LaneVector size_of_residuals(LaneVector residuals) {
  constexpr SignedLaneVector most{size_max, size_max, size_max, size_max};
  const SignedLaneVector value = as_signed(residuals);
  const SignedLaneVector high = value < most ? value : most;
  const SignedLaneVector within = high > -most ? high : -most;
  const SignedLaneVector sign = within >> 31;
  const auto sizes = std::bit_cast<LaneVector>((within ^ sign) - sign);
  // y and z go in double steps.
  const LaneVector weighted = sizes << LaneVector{0, 1, 1, 0};
  const std::uint32_t sum = (weighted[0] + weighted[1] + weighted[2]) << size_shift;
  return all_lanes(std::min<std::uint32_t>(sum, size_max));
}

/// A prediction as whole numbers: of the x of a point, and of its y and z, which go in double steps and know its
/// parity.
struct Nearest {
  explicit Nearest(LaneVector predicted)
      : raised(predicted + LaneVector{1U << (fraction_bits - 1), 1U << fraction_bits, 1U << fraction_bits, 0}) {}

  /// In the first lane.
  [[nodiscard]] LaneVector x() const { return shifted_down(raised, fraction_bits); }
  /// In the second and third, given the parity in all of them.
  [[nodiscard]] LaneVector yz(LaneVector parity) const {
    return shifted_down(raised - (parity << fraction_bits), fraction_bits + 1);
  }

  LaneVector raised;
};

/// The entry of Found.
LaneVector found_at(LaneVector move, LaneVector drift, LaneVector residuals) {
  return chosen(last_lane, size_of_residuals(residuals), (move << fraction_bits) - drift);
}

std::uint32_t level_at(std::uint32_t size_of_parents, std::uint32_t body_size) {
  return std::min(level_of(level_unit * size_of_parents + body_size), level_max);
}

constexpr std::uint32_t weights_level = 44;

}  // namespace

PNEUMA_CLONED std::uint32_t put_moves(const MeshOrder& order, const std::vector<Lanes>& moves, MoveScratch& scratch,
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
    const LaneVector move = moves[slot].v;
    const LaneVector parity = all_lanes(move[0] & 1U);
    const Nearest nearest(drift + mean);
    const LaneVector residuals =
        chosen(first_lane, move - nearest.x(), shifted_down(move - parity, 1) - nearest.yz(parity));
    found[slot + 1].v = found_at(move, drift, residuals);
    level_sum += level_of(level_unit * found[slot + 1].v[3]);
    const SignedLaneVector xyz = as_signed(residuals);
    out[slot] = {xyz[0], xyz[1], xyz[2], mean[3]};
  }
  const auto mean_level = static_cast<std::uint32_t>(level_sum / std::max<std::size_t>(count, 1));
  const std::uint32_t level = std::min(mean_level + 1, level_max);
  const std::uint32_t body_size = size_of(level);
  for (std::size_t slot = 0; slot < count; ++slot) out[slot].level = level_at(out[slot].level, body_size);
  return level;
}

PNEUMA_CLONED void take_moves(const MeshOrder& order, std::uint32_t level, MoveScratch& scratch, SymbolReader& reader,
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
    const Triple triple = symbols.take(level_at(mean[3], body_size));
    const auto residuals = std::bit_cast<LaneVector>(SignedLaneVector{triple.x, triple.y, triple.z, 0});
    const Nearest nearest(drift + mean);
    const LaneVector x = nearest.x() + residuals;
    const LaneVector parity = all_lanes(x[0] & 1U);
    const LaneVector yz = ((nearest.yz(parity) + residuals) << 1) + parity;
    const LaneVector move = chosen(first_lane, x, yz);
    moves[slot].v = move;
    found[slot + 1].v = found_at(move, drift, residuals);
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
