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

/// Three residuals and the level they are coded at.
struct Triple {
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
/// What a triple may take at most, each a step, its high bits, and an escape of three more; and so that a reader that
/// has failed may look ahead.
inline constexpr std::size_t padding_words = 3 * 5 + 3;

/// Reads what a SymbolWriter wrote. A loop should work on a copy of its own: one that nothing else can reach stays in
/// registers.
class SymbolReader {
 public:
  /// Of what words_of() gives.
  explicit SymbolReader(std::span<const std::uint16_t> words);

  /// Not once it has failed.
  [[nodiscard]] Triple take(std::uint32_t level) {
    const PointModel model = point_models[level];
    const ResidualTable::Slot x_slot = slot_of(model.x_table, x_ >> model.low_bits);
    const ResidualTable::Slot y_slot = slot_of(model.yz_table, y_ >> model.low_bits);
    const ResidualTable::Slot z_slot = slot_of(model.yz_table, z_ >> model.low_bits);
    const bool escapes = ((x_slot | y_slot | z_slot) & slot_escape_bit) != 0;
    if (escapes || model.low_bits > step_low_bits_max) [[unlikely]] {
      SymbolReader apart = *this;
      const Triple triple = apart.take_in_parts(level);
      *this = apart;
      return triple;
    }
    const Triple triple{residual_of(x_slot, x_, model.low_bits), residual_of(y_slot, y_, model.low_bits),
                        residual_of(z_slot, z_, model.low_bits), level};
    // Without a branch: whether a state needs a word is close to chance. The next words lie in one register, and are
    // shifted out as they are taken.
    std::uint64_t words = next_[0] | (std::uint64_t{next_[1]} << 16) | (std::uint64_t{next_[2]} << 32);
    std::uint32_t taken_bits = 0;
    const auto step = [&](ResidualTable::Slot slot, std::uint32_t& state) {
      const std::uint32_t rounds = state >> model.low_bits >> probability_bits;
      const std::uint32_t low = frequency_of(slot) * rounds + (slot & slot_offset_mask);
      const std::uint32_t bits = low < state_min ? 16 : 0;
      state = (low << bits) | (static_cast<std::uint32_t>(words) & ((1U << bits) - 1U));
      words >>= bits;
      taken_bits += bits;
    };
    step(x_slot, x_);
    step(y_slot, y_);
    step(z_slot, z_);
    next_ += taken_bits / 16;
    return triple;
  }

  /// The text has ended, or is none.
  [[nodiscard]] bool failed() const { return next_ > end_; }
  /// All was read, and the states are back where the writer began.
  [[nodiscard]] bool at_end() const { return next_ == end_ && x_ == state_min && y_ == state_min && z_ == state_min; }

 private:
  /// With escapes, or many low bits.
  [[nodiscard]] Triple take_in_parts(std::uint32_t level);
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
  const std::uint16_t* next_;
  const std::uint16_t* end_;  // of the text; the padding follows
  std::uint32_t x_ = state_min;
  std::uint32_t y_ = state_min;
  std::uint32_t z_ = state_min;
};

}  // namespace pneuma::codec
