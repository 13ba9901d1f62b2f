// Residuals as bytes, by two interleaved asymmetric numeral systems (rANS, Duda 2013): proto/WIRE.md, "Residuals".
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "codec/residual_tables.h"

namespace pneuma::codec {

// A state is at least this between two steps, and below 2^32.
inline constexpr std::uint32_t state_min = 1U << 16;
inline constexpr std::size_t state_bytes = 4;
// Of a residual's low bits, so many are in the same step as its symbol.
inline constexpr std::uint32_t step_low_bits_max = 16 - probability_bits;
inline constexpr int escape_length_bits = 6;

/// Collects residuals in the order in which they will be read; the coder itself runs backwards.
class SymbolWriter {
 public:
  void put(ResidualModel model, std::int32_t residual) {
    const ResidualTable& table = tables_[model.table];
    if (model.low_bits == 0 && residual >= -residual_max && residual <= residual_max) [[likely]] {
      const ResidualTable::Range range = table.ranges[range_of(residual)];
      if (range.frequency != 0) [[likely]] {
        steps_.push_back({range.frequency, 0, probability_bits, range.begin});
        return;
      }
    }
    put_in_parts(model, residual);
  }
  /// Appends what was put since the last call; nothing for nothing.
  void finish(std::string& bytes);

 private:
  struct Step {
    std::uint16_t frequency;
    std::uint16_t low_bits;
    std::uint16_t total_bits;
    std::uint16_t begin;  // with the low bits
  };

  void put_in_parts(ResidualModel model, std::int32_t residual);
  void put_plain(std::uint32_t value, std::uint32_t bits);

  const ResidualTable* tables_ = residual_tables().data();
  std::vector<Step> steps_;
  std::vector<std::uint16_t> words_;  // in the order of writing, which is the last one first
};

/// The words of coded text, and zeros that a SymbolReader may run into. Only those for an odd number of bytes.
[[nodiscard]] std::vector<std::uint16_t> words_of(std::string_view bytes);
/// What three residuals may take at most: each a step, its high bits, and an escape of three more.
inline constexpr std::size_t padding_words = 3 * 5;

/// Reads what a SymbolWriter wrote. A loop should work on a copy of its own: one that nothing else can reach stays in
/// registers.
class SymbolReader {
 public:
  /// Of what words_of() gives.
  explicit SymbolReader(std::span<const std::uint16_t> words)
      : tables_(residual_tables().data()), next_(words.data()), end_(next_ + words.size() - padding_words) {
    if (next_ == end_) return;  // good where nothing is taken
    state_ = next_[0] | (std::uint32_t{next_[1]} << 16);
    other_ = next_[2] | (std::uint32_t{next_[3]} << 16);
    next_ += 4;
    broken_ = state_ < state_min || other_ < state_min;
  }

  /// At most three before failed() is asked.
  [[nodiscard]] std::int32_t take(ResidualModel model) {
    if (model.low_bits != 0) return take_in_parts(model);
    const ResidualTable::Slot slot = tables_[model.table].slots[state_ & (probability_total - 1)];
    step(frequency_of(slot) * (state_ >> probability_bits) + (slot & slot_mask));
    const std::int32_t residual = static_cast<std::int32_t>(slot) >> slot_residual_shift;
    if (residual == escape) [[unlikely]]
      return take_escaped();
    return residual;
  }

  /// The text has ended, or is none.
  [[nodiscard]] bool failed() const { return next_ > end_ || broken_; }
  /// All was read, and the states are back where the writer began.
  [[nodiscard]] bool at_end() const { return next_ == end_ && state_ == state_min && other_ == state_min; }

 private:
  [[nodiscard]] static std::uint32_t frequency_of(ResidualTable::Slot slot) {
    return (slot >> slot_frequency_shift) & slot_mask;
  }

  // Without a branch: whether a step needs a word is close to chance.
  void step(std::uint32_t state) {
    const bool low = state < state_min;
    const std::uint32_t refilled = (state << 16) | *next_;
    next_ += static_cast<std::ptrdiff_t>(low);
    state_ = other_;
    other_ = low ? refilled : state;
  }
  [[nodiscard]] std::uint32_t take_plain(std::uint32_t bits) {
    const std::uint32_t value = state_ & ((1U << bits) - 1U);
    step(state_ >> bits);
    return value;
  }
  [[nodiscard]] std::int32_t take_in_parts(ResidualModel model) {
    const std::uint32_t low_bits = std::min<std::uint32_t>(model.low_bits, step_low_bits_max);
    const std::uint32_t high_bits = model.low_bits - low_bits;
    const std::uint32_t high = high_bits == 0 ? 0 : take_plain(high_bits) << low_bits;
    const ResidualTable::Slot slot = tables_[model.table].slots[(state_ >> low_bits) & (probability_total - 1)];
    const std::uint32_t low = state_ & ((1U << low_bits) - 1U);
    step(frequency_of(slot) * (state_ >> (low_bits + probability_bits)) + (slot & slot_mask));
    const std::int32_t top = static_cast<std::int32_t>(slot) >> slot_residual_shift;
    if (top == escape) [[unlikely]]
      return take_escaped();
    const std::uint32_t half = 1U << (model.low_bits - 1);
    return static_cast<std::int32_t>((static_cast<std::uint32_t>(top) << model.low_bits) + (high | low) - half);
  }
  [[nodiscard]] std::int32_t take_escaped() {
    const std::uint32_t length = take_plain(escape_length_bits);
    if (length == 0 || length > 32) {
      broken_ = true;
      return 0;
    }
    std::uint32_t code = 0;
    if (length > 16) code = take_plain(length - 16) << 16;
    code |= take_plain(std::min(length, 16U));
    return static_cast<std::int32_t>((code >> 1) ^ (0 - (code & 1U)));
  }

  const ResidualTable* tables_;
  const std::uint16_t* next_;
  const std::uint16_t* end_;         // of the text; the padding follows
  std::uint32_t state_ = state_min;  // of the next step
  std::uint32_t other_ = state_min;
  bool broken_ = false;
};

}  // namespace pneuma::codec
