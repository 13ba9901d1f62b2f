// The moves of a body's vertices as residuals of their predictions, and back.
#pragma once

#include <cstdint>
#include <vector>

#include "codec/entropy_coder.h"
#include "codec/lanes.h"
#include "codec/mesh_order.h"
#include "codec/prediction.h"

namespace pneuma::codec {

/// Tables of one body, kept for their memory.
struct MoveScratch {
  std::vector<Lanes> drift;
  std::vector<Lanes> ring;
  Errors errors;
  std::vector<std::uint32_t> sizes;  // of the residuals; entry 0 is of nothing
  std::vector<std::uint8_t> levels;
  std::vector<Lanes> residuals;
};

/// Appends the residuals of `moves` (points of the grid) against scratch.drift and their neighbours; returns the level
/// that they were coded at, which the reader must know.
std::uint32_t put_moves(const MeshOrder& order, const std::vector<Lanes>& moves, MoveScratch& scratch,
                        std::vector<Triple>& triples);
/// Likewise, of moves that may be more by `alternatives`: each is left as that one of the two that is expected more.
std::uint32_t put_either(const MeshOrder& order, const std::vector<Lanes>& alternatives, MoveScratch& scratch,
                         std::vector<Lanes>& moves, std::vector<Triple>& triples);
/// Takes what put_moves put; sets `moves`, to anything where the symbols have failed.
void take_moves(const MeshOrder& order, std::uint32_t level, MoveScratch& scratch, SymbolReader& symbols,
                std::vector<Lanes>& moves);

/// The weights of a moved block, before its residuals.
void put_weights(const DriftWeights& weights, std::vector<Triple>& triples);
[[nodiscard]] DriftWeights take_weights(SymbolReader& symbols);

}  // namespace pneuma::codec
