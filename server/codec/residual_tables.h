// How likely each residual is, given the size expected of it: fixed tables in whole numbers, the same on both sides
// (proto/WIRE.md, "Residuals").
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace pneuma::codec {

// Probabilities are counted in 2,048ths.
inline constexpr int probability_bits = 11;
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
inline constexpr std::uint32_t level_max = 91;  // of a body; of a sum of sizes, level_of() is below 128

/// The residuals of one expected size, without their low bits.
struct ResidualTable {
  /// Of the range that the coder's state points into: the residual (8 bits, signed), the length of its range (12) and
  /// how far in the slot is (12).
  using Slot = std::uint32_t;
  struct Range {
    std::uint16_t frequency = 0;  // 0: cannot be written by itself, but as an escape
    std::uint16_t begin = 0;
  };
  std::array<Slot, probability_total> slots;
  std::array<Range, range_count> ranges;
};
inline constexpr int slot_residual_shift = 24;
inline constexpr int slot_frequency_shift = 12;
inline constexpr std::uint32_t slot_mask = 0xfff;

inline constexpr std::uint32_t table_count = 32;

/// How residuals of a level are coded: by which table, and how many low bits go apart, as they are.
struct ResidualModel {
  std::uint8_t table = 0;
  std::uint8_t low_bits = 0;
};
/// Of the x of a point, and of its y and z, which go in double steps once x is known: half the size, an octave.
struct PointModel {
  ResidualModel x;
  ResidualModel yz;
};
inline constexpr std::array<PointModel, 128> point_models = [] {
  const auto model = [](std::uint32_t level) {
    // Past the last table, the last octave of them again, with a low bit more an octave.
    const std::uint32_t octaves = level < table_count ? 0 : level / 4 - (table_count / 4 - 1);
    return ResidualModel{static_cast<std::uint8_t>(level - 4 * octaves), static_cast<std::uint8_t>(octaves)};
  };
  std::array<PointModel, 128> models{};
  for (std::uint32_t level = 0; level < models.size(); ++level) {
    const std::uint32_t coded = level < level_max ? level : level_max;
    models[level] = {model(coded), model(coded < 4 ? 0 : coded - 4)};
  }
  return models;
}();

[[nodiscard]] const std::array<ResidualTable, table_count>& residual_tables();

}  // namespace pneuma::codec
