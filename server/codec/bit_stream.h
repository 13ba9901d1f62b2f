// Strings of bits in bytes, the most significant bit of a byte first.
#pragma once

#include <bit>
#include <cassert>
#include <cstdint>
#include <string>
#include <string_view>

namespace pneuma::codec {

/// Appends bits to a string of bytes.
class BitWriter {
 public:
  explicit BitWriter(std::string& bytes) : bytes_(bytes) {}

  /// The low `count` bits of `value`, 0 <= count <= 64, the highest of them first.
  void put(std::uint64_t value, int count) {
    assert(count >= 0 && count <= 64);
    if (count > 32) {
      put(value >> 32, count - 32);
      count = 32;
    }
    pending_ = (pending_ << count) | (value & ((std::uint64_t{1} << count) - 1));
    used_ += count;
    while (used_ >= 8) {
      used_ -= 8;
      bytes_.push_back(static_cast<char>((pending_ >> used_) & 0xffU));
    }
  }

  /// Fills the last byte with zero bits.
  void pad() {
    if (used_ > 0) put(0, 8 - used_);
  }

 private:
  std::string& bytes_;
  std::uint64_t pending_ = 0;  // its low used_ bits are not in bytes_ yet
  int used_ = 0;               // between calls, fewer than 8
};

/// Takes bits from bytes. Past the end every bit reads as zero and failed() turns true.
class BitReader {
 public:
  explicit BitReader(std::string_view bytes) : bytes_(bytes) {}

  /// The next `count` bits, 0 <= count <= 64.
  [[nodiscard]] std::uint64_t take(int count) {
    assert(count >= 0 && count <= 64);
    std::uint64_t value = 0;
    while (count > 0) {
      const int left = 8 - used_;
      const int taken = count < left ? count : left;
      value = (value << taken) | ((current() >> (left - taken)) & ((1U << taken) - 1U));
      skip(taken);
      count -= taken;
    }
    return value;
  }

  /// Counts one bits up to the first zero bit, which it takes as well; stops after `ones_max` ones and takes no zero
  /// bit then.
  [[nodiscard]] int take_ones(int ones_max) {
    int ones = 0;
    while (ones < ones_max) {
      const int left = 8 - used_;
      const auto rest = static_cast<std::uint8_t>(current() << used_);
      int run = std::countl_one(rest);
      if (run > left) run = left;
      if (ones + run >= ones_max) {
        skip(ones_max - ones);
        return ones_max;
      }
      ones += run;
      if (run < left) {
        skip(run + 1);
        return ones;
      }
      skip(run);
    }
    return ones;
  }

  /// Goes on to the next whole byte. False where a bit skipped is not zero.
  [[nodiscard]] bool take_padding() { return used_ == 0 || take(8 - used_) == 0; }

  [[nodiscard]] bool failed() const { return failed_; }
  /// Bytes begun.
  [[nodiscard]] std::size_t position() const { return next_ + (used_ > 0 ? 1 : 0); }

 private:
  [[nodiscard]] unsigned current() {
    if (next_ < bytes_.size()) return static_cast<unsigned char>(bytes_[next_]);
    failed_ = true;
    return 0;
  }

  void skip(int count) {
    used_ += count;
    if (used_ == 8) {
      used_ = 0;
      ++next_;
    }
  }

  std::string_view bytes_;
  std::size_t next_ = 0;
  int used_ = 0;  // bits taken of byte next_, always fewer than 8
  bool failed_ = false;
};

}  // namespace pneuma::codec
