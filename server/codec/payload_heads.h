// The heads of a payload: what comes before its residuals, one a body (proto/WIRE.md, "Frame payload").
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/status.h"
#include "codec/prediction.h"
#include "codec/residual_tables.h"

namespace pneuma::codec {

/// The first byte of a payload; readers refuse any other.
inline constexpr std::uint8_t payload_format = 5;

enum class BlockMode : std::uint8_t {
  still = 0,      // every vertex stays
  plain = 1,      // points as they are, then their last moves
  key = 2,        // points against their neighbours', then their last moves
  moved = 3,      // by moves, with weights of their own
  again = 4,      // by moves, with the weights there were
  simulated = 5,  // by moves against those that its mechanics expect
};

/// A list of moves that are all zero, of which nothing more is in the payload.
inline constexpr std::uint8_t level_of_rest = 255;
using HistoryLevels = std::array<std::uint8_t, history_size>;
inline constexpr HistoryLevels history_of_rest{level_of_rest, level_of_rest, level_of_rest, level_of_rest};

struct BlockHead {
  BlockMode mode = BlockMode::still;
  std::uint8_t level = 0;                   // of the points or moves
  std::array<std::int64_t, 3> anchor{};     // key: the point of slot 0
  std::string_view plain;                   // plain: 8 bytes a coordinate
  HistoryLevels history = history_of_rest;  // plain and key
  // Likewise, of the velocities of a body that has mechanics; level_of_rest: they are those of the last moves.
  std::optional<std::uint8_t> velocities{};

  [[nodiscard]] bool stands_alone() const { return mode == BlockMode::plain || mode == BlockMode::key; }
};

void append_coordinate(std::int64_t value, std::string& bytes);
[[nodiscard]] std::int64_t coordinate_at(std::string_view bytes, std::size_t index);

void append_head(const BlockHead& head, std::string& bytes);

/// A body, as far as its heads depend on it.
struct BlockBody {
  std::size_t vertices = 0;
  bool is_simulated = false;
};

/// Takes the format and the heads off `payload`, one a body.
[[nodiscard]] base::Result<std::vector<BlockHead>> take_heads(std::string_view& payload, bool key,
                                                              std::span<const BlockBody> bodies);

[[nodiscard]] base::Status malformed_body(std::size_t body, std::string what);

}  // namespace pneuma::codec
