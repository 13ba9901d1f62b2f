// Residuals as bytes, by three interleaved asymmetric numeral systems (rANS, Duda 2013): proto/WIRE.md, "Residuals".
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codec/lanes.h"
#include "codec/residual_tables.h"

namespace pneuma::codec {

// One for each of the residuals of a point, x y z.
inline constexpr std::size_t state_count = 3;
// A state is at least this between two steps, and below 2^32.
inline constexpr std::uint32_t state_min = 1U << 16;
inline constexpr std::size_t state_bytes = 4;
// Of a residual's low bits, so many are in the same step as its symbol.
inline constexpr std::uint32_t step_low_bits_max = 16 - probability_bits;
inline constexpr int escape_length_bits = 6;

/// Three residuals and the level they are coded at. Stored from a vector register.
struct alignas(16) Triple {
  std::int32_t x;
  std::int32_t y;
  std::int32_t z;
  std::uint32_t level;  // at most level_max
};

/// Writes triples so that they will be read in their order; the coder itself runs backwards.
class SymbolWriter {
 public:
  /// Appends them to `bytes`; nothing for nothing.
  void write(std::span<const Triple> triples, std::string& bytes);

 private:
  class Backwards;
  std::vector<std::uint16_t> words_;  // in the order of writing, which is the last one first
};

/// The words of coded text, and zeros that a SymbolReader may run into. Only those for an odd number of bytes.
void words_of(std::string_view bytes, std::vector<std::uint16_t>& words);
/// What a triple may take at most: each a step, its high bits, and an escape of three more.
inline constexpr std::size_t padding_words = 3 * 5;

/// Reads what a SymbolWriter wrote.
class SymbolReader {
 public:
  /// Of what words_of() gives.
  explicit SymbolReader(std::span<const std::uint16_t> words);

  /// Takes a triple for each of `levels`; none once it has failed.
  void take(std::span<const std::uint8_t> levels, std::span<Lanes> triples);

  /// The text has ended, or is none.
  [[nodiscard]] bool failed() const { return next_ > end_; }
  /// All was read, and the states are back where the writer began.
  [[nodiscard]] bool at_end() const { return next_ == end_ && x_ == state_min && y_ == state_min && z_ == state_min; }

 private:
  /// With escapes, or many low bits.
  [[gnu::noinline]] void take_in_parts(std::uint32_t level, Lanes& triple);
  [[nodiscard]] std::int32_t take_one(std::uint32_t table, std::uint32_t low_bits, std::uint32_t& state);
  [[nodiscard]] std::int32_t take_escaped(std::uint32_t& state);
  [[nodiscard]] std::uint32_t take_plain(std::uint32_t bits, std::uint32_t& state);
  void refill(std::uint32_t& state);

  [[nodiscard]] ResidualTable::Slot slot_of(std::uint32_t table, std::uint32_t shifted_state) const {
    return tables_[table].slots[shifted_state & (probability_total - 1)];
  }
  [[nodiscard]] static std::uint32_t frequency_of(ResidualTable::Slot slot) {
    return (slot >> slot_frequency_shift) & slot_frequency_mask;
  }
  [[nodiscard]] static std::int32_t residual_of(ResidualTable::Slot slot, std::uint32_t low, std::uint32_t low_bits) {
    const std::uint32_t one = 1U << low_bits;
    const auto top = static_cast<std::uint32_t>(static_cast<std::int32_t>(slot) >> slot_residual_shift);
    return static_cast<std::int32_t>((top << low_bits) + (low & (one - 1U)) - (one >> 1));
  }
  void fail() { next_ = end_ + 1; }

  const ResidualTable* tables_;
  // Not beside each other: GCC would keep states that are in one vector, from which each step would have to take them.
  std::uint32_t x_ = state_min;
  const std::uint16_t* next_;
  std::uint32_t y_ = state_min;
  const std::uint16_t* end_;  // of the text; the padding follows
  std::uint32_t z_ = state_min;
};

}  // namespace pneuma::codec
