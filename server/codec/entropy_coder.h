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
/// What a triple may take at most: each a step, its high bits, and an escape of three more.
inline constexpr std::size_t padding_words = 3 * 5;

/// Reads what a SymbolWriter wrote. A loop should work on a copy of its own: one that nothing else can reach stays in
/// registers.
class SymbolReader {
 public:
  /// Of what words_of() gives.
  explicit SymbolReader(std::span<const std::uint16_t> words)
      : tables_(residual_tables().data()), next_(words.data()), end_(next_ + words.size() - padding_words) {
    if (next_ == end_) return;  // good where nothing is taken
    for (std::uint32_t& state : states_) {
      state = next_[0] | (std::uint32_t{next_[1]} << 16);
      next_ += 2;
      broken_ = broken_ || state < state_min;
    }
  }

  [[nodiscard]] Triple take(std::uint32_t level) {
    const PointModel model = point_models[level];
    const std::int32_t x = take(model.x_table, model.low_bits, states_[0]);
    const std::int32_t y = take(model.yz_table, model.low_bits, states_[1]);
    const std::int32_t z = take(model.yz_table, model.low_bits, states_[2]);
    return {x, y, z, level};
  }

  /// The text has ended, or is none. To be asked before each triple.
  [[nodiscard]] bool failed() const { return next_ > end_ || broken_; }
  /// All was read, and the states are back where the writer began.
  [[nodiscard]] bool at_end() const {
    return next_ == end_ && !broken_ && std::ranges::all_of(states_, [](auto state) { return state == state_min; });
  }

 private:
  // Without a branch: whether a step needs a word is close to chance.
  void step(std::uint32_t next_state, std::uint32_t& state) {
    const bool low = next_state < state_min;
    const std::uint32_t refilled = (next_state << 16) | *next_;
    next_ += static_cast<std::ptrdiff_t>(low);
    state = low ? refilled : next_state;
  }
  [[nodiscard]] std::uint32_t take_plain(std::uint32_t bits, std::uint32_t& state) {
    const std::uint32_t value = state & ((1U << bits) - 1U);
    step(state >> bits, state);
    return value;
  }
  [[nodiscard]] std::int32_t take(std::uint32_t table, std::uint32_t low_bits, std::uint32_t& state) {
    if (low_bits > step_low_bits_max) [[unlikely]] {
      const std::uint32_t high = take_plain(low_bits - step_low_bits_max, state) << step_low_bits_max;
      return take_step(table, step_low_bits_max, high, low_bits, state);
    }
    return take_step(table, low_bits, 0, low_bits, state);
  }
  /// A residual of so many low bits, of which `step_bits` are in the step and the others known.
  [[nodiscard]] std::int32_t take_step(std::uint32_t table, std::uint32_t step_bits, std::uint32_t high,
                                       std::uint32_t low_bits, std::uint32_t& state) {
    const ResidualTable::Slot slot = tables_[table].slots[(state >> step_bits) & (probability_total - 1)];
    const std::uint32_t low = high | (state & ((1U << step_bits) - 1U));
    const std::uint32_t frequency = (slot >> slot_frequency_shift) & slot_mask;
    step(frequency * ((state >> step_bits) >> probability_bits) + (slot & slot_mask), state);
    const std::int32_t top = static_cast<std::int32_t>(slot) >> slot_residual_shift;
    if (top == escape) [[unlikely]]
      return take_escaped(state);
    const std::uint32_t half = (1U << low_bits) >> 1;
    return static_cast<std::int32_t>((static_cast<std::uint32_t>(top) << low_bits) + low - half);
  }
  [[nodiscard]] std::int32_t take_escaped(std::uint32_t& state) {
    const std::uint32_t length = take_plain(escape_length_bits, state);
    if (length == 0 || length > 32) {
      broken_ = true;
      return 0;
    }
    std::uint32_t code = 0;
    if (length > 16) code = take_plain(length - 16, state) << 16;
    code |= take_plain(std::min(length, 16U), state);
    return static_cast<std::int32_t>((code >> 1) ^ (0 - (code & 1U)));
  }

  const ResidualTable* tables_;
  const std::uint16_t* next_;
  const std::uint16_t* end_;  // of the text; the padding follows
  std::array<std::uint32_t, state_count> states_{state_min, state_min, state_min};
  bool broken_ = false;
};

}  // namespace pneuma::codec
