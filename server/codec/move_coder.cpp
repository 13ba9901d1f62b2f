#include "codec/move_coder.h"

#include <algorithm>

namespace pneuma::codec {

namespace {

// A residual's size counts four times in the sums that choose levels, so that quarter octaves begin below one step.
constexpr std::uint32_t size_unit = 4;
// So that no sum of sizes overflows.
constexpr std::uint64_t size_max = 1U << 24;
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

/// The nearest whole steps to a move predicted in 256ths.
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

template <Neighbours neighbours>
void find_residuals(const MeshOrder& order, const std::vector<Lanes>& moves, MoveScratch& scratch) {
  Lanes* const found = scratch.found.data();
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    const LaneVector predicted = scratch.drift[slot].v + from_neighbours<neighbours>(order, slot, found);
    const LaneVector move = moves[slot].v;
    const std::uint32_t parity = move[0] & 1U;
    const std::uint32_t x = move[0] - nearest(predicted[0]);
    const std::uint32_t y = signed_shift(move[1] - parity, 1) - nearest_double(predicted[1], parity);
    const std::uint32_t z = signed_shift(move[2] - parity, 1) - nearest_double(predicted[2], parity);
    scratch.residuals[slot].v = LaneVector{x, y, z, 0};
    found[slot + 1].v = found_at(move, scratch.drift[slot].v, size_of_residual(x, y, z));
  }
}

void find_residuals(const MeshOrder& order, Neighbours neighbours, const std::vector<Lanes>& moves,
                    MoveScratch& scratch) {
  scratch.found.resize(order.size() + 1);
  scratch.residuals.resize(order.size());
  switch (neighbours) {
    case Neighbours::ignored:
      return find_residuals<Neighbours::ignored>(order, moves, scratch);
    case Neighbours::mean:
      return find_residuals<Neighbours::mean>(order, moves, scratch);
    case Neighbours::parallelogram:
      return find_residuals<Neighbours::parallelogram>(order, moves, scratch);
  }
}

template <Neighbours neighbours>
std::uint32_t neighbours_size(const MeshOrder& order, std::size_t slot, const Found& found) {
  if constexpr (neighbours == Neighbours::parallelogram) {
    const auto& p = order.parallelograms[slot];
    return found[p[0]].v[3] + found[p[1]].v[3] + found[p[2]].v[3] + found[p[3]].v[3];
  } else {
    const auto& p = order.parents[slot];
    return found[p[0]].v[3] + found[p[1]].v[3] + found[p[2]].v[3] + found[p[3]].v[3];
  }
}

template <Neighbours neighbours>
void put_residuals(const MeshOrder& order, std::uint32_t body_size, const MoveScratch& scratch, SymbolWriter& symbols) {
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    const PointModel model =
        point_models[level_of(neighbours_size<neighbours>(order, slot, scratch.found) + body_size)];
    const LaneVector residual = scratch.residuals[slot].v;
    symbols.put(model.x, static_cast<std::int32_t>(residual[0]));
    symbols.put(model.yz, static_cast<std::int32_t>(residual[1]));
    symbols.put(model.yz, static_cast<std::int32_t>(residual[2]));
  }
}

template <Neighbours neighbours>
void take_residuals(const MeshOrder& order, std::uint32_t body_size, MoveScratch& scratch, SymbolReader& reader,
                    std::vector<Lanes>& moves) {
  SymbolReader symbols = reader;
  Lanes* const found = scratch.found.data();
  for (std::size_t slot = 0; slot < order.size(); ++slot) {
    const LaneVector drift = scratch.drift[slot].v;
    if (symbols.failed()) break;
    const LaneVector around = from_neighbours<neighbours>(order, slot, found);
    const LaneVector predicted = drift + around;
    const PointModel model = point_models[level_of(around[3] + body_size)];
    const auto x = static_cast<std::uint32_t>(symbols.take(model.x));
    const auto y = static_cast<std::uint32_t>(symbols.take(model.yz));
    const auto z = static_cast<std::uint32_t>(symbols.take(model.yz));
    const std::uint32_t move_x = nearest(predicted[0]) + x;
    const std::uint32_t parity = move_x & 1U;
    const LaneVector move = {move_x, 2 * (nearest_double(predicted[1], parity) + y) + parity,
                             2 * (nearest_double(predicted[2], parity) + z) + parity, 0};
    moves[slot].v = move;
    found[slot + 1].v = found_at(move, drift, size_of_residual(x, y, z));
  }
  reader = symbols;
}

}  // namespace

std::uint32_t put_moves(const MeshOrder& order, Neighbours neighbours, const std::vector<Lanes>& moves,
                        MoveScratch& scratch, SymbolWriter& symbols) {
  find_residuals(order, neighbours, moves, scratch);
  // The level of four neighbours of the middling size: a mean of levels, which a few far vertices do not move.
  std::uint64_t level_sum = 0;
  for (std::size_t i = 1; i < scratch.found.size(); ++i) level_sum += level_of(4 * scratch.found[i].v[3]);
  const auto mean_level = static_cast<std::uint32_t>(level_sum / std::max<std::size_t>(order.size(), 1));
  const std::uint32_t level = std::min(mean_level + 2, level_max);
  switch (neighbours) {
    case Neighbours::ignored:
      put_residuals<Neighbours::ignored>(order, size_of(level), scratch, symbols);
      break;
    case Neighbours::mean:
      put_residuals<Neighbours::mean>(order, size_of(level), scratch, symbols);
      break;
    case Neighbours::parallelogram:
      put_residuals<Neighbours::parallelogram>(order, size_of(level), scratch, symbols);
      break;
  }
  return level;
}

void take_moves(const MeshOrder& order, Neighbours neighbours, std::uint32_t level, MoveScratch& scratch,
                SymbolReader& symbols, std::vector<Lanes>& moves) {
  scratch.found.resize(order.size() + 1);
  moves.resize(order.size());
  switch (neighbours) {
    case Neighbours::ignored:
      return take_residuals<Neighbours::ignored>(order, size_of(level), scratch, symbols, moves);
    case Neighbours::mean:
      return take_residuals<Neighbours::mean>(order, size_of(level), scratch, symbols, moves);
    case Neighbours::parallelogram:
      return take_residuals<Neighbours::parallelogram>(order, size_of(level), scratch, symbols, moves);
  }
}

}  // namespace pneuma::codec
