// The heads of a payload: what comes before its residuals, one a body (proto/WIRE.md, "Frame payload").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "codec/prediction.h"
#include "codec/residual_tables.h"

namespace pneuma::codec {

/// The first byte of a payload; readers refuse any other.
inline constexpr std::uint8_t payload_format = 3;

enum class BlockMode : std::uint8_t {
  still = 0,                // every vertex stays
  plain = 1,                // points as they are, then their last moves
  key = 2,                  // points against their neighbours', then their last moves
  moved = 3,                // and one more for each way to use the neighbours:
  moved_mean = 4,           //
  moved_parallelogram = 5,  //
};

/// A list of moves that are all zero, of which nothing more is in the payload.
inline constexpr std::uint8_t level_of_rest = 255;

struct BlockHead {
  BlockMode mode = BlockMode::still;
  std::uint8_t level = 0;                   // of the points or moves
  DriftWeights weights;                     // moved
  std::array<std::int64_t, 3> anchor{};     // key: the point of slot 0
  std::string_view plain;                   // plain: 8 bytes a coordinate
  std::uint8_t move_level = level_of_rest;  // plain and key
  std::uint8_t before_level = level_of_rest;

  [[nodiscard]] bool stands_alone() const { return mode == BlockMode::plain || mode == BlockMode::key; }
  [[nodiscard]] Neighbours neighbours() const {
    return static_cast<Neighbours>(static_cast<int>(mode) - static_cast<int>(BlockMode::moved));
  }
};

void append_coordinate(std::int64_t value, std::string& bytes);
[[nodiscard]] std::int64_t coordinate_at(std::string_view bytes, std::size_t index);

void append_head(const BlockHead& head, std::string& bytes);

/// Takes the format and the heads off `payload`, one for each of `vertex_counts`.
[[nodiscard]] base::Result<std::vector<BlockHead>> take_heads(std::string_view& payload, bool key,
                                                              std::span<const std::size_t> vertex_counts);

[[nodiscard]] base::Status malformed_body(std::size_t body, std::string what);

}  // namespace pneuma::codec
