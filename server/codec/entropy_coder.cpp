#include "codec/entropy_coder.h"

#include <bit>
#include <utility>

namespace pneuma::codec {

namespace {

std::uint32_t folded(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1) ^ static_cast<std::uint32_t>(value >> 31);
}

char* write_word(std::uint32_t word, char* out) {
  out[0] = static_cast<char>(word & 0xffU);
  out[1] = static_cast<char>((word >> 8) & 0xffU);
  return out + 2;
}

}  // namespace

void SymbolWriter::put_in_parts(ResidualModel model, std::int32_t residual) {
  const std::uint32_t raised = static_cast<std::uint32_t>(residual) + ((1U << model.low_bits) >> 1);
  const std::uint32_t low = raised & ((1U << model.low_bits) - 1U);
  const std::int32_t top = static_cast<std::int32_t>(raised) >> model.low_bits;
  const std::uint32_t step_bits = std::min<std::uint32_t>(model.low_bits, step_low_bits_max);
  if (model.low_bits > step_bits) put_plain(low >> step_bits, model.low_bits - step_bits);
  const auto& ranges = tables_[model.table].ranges;
  const bool escapes = top < -residual_max || top > residual_max || ranges[range_of(top)].frequency == 0;
  const ResidualTable::Range range = ranges[range_of(escapes ? escape : top)];
  const std::uint32_t begin = (std::uint32_t{range.begin} << step_bits) | (low & ((1U << step_bits) - 1U));
  steps_.push_back({range.frequency, static_cast<std::uint16_t>(step_bits),
                    static_cast<std::uint16_t>(step_bits + probability_bits), static_cast<std::uint16_t>(begin)});
  if (!escapes) return;
  const std::uint32_t code = folded(residual);
  const std::uint32_t length = std::max(static_cast<std::uint32_t>(std::bit_width(code)), 1U);
  put_plain(length, escape_length_bits);
  if (length > 16) put_plain(code >> 16, length - 16);
  const std::uint32_t low_length = std::min(length, 16U);
  put_plain(code & ((1U << low_length) - 1U), low_length);
}

void SymbolWriter::put_plain(std::uint32_t value, std::uint32_t bits) {
  steps_.push_back({1, 0, static_cast<std::uint16_t>(bits), static_cast<std::uint16_t>(value)});
}

void SymbolWriter::finish(std::string& bytes) {
  if (steps_.empty()) return;
  // A step adds a word at most.
  words_.resize(steps_.size() + 1);
  std::uint16_t* end = words_.data();
  std::uint32_t state = state_min;  // of this step
  std::uint32_t other = state_min;
  if (steps_.size() % 2 == 0) std::swap(state, other);
  for (std::size_t i = steps_.size(); i-- > 0;) {
    const Step step = steps_[i];
    *end = static_cast<std::uint16_t>(state & 0xffffU);
    const bool full = state >> (32 - step.total_bits) >= step.frequency;
    end += static_cast<std::ptrdiff_t>(full);
    state = full ? state >> 16 : state;
    const std::uint32_t rounds = state / step.frequency;
    state = (rounds << step.total_bits) + ((state - rounds * step.frequency) << step.low_bits) + step.begin;
    std::swap(state, other);
  }
  steps_.clear();
  const std::size_t size = bytes.size();
  const auto word_count = static_cast<std::size_t>(end - words_.data());
  bytes.resize(size + 2 * state_bytes + 2 * word_count);
  char* out = bytes.data() + size;
  for (const std::uint32_t first_state : {other, state}) {
    out = write_word(first_state & 0xffffU, out);
    out = write_word(first_state >> 16, out);
  }
  while (end != words_.data()) out = write_word(*--end, out);
}

std::vector<std::uint16_t> words_of(std::string_view bytes) {
  if (bytes.size() % 2 != 0) bytes = {};
  std::vector<std::uint16_t> words(bytes.size() / 2 + padding_words);
  for (std::size_t i = 0; i < bytes.size() / 2; ++i) {
    const unsigned low = static_cast<unsigned char>(bytes[2 * i]);
    const unsigned high = static_cast<unsigned char>(bytes[2 * i + 1]);
    words[i] = static_cast<std::uint16_t>(low | (high << 8));
  }
  return words;
}

}  // namespace pneuma::codec
