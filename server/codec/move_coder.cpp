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

LaneVector all_lanes(std::uint32_t value) {
  return LaneVector{value, value, value, value};
}
/// The lanes of `mask` from `a`, the others from `b`.
LaneVector chosen(LaneVector mask, LaneVector a, LaneVector b) {
  return (mask & a) | (~mask & b);
}

/// y and z go in double steps.
std::uint32_t size_of_residuals(LaneVector residuals) {
  constexpr SignedLaneVector most{size_max, size_max, size_max, size_max};
  const auto number = std::bit_cast<SignedLaneVector>(residuals);
  const SignedLaneVector above = number > -most ? number : -most;
  const SignedLaneVector within = above < most ? above : most;
  const SignedLaneVector sign = within >> 31;
  const auto far = std::bit_cast<LaneVector>(((within ^ sign) - sign) << SignedLaneVector{0, 1, 1, 0});
  return std::min<std::uint32_t>((far[0] + far[1] + far[2]) << size_shift, size_max);
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

/// A slot's level, by the sizes of its parents.
std::uint32_t level_at(const MeshOrder::Parents& parents, const std::uint32_t* sizes, std::uint32_t body_size) {
  // Quotients of numbers below 2^27, which is more than a sum is, by multiplication: too large by less than 2^-5 / n.
  static constexpr std::array<std::uint64_t, parents_max + 1> reciprocals = [] {
    std::array<std::uint64_t, parents_max + 1> all{};
    for (std::uint64_t n = 1; n < all.size(); ++n) all[n] = (std::uint64_t{1} << 32) / n + 1;
    return all;
  }();
  std::uint64_t sum = sizes[parents.slots[0]];
  for (std::size_t i = 1; i < parents_max; ++i) sum += sizes[parents.slots[i]];
  const auto mean = static_cast<std::uint32_t>(sum * reciprocals[parents.count] >> 32);
  return std::min(level_of(level_unit * mean + body_size), level_max);
}

constexpr std::uint32_t weights_level = 44;

/// How far each lane is from that of a prediction.
LaneVector distances(LaneVector move, LaneVector predicted) {
  const auto off = std::bit_cast<SignedLaneVector>((move << fraction_bits) - predicted);
  const SignedLaneVector sign = off >> 31;
  return std::bit_cast<LaneVector>((off ^ sign) - sign);
}

/// `choose` is given a slot and the prediction of its move, and returns the move.
template <class Choose>
std::uint32_t put(const MeshOrder& order, Choose&& choose, MoveScratch& scratch, std::vector<Triple>& triples) {
  const std::size_t count = order.size();
  scratch.errors.resize(count + 1);
  scratch.sizes.resize(count + 1);
  triples.resize(triples.size() + count);
  Triple* const out = triples.data() + (triples.size() - count);
  Lanes* const errors = scratch.errors.data();
  const Lanes* const drifts = scratch.drift.data();
  std::uint32_t* const sizes = scratch.sizes.data();
  const MeshOrder::Parents* const parents = order.parents.data();
  // Of the middling size: a mean of levels, which a few far vertices do not move.
  std::uint64_t level_sum = 0;
  for (std::size_t slot = 0; slot < count; ++slot) {
    const LaneVector drift = drifts[slot].v;
    const LaneVector predicted = drift + mean_error(parents[slot], errors);
    const LaneVector move = choose(slot, predicted);
    const LaneVector parity = __builtin_shufflevector(move, move, 0, 0, 0, 0) & all_lanes(1);
    const Nearest nearest(predicted);
    const LaneVector residuals =
        chosen(first_lane, move - nearest.x(), shifted_down(move - parity, 1) - nearest.yz(parity));
    errors[slot + 1].v = (move << fraction_bits) - drift;
    out[slot] = std::bit_cast<Triple>(residuals);  // their level follows
    sizes[slot + 1] = size_of_residuals(residuals);
    level_sum += level_of(level_unit * sizes[slot + 1]);
  }
  const auto mean_level = static_cast<std::uint32_t>(level_sum / std::max<std::size_t>(count, 1));
  const std::uint32_t level = std::min(mean_level + 1, level_max);
  const std::uint32_t body_size = size_of(level);
  for (std::size_t slot = 0; slot < count; ++slot) out[slot].level = level_at(parents[slot], sizes, body_size);
  return level;
}

/// Run by run: what a slot's level is found from was taken before.
PNEUMA_CLONED void take_residuals(const MeshOrder& order, std::uint32_t level, MoveScratch& scratch,
                                  SymbolReader& symbols) {
  scratch.sizes.resize(order.size() + 1);
  scratch.levels.resize(order.size());
  scratch.residuals.resize(order.size());
  std::uint32_t* const sizes = scratch.sizes.data();
  std::uint8_t* const levels = scratch.levels.data();
  Lanes* const residuals = scratch.residuals.data();
  const MeshOrder::Parents* const parents = order.parents.data();
  const std::uint32_t body_size = size_of(level);
  std::size_t begin = 0;
  for (const std::uint32_t end : order.run_ends) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      levels[slot] = static_cast<std::uint8_t>(level_at(parents[slot], sizes, body_size));
    }
    symbols.take({levels + begin, end - begin}, {residuals + begin, end - begin});
    if (symbols.failed()) return;
    for (std::size_t slot = begin; slot < end; ++slot) {
      sizes[slot + 1] = size_of_residuals(residuals[slot].v);
    }
    begin = end;
  }
}

PNEUMA_CLONED void add_predictions(const MeshOrder& order, MoveScratch& scratch, std::vector<Lanes>& moves) {
  const std::size_t count = order.size();
  scratch.errors.resize(count + 1);
  Lanes* const errors = scratch.errors.data();
  Lanes* const to = moves.data();
  const Lanes* const drifts = scratch.drift.data();
  const Lanes* const residuals = scratch.residuals.data();
  const MeshOrder::Parents* const parents = order.parents.data();
  for (std::size_t slot = 0; slot < count; ++slot) {
    const LaneVector drift = drifts[slot].v;
    const LaneVector residual = residuals[slot].v;
    const Nearest nearest(drift + mean_error(parents[slot], errors));
    const LaneVector x = nearest.x() + residual;
    const LaneVector parity = __builtin_shufflevector(x, x, 0, 0, 0, 0) & all_lanes(1);
    const LaneVector yz = ((nearest.yz(parity) + residual) << 1) + parity;
    const LaneVector move = chosen(first_lane, x, yz);
    to[slot].v = move;
    errors[slot + 1].v = (move << fraction_bits) - drift;
  }
}

}  // namespace

PNEUMA_CLONED std::uint32_t put_moves(const MeshOrder& order, const std::vector<Lanes>& moves, MoveScratch& scratch,
                                      std::vector<Triple>& triples) {
  const Lanes* const all = moves.data();
  return put(order, [all](std::size_t slot, LaneVector) { return all[slot].v; }, scratch, triples);
}

PNEUMA_CLONED std::uint32_t put_either(const MeshOrder& order, const std::vector<Lanes>& alternatives,
                                       MoveScratch& scratch, std::vector<Lanes>& moves, std::vector<Triple>& triples) {
  const Lanes* const others = alternatives.data();
  Lanes* const all = moves.data();
  const auto choose = [others, all](std::size_t slot, LaneVector predicted) {
    const LaneVector other = all[slot].v + others[slot].v;
    // Without a branch: which of two is the nearer one is close to chance. They do not differ in the fourth lane.
    const LaneVector less = distances(other, predicted) - distances(all[slot].v, predicted);
    const LaneVector of_two = less + __builtin_shufflevector(less, less, 1, 0, 3, 2);
    const LaneVector nearer = shifted_down(of_two + __builtin_shufflevector(of_two, of_two, 2, 3, 0, 1), 31);
    all[slot].v = chosen(nearer, other, all[slot].v);
    return all[slot].v;
  };
  return put(order, choose, scratch, triples);
}

void take_moves(const MeshOrder& order, std::uint32_t level, MoveScratch& scratch, SymbolReader& symbols,
                std::vector<Lanes>& moves) {
  moves.resize(order.size());
  take_residuals(order, level, scratch, symbols);
  if (symbols.failed()) return;
  add_predictions(order, scratch, moves);
}

void put_weights(const DriftWeights& weights, std::vector<Triple>& triples) {
  const auto& own = weights.own;
  const auto& ring = weights.ring;
  triples.push_back({own[0], own[1], own[2], weights_level});
  triples.push_back({own[3], ring[0], ring[1], weights_level});
  triples.push_back({ring[2], ring[3], weights.ring_of_ring, weights_level});
}

DriftWeights take_weights(SymbolReader& symbols) {
  constexpr std::array<std::uint8_t, 3> levels{weights_level, weights_level, weights_level};
  std::array<Lanes, levels.size()> triples{};
  symbols.take(levels, triples);
  const auto number = [&triples](std::size_t i) { return static_cast<std::int32_t>(triples[i / 3].v[i % 3]); };
  return {{number(0), number(1), number(2), number(3)}, {number(4), number(5), number(6), number(7)}, number(8)};
}

}  // namespace pneuma::codec
