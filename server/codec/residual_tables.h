// How likely each residual is, given the size expected of it: fixed tables in whole numbers, the same on both sides
// (proto/WIRE.md, "Residuals").
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace pneuma::codec {

// Probabilities are counted in 1,024ths.
inline constexpr int probability_bits = 10;
inline constexpr std::uint32_t probability_total = 1U << probability_bits;
inline constexpr std::int32_t residual_max = 31;  // in size; what is larger escapes
inline constexpr std::int32_t escape = residual_max + 1;
inline constexpr std::size_t range_count = 2 * residual_max + 2;  // from -residual_max to the escape

inline std::size_t range_of(std::int32_t residual) {
  return static_cast<std::size_t>(std::int64_t{residual} + residual_max);
}

/// A level is a size on a scale of quarter octaves, which begins in single steps.
inline std::uint32_t level_of(std::uint32_t size) {
  const std::uint32_t raised = size + 4;
  const auto octave = static_cast<std::uint32_t>(std::bit_width(raised)) - 3;
  return 4 * octave + ((raised >> octave) & 3U);
}
/// The least size of a level.
inline std::uint32_t size_of(std::uint32_t level) {
  return ((4 + (level & 3U)) << (level / 4)) - 4;
}
inline constexpr std::uint32_t level_max = 91;

/// The residuals of one expected size, without their low bits.
struct ResidualTable {
  /// Of the range that the coder's state points into: the residual (the upper 8 bits, signed), whether it is the escape
  /// (1 bit), the length of the range (11) and how far in the slot is (12).
  using Slot = std::uint32_t;
  struct Range {
    std::uint16_t frequency = 0;  // 0: cannot be written by itself, but as an escape
    std::uint16_t begin = 0;
    // A state below 2^22 frequency, over the frequency, is its product with the reciprocal, shifted down.
    std::uint32_t reciprocal_shift = 0;
    std::uint64_t reciprocal = 0;
  };
  std::array<Slot, probability_total> slots;
  std::array<Range, range_count> ranges;
};
inline constexpr int slot_residual_shift = 24;
inline constexpr int slot_frequency_shift = 12;
inline constexpr std::uint32_t slot_frequency_mask = 0x7ff;
inline constexpr std::uint32_t slot_offset_mask = 0xfff;
inline constexpr std::uint32_t slot_escape_bit = 1U << 23;

inline constexpr std::uint32_t table_count = 16;
// A table is for half an octave; all that a body's residuals need lie in the processor's nearest cache.
inline constexpr std::uint32_t levels_a_table = 2;

/// How the residuals of a level are coded: by which tables, and how many low bits of each go apart, as they are. y and
/// z go in double steps once x is known: half the size, an octave.
struct PointModel {
  std::uint8_t x_table = 0;
  std::uint8_t yz_table = 0;
  std::uint8_t low_bits = 0;
};
inline constexpr std::array<PointModel, level_max + 1> point_models = [] {
  std::array<PointModel, level_max + 1> models{};
  for (std::uint32_t level = 0; level < models.size(); ++level) {
    // Past the last table, the last octave of them again, with a low bit more an octave.
    const std::uint32_t table = level / levels_a_table;
    const std::uint32_t octaves = table < table_count ? 0 : table / 2 - (table_count / 2 - 1);
    const std::uint32_t of_x = table - 2 * octaves;
    models[level] = {static_cast<std::uint8_t>(of_x), static_cast<std::uint8_t>(of_x < 2 ? 0 : of_x - 2),
                     static_cast<std::uint8_t>(octaves)};
  }
  return models;
}();

[[nodiscard]] const std::array<ResidualTable, table_count>& residual_tables();

}  // namespace pneuma::codec
