// Messages on a byte stream: a 4-byte big-endian length, then the message. Owns no socket.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/status.h"

namespace pneuma::net {

inline constexpr std::size_t length_prefix_bytes = 4;

/// The prefix that goes before a message of this size.
[[nodiscard]] std::array<char, length_prefix_bytes> length_prefix(std::size_t message_bytes);

/// Takes bytes as they come and gives whole messages. A length of 0 or past the limit is an error, found before any
/// room is made for the message; after an error the stream cannot be trusted and every further call gives the same
/// error.
class FrameReader {
 public:
  explicit FrameReader(std::size_t message_bytes_max) : message_bytes_max_(message_bytes_max) {}

  /// Counts from the next length on.
  void set_limit(std::size_t message_bytes_max) { message_bytes_max_ = message_bytes_max; }

  /// Takes from the front of `bytes` (and shortens it) until a message is whole or the bytes are used up.
  [[nodiscard]] base::Result<std::optional<std::string>> take(std::string_view& bytes);

  /// Memory of the message so far.
  [[nodiscard]] std::size_t held_bytes() const { return message_.empty() ? 0 : message_.capacity(); }

  /// Between the first byte of a message's length and its last byte.
  [[nodiscard]] bool in_message() const { return prefix_bytes_ > 0; }

 private:
  std::size_t message_bytes_max_;
  std::array<char, length_prefix_bytes> prefix_{};
  std::size_t prefix_bytes_ = 0;  // of the prefix taken so far
  std::uint32_t length_ = 0;
  std::string message_;
  base::Status error_;
};

}  // namespace pneuma::net
