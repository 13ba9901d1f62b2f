#include "codec/frame_codec.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <utility>

#include "codec/bit_stream.h"

namespace pneuma::codec {

namespace {

enum class Mode : unsigned char { unchanged = 0, delta = 1, key = 2 };

constexpr int axes = 3;
constexpr int parameter_bits = 6;
// So many one bits say that a value follows in plain: 6 bits of its length less one, then the value.
constexpr int escape_ones = 16;
constexpr int length_bits = 6;

// Coordinates wrap around modulo 2^64, so that any bytes decode to something and no sum overflows.

std::uint64_t zigzag(std::uint64_t difference) {
  return (difference << 1) ^ (std::uint64_t{0} - (difference >> 63));
}

std::uint64_t unzigzag(std::uint64_t code) {
  return (code >> 1) ^ (std::uint64_t{0} - (code & 1));
}

std::uint64_t as_unsigned(std::int64_t value) {
  return static_cast<std::uint64_t>(value);
}

std::int64_t as_signed(std::uint64_t value) {
  return static_cast<std::int64_t>(value);
}

int plain_bits(std::uint64_t code) {
  return std::max(static_cast<int>(std::bit_width(code)), 1);
}

int code_bits(std::uint64_t code, int parameter) {
  const std::uint64_t ones = code >> parameter;
  if (ones >= escape_ones) return escape_ones + length_bits + plain_bits(code);
  return static_cast<int>(ones) + 1 + parameter;
}

/// The zigzag codes of a block and the Rice parameter of each axis.
struct Block {
  std::vector<std::uint64_t> codes;
  std::array<int, axes> parameters{};
  std::size_t bits = 0;
};

std::size_t axis_bits(const std::vector<std::uint64_t>& codes, std::size_t axis, int parameter) {
  std::size_t bits = 0;
  for (std::size_t i = axis; i < codes.size(); i += axes)
    bits += static_cast<std::size_t>(code_bits(codes[i], parameter));
  return bits;
}

/// Chooses the parameters: near the mean bit length, which a few far outliers do not move.
void fit(Block& block) {
  const std::size_t vertices = block.codes.size() / axes;
  for (std::size_t axis = 0; axis < axes; ++axis) {
    std::size_t length_sum = 0;
    for (std::size_t i = axis; i < block.codes.size(); i += axes) {
      length_sum += static_cast<std::size_t>(std::bit_width(block.codes[i]));
    }
    const int mean = vertices == 0 ? 0 : static_cast<int>(length_sum / vertices);
    std::size_t best_bits = SIZE_MAX;
    for (int parameter = std::max(mean - 2, 0); parameter <= std::min(mean + 1, 63); ++parameter) {
      const std::size_t bits = axis_bits(block.codes, axis, parameter);
      if (bits >= best_bits) continue;
      best_bits = bits;
      block.parameters[axis] = parameter;
    }
    block.bits += best_bits;
  }
}

Block key_block(std::span<const std::int64_t> lattice) {
  Block block;
  block.codes.resize(lattice.size());
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const std::uint64_t before = i < axes ? 0 : as_unsigned(lattice[i - axes]);
    block.codes[i] = zigzag(as_unsigned(lattice[i]) - before);
  }
  fit(block);
  return block;
}

Block delta_block(std::span<const std::int64_t> lattice, std::span<const std::int64_t> base) {
  Block block;
  block.codes.resize(lattice.size());
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    block.codes[i] = zigzag(as_unsigned(lattice[i]) - as_unsigned(base[i]));
  }
  fit(block);
  return block;
}

void write_block(Mode mode, const Block& block, std::string& payload) {
  payload.push_back(static_cast<char>(mode));
  BitWriter bits(payload);
  for (const int parameter : block.parameters) bits.put(static_cast<std::uint64_t>(parameter), parameter_bits);
  for (std::size_t i = 0; i < block.codes.size(); ++i) {
    const std::uint64_t code = block.codes[i];
    const int parameter = block.parameters[i % axes];
    const std::uint64_t ones = code >> parameter;
    if (ones >= escape_ones) {
      bits.put((1U << escape_ones) - 1, escape_ones);
      bits.put(static_cast<std::uint64_t>(plain_bits(code) - 1), length_bits);
      bits.put(code, plain_bits(code));
    } else {
      bits.put((std::uint64_t{2} << ones) - 2, static_cast<int>(ones) + 1);  // `ones` ones and a zero
      bits.put(code, parameter);
    }
  }
  bits.pad();
}

base::Status malformed(std::size_t body, std::string what) {
  return {base::StatusCode::malformed, std::move(what), "bodies[" + std::to_string(body) + "]"};
}

std::uint64_t take_code(BitReader& bits, int parameter) {
  const int ones = bits.take_ones(escape_ones);
  if (ones == escape_ones) return bits.take(static_cast<int>(bits.take(length_bits)) + 1);
  const std::uint64_t high = static_cast<std::uint64_t>(ones) << parameter;
  return high | bits.take(parameter);
}

/// Reads the bit string of a delta or key block into `lattice`, which holds the base for a delta, and drops it from
/// `payload`.
base::Status read_block(Mode mode, std::size_t body, std::string_view& payload, Lattice& lattice) {
  BitReader bits(payload);
  std::array<int, axes> parameters{};
  for (int& parameter : parameters) parameter = static_cast<int>(bits.take(parameter_bits));
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const std::uint64_t difference = unzigzag(take_code(bits, parameters[i % axes]));
    if (bits.failed()) return malformed(body, "the payload ends in vertex " + std::to_string(i / axes));
    std::uint64_t from = as_unsigned(lattice[i]);
    if (mode == Mode::key) from = i < axes ? 0 : as_unsigned(lattice[i - axes]);
    lattice[i] = as_signed(from + difference);
  }
  if (!bits.take_padding()) return malformed(body, "the last byte is not filled with zero bits");
  if (bits.failed()) return malformed(body, "the payload ends in the parameters");
  payload.remove_prefix(bits.position());
  return {};
}

}  // namespace

void encode_key(std::span<const std::int64_t> lattice, std::string& payload) {
  assert(lattice.size() % axes == 0);
  write_block(Mode::key, key_block(lattice), payload);
}

void encode_delta(std::span<const std::int64_t> lattice, std::span<const std::int64_t> base, std::string& payload) {
  assert(lattice.size() == base.size() && lattice.size() % axes == 0);
  if (std::ranges::equal(lattice, base)) {
    payload.push_back(static_cast<char>(Mode::unchanged));
    return;
  }
  const Block from_base = delta_block(lattice, base);
  const Block alone = key_block(lattice);  // the cheaper one after a reset or a great leap
  if (alone.bits < from_base.bits) {
    write_block(Mode::key, alone, payload);
  } else {
    write_block(Mode::delta, from_base, payload);
  }
}

base::Status decode(std::string_view payload, bool key, std::span<Lattice> bodies) {
  std::vector<Lattice> decoded;
  decoded.reserve(bodies.size());
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    assert(bodies[body].size() % axes == 0);
    if (payload.empty()) return malformed(body, "the payload ends before this body");
    const auto first = static_cast<unsigned char>(payload.front());
    payload.remove_prefix(1);
    if (first > static_cast<unsigned char>(Mode::key)) {
      return malformed(body, "no such block mode: " + std::to_string(first));
    }
    const Mode mode{first};
    if (key && mode != Mode::key) return malformed(body, "a key frame's block builds on a base");
    decoded.push_back(bodies[body]);
    if (mode == Mode::unchanged) continue;
    const base::Status read = read_block(mode, body, payload, decoded.back());
    if (!read.ok()) return read;
  }
  if (!payload.empty()) {
    return {base::StatusCode::malformed, std::to_string(payload.size()) + " bytes follow the last body", "payload"};
  }
  std::ranges::move(decoded, bodies.begin());
  return {};
}

}  // namespace pneuma::codec
