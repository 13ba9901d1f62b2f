#include "codec/entropy_coder.h"

#include <bit>
#include <cassert>
#include <cstring>

#include "codec/clones.h"

namespace pneuma::codec {

namespace {

std::uint32_t folded(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1) ^ static_cast<std::uint32_t>(value >> 31);
}

/// The first in the lowest bits.
std::uint64_t next_words(const std::uint16_t* from) {
  if constexpr (std::endian::native == std::endian::little) {
    std::uint64_t words = 0;
    std::memcpy(&words, from, sizeof(words));
    return words;
  }
  return from[0] | (std::uint64_t{from[1]} << 16) | (std::uint64_t{from[2]} << 32);
}

char* write_word(std::uint32_t word, char* out) {
  out[0] = static_cast<char>(word & 0xffU);
  out[1] = static_cast<char>((word >> 8) & 0xffU);
  return out + 2;
}

}  // namespace

/// Puts steps, the last one first.
class SymbolWriter::Backwards {
 public:
  explicit Backwards(std::uint16_t* out) : end_(out) {}

  void put(std::uint32_t table, std::uint32_t low_bits, std::int32_t residual, std::uint32_t& state) {
    const std::uint32_t raised = static_cast<std::uint32_t>(residual) + ((1U << low_bits) >> 1);
    const std::uint32_t top = static_cast<std::uint32_t>(static_cast<std::int32_t>(raised) >> low_bits);
    const auto& ranges = tables_[table].ranges;
    const std::uint32_t place = top + static_cast<std::uint32_t>(residual_max);
    ResidualTable::Range range = ranges[std::min<std::uint32_t>(place, range_count - 1)];
    if (place >= range_count - 1 || range.frequency == 0) [[unlikely]] {
      put_escaped(residual, state);
      range = ranges.back();
    }
    const std::uint32_t step_bits = std::min<std::uint32_t>(low_bits, step_low_bits_max);
    const std::uint32_t low = raised & ((1U << step_bits) - 1U);
    renormalise(range.frequency, step_bits + probability_bits, state);
    const auto rounds = static_cast<std::uint32_t>((std::uint64_t{state} * range.reciprocal) >> range.reciprocal_shift);
    const std::uint32_t rest = state - rounds * range.frequency + range.begin;
    state = (((rounds << probability_bits) + rest) << step_bits) + low;
    if (low_bits > step_bits) [[unlikely]] {
      put_plain((raised & ((1U << low_bits) - 1U)) >> step_bits, low_bits - step_bits, state);
    }
  }

  [[nodiscard]] std::uint16_t* end() const { return end_; }

 private:
  void renormalise(std::uint32_t frequency, std::uint32_t bits, std::uint32_t& state) {
    *end_ = static_cast<std::uint16_t>(state & 0xffffU);
    const bool full = state >> (32 - bits) >= frequency;
    end_ += static_cast<std::ptrdiff_t>(full);
    state = full ? state >> 16 : state;
  }
  void put_plain(std::uint32_t value, std::uint32_t bits, std::uint32_t& state) {
    renormalise(1, bits, state);
    state = (state << bits) + value;
  }
  void put_escaped(std::int32_t residual, std::uint32_t& state) {
    const std::uint32_t code = folded(residual);
    const std::uint32_t length = std::max(static_cast<std::uint32_t>(std::bit_width(code)), 1U);
    const std::uint32_t low_length = std::min(length, 16U);
    put_plain(code & ((1U << low_length) - 1U), low_length, state);
    if (length > 16) put_plain(code >> 16, length - 16, state);
    put_plain(length, escape_length_bits, state);
  }

  const ResidualTable* tables_ = residual_tables().data();
  std::uint16_t* end_;
};

PNEUMA_CLONED void SymbolWriter::write(std::span<const Triple> triples, std::string& bytes) {
  if (triples.empty()) return;
  words_.resize(padding_words * triples.size() + 1);
  Backwards steps(words_.data());
  std::uint32_t x_state = state_min;
  std::uint32_t y_state = state_min;
  std::uint32_t z_state = state_min;
  for (std::size_t i = triples.size(); i-- > 0;) {
    const Triple& triple = triples[i];
    const PointModel& model = point_models[triple.level];
    steps.put(model.yz_table, model.low_bits, triple.z, z_state);
    steps.put(model.yz_table, model.low_bits, triple.y, y_state);
    steps.put(model.x_table, model.low_bits, triple.x, x_state);
  }
  const std::size_t size = bytes.size();
  const auto word_count = static_cast<std::size_t>(steps.end() - words_.data());
  bytes.resize(size + state_count * state_bytes + 2 * word_count);
  char* out = bytes.data() + size;
  for (const std::uint32_t state : {x_state, y_state, z_state}) {
    out = write_word(state & 0xffffU, out);
    out = write_word(state >> 16, out);
  }
  for (std::size_t i = word_count; i-- > 0;) out = write_word(words_[i], out);
}

SymbolReader::SymbolReader(std::span<const std::uint16_t> words)
    : tables_(residual_tables().data()), next_(words.data()), end_(next_ + words.size() - padding_words) {
  if (next_ == end_) return;  // good where nothing is taken
  for (std::uint32_t* const state : {&x_, &y_, &z_}) {
    *state = next_[0] | (std::uint32_t{next_[1]} << 16);
    next_ += 2;
  }
  if (std::min({x_, y_, z_}) < state_min) fail();
}

PNEUMA_CLONED void SymbolReader::take(std::span<const std::uint8_t> levels, std::span<Lanes> triples) {
  assert(levels.size() == triples.size());
  // In registers: what is reached through `this` might be what is written.
  std::uint32_t x = x_;
  std::uint32_t y = y_;
  std::uint32_t z = z_;
  const std::uint16_t* next = next_;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const PointModel& model = point_models[levels[i]];
    const std::uint32_t low_bits = model.low_bits;
    const ResidualTable::Slot x_slot = slot_of(model.x_table, x >> low_bits);
    const ResidualTable::Slot y_slot = slot_of(model.yz_table, y >> low_bits);
    const ResidualTable::Slot z_slot = slot_of(model.yz_table, z >> low_bits);
    const bool escapes = ((x_slot | y_slot | z_slot) & slot_escape_bit) != 0;
    if (escapes || low_bits > step_low_bits_max || next > end_) [[unlikely]] {
      x_ = x;
      y_ = y;
      z_ = z;
      next_ = next;
      if (failed()) return;
      take_in_parts(levels[i], triples[i]);
      x = x_;
      y = y_;
      z = z_;
      next = next_;
      continue;
    }
    triples[i].v = std::bit_cast<LaneVector>(SignedLaneVector{
        residual_of(x_slot, x, low_bits), residual_of(y_slot, y, low_bits), residual_of(z_slot, z, low_bits), 0});
    // Without a branch: whether a state needs a word is close to chance. The next words lie in one register, and are
    // shifted out as they are taken.
    std::uint64_t words = next_words(next);
    std::uint32_t taken_bits = 0;
    const auto step = [&](ResidualTable::Slot slot, std::uint32_t& state) {
      const std::uint32_t rounds = state >> low_bits >> probability_bits;
      const std::uint32_t low = frequency_of(slot) * rounds + (slot & slot_offset_mask);
      const std::uint32_t bits = low < state_min ? 16 : 0;
      state = (low << bits) | (static_cast<std::uint32_t>(words) & ((1U << bits) - 1U));
      words >>= bits;
      taken_bits += bits;
    };
    step(x_slot, x);
    step(y_slot, y);
    step(z_slot, z);
    next += taken_bits / 16;
  }
  x_ = x;
  y_ = y;
  z_ = z;
  next_ = next;
}

void SymbolReader::take_in_parts(std::uint32_t level, Lanes& triple) {
  const PointModel& model = point_models[level];
  const std::int32_t x = take_one(model.x_table, model.low_bits, x_);
  const std::int32_t y = take_one(model.yz_table, model.low_bits, y_);
  const std::int32_t z = take_one(model.yz_table, model.low_bits, z_);
  triple.v = std::bit_cast<LaneVector>(SignedLaneVector{x, y, z, 0});
}

std::int32_t SymbolReader::take_one(std::uint32_t table, std::uint32_t low_bits, std::uint32_t& state) {
  const std::uint32_t step_bits = std::min(low_bits, step_low_bits_max);
  const std::uint32_t high = low_bits > step_bits ? take_plain(low_bits - step_bits, state) << step_bits : 0;
  const ResidualTable::Slot slot = slot_of(table, state >> step_bits);
  const std::uint32_t low = high | (state & ((1U << step_bits) - 1U));
  state = frequency_of(slot) * (state >> step_bits >> probability_bits) + (slot & slot_offset_mask);
  refill(state);
  return (slot & slot_escape_bit) != 0 ? take_escaped(state) : residual_of(slot, low, low_bits);
}

std::int32_t SymbolReader::take_escaped(std::uint32_t& state) {
  const std::uint32_t length = take_plain(escape_length_bits, state);
  if (length == 0 || length > 32) {
    fail();
    return 0;
  }
  std::uint32_t code = 0;
  if (length > 16) code = take_plain(length - 16, state) << 16;
  code |= take_plain(std::min(length, 16U), state);
  return static_cast<std::int32_t>((code >> 1) ^ (0 - (code & 1U)));
}

std::uint32_t SymbolReader::take_plain(std::uint32_t bits, std::uint32_t& state) {
  const std::uint32_t value = state & ((1U << bits) - 1U);
  state >>= bits;
  refill(state);
  return value;
}

void SymbolReader::refill(std::uint32_t& state) {
  if (state < state_min) state = (state << 16) | *next_++;
}

void words_of(std::string_view bytes, std::vector<std::uint16_t>& words) {
  if (bytes.size() % 2 != 0) bytes = {};
  words.assign(bytes.size() / 2 + padding_words, 0);
  for (std::size_t i = 0; i < bytes.size() / 2; ++i) {
    const unsigned low = static_cast<unsigned char>(bytes[2 * i]);
    const unsigned high = static_cast<unsigned char>(bytes[2 * i + 1]);
    words[i] = static_cast<std::uint16_t>(low | (high << 8));
  }
}

}  // namespace pneuma::codec
