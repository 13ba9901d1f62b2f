#include "net/framing.h"

#include <algorithm>

namespace pneuma::net {

std::array<char, length_prefix_bytes> length_prefix(std::size_t message_bytes) {
  const auto length = static_cast<std::uint32_t>(message_bytes);
  return {static_cast<char>(length >> 24U), static_cast<char>(length >> 16U), static_cast<char>(length >> 8U),
          static_cast<char>(length)};
}

base::Result<std::optional<std::string>> FrameReader::take(std::string_view& bytes) {
  if (!error_.ok()) return error_;
  while (prefix_bytes_ < length_prefix_bytes) {
    if (bytes.empty()) return std::optional<std::string>();
    prefix_[prefix_bytes_++] = bytes.front();
    bytes.remove_prefix(1);
    if (prefix_bytes_ < length_prefix_bytes) continue;
    length_ = 0;
    for (const char byte : prefix_) length_ = (length_ << 8U) | static_cast<unsigned char>(byte);
    if (length_ == 0 || length_ > message_bytes_max_) {
      const bool is_tls = prefix_[0] == 0x16 && prefix_[1] == 0x03;  // RFC 8446 5.1: a handshake record, version 3.x
      error_ = {base::StatusCode::malformed, is_tls ? "the client speaks TLS, and this port does not"
                                                    : "a message of " + std::to_string(length_) +
                                                          " bytes was announced; 1 to " +
                                                          std::to_string(message_bytes_max_) + " are taken"};
      return error_;
    }
  }
  const std::size_t taken = std::min<std::size_t>(length_ - message_.size(), bytes.size());
  message_.append(bytes.substr(0, taken));
  bytes.remove_prefix(taken);
  if (message_.size() < length_) return std::optional<std::string>();
  prefix_bytes_ = 0;
  return std::optional<std::string>(std::exchange(message_, {}));
}

}  // namespace pneuma::net
