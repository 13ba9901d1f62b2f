#include "codec/payload_heads.h"

#include <algorithm>
#include <utility>

namespace pneuma::codec {

namespace {

constexpr std::size_t coordinate_bytes = 8;

/// Takes bytes off the front; past the end they are zero and failed() turns true.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  std::uint8_t byte() {
    const std::string_view one = take(1);
    return one.empty() ? 0 : static_cast<std::uint8_t>(one.front());
  }
  std::string_view take(std::size_t count) {
    failed_ = failed_ || count > bytes_.size();
    if (failed_) return {};
    const std::string_view taken = bytes_.substr(0, count);
    bytes_.remove_prefix(count);
    return taken;
  }
  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] std::string_view rest() const { return bytes_; }

 private:
  std::string_view bytes_;
  bool failed_ = false;
};

bool is_level(std::uint8_t level) {
  return level <= level_max;
}
bool is_list_level(std::uint8_t level) {
  return is_level(level) || level == level_of_rest;
}

void take_history(ByteReader& bytes, const BlockBody& body, BlockHead& head) {
  for (std::uint8_t& level : head.history) level = bytes.byte();
  if (body.is_simulated) head.velocities = bytes.byte();
}

bool is_mode_of(const BlockBody& body, BlockMode mode) {
  return mode <= BlockMode::again || (mode == BlockMode::simulated && body.is_simulated);
}

BlockHead take_head(ByteReader& bytes, const BlockBody& body) {
  BlockHead head;
  head.mode = static_cast<BlockMode>(bytes.byte());
  switch (head.mode) {
    case BlockMode::still:
      break;
    case BlockMode::plain:
      head.plain = bytes.take(3 * coordinate_bytes * body.vertices);
      take_history(bytes, body, head);
      break;
    case BlockMode::key: {
      const std::string_view anchor = bytes.take(3 * coordinate_bytes);
      for (std::size_t axis = 0; axis < 3 && !anchor.empty(); ++axis) head.anchor[axis] = coordinate_at(anchor, axis);
      head.level = bytes.byte();
      take_history(bytes, body, head);
      break;
    }
    case BlockMode::moved:
    case BlockMode::again:
    case BlockMode::simulated:
      head.level = bytes.byte();
      break;
  }
  return head;
}

}  // namespace

base::Status malformed_body(std::size_t body, std::string what) {
  return {base::StatusCode::malformed, std::move(what),
          std::string("bodies[").append(std::to_string(body)).append("]")};
}

void append_coordinate(std::int64_t value, std::string& bytes) {
  const auto pattern = static_cast<std::uint64_t>(value);
  for (int shift = 0; shift < 64; shift += 8) bytes.push_back(static_cast<char>((pattern >> shift) & 0xffU));
}

std::int64_t coordinate_at(std::string_view bytes, std::size_t index) {
  std::uint64_t pattern = 0;
  for (std::size_t i = coordinate_bytes; i-- > 0;) {
    pattern = (pattern << 8) | static_cast<std::uint8_t>(bytes[coordinate_bytes * index + i]);
  }
  return static_cast<std::int64_t>(pattern);
}

void append_head(const BlockHead& head, std::string& bytes) {
  const auto append = [&bytes](auto byte) { bytes.push_back(static_cast<char>(byte)); };
  append(head.mode);
  if (head.mode == BlockMode::still) return;
  if (head.mode == BlockMode::plain) {
    bytes.append(head.plain);
  } else {
    if (head.mode == BlockMode::key) {
      for (const std::int64_t coordinate : head.anchor) append_coordinate(coordinate, bytes);
    }
    append(head.level);
  }
  if (!head.stands_alone()) return;
  for (const std::uint8_t level : head.history) append(level);
  if (head.velocities) append(*head.velocities);
}

base::Result<std::vector<BlockHead>> take_heads(std::string_view& payload, bool key,
                                                std::span<const BlockBody> bodies) {
  ByteReader bytes(payload);
  const std::uint8_t format = bytes.byte();
  if (bytes.failed()) return base::Status(base::StatusCode::malformed, "is empty", "payload");
  if (format != payload_format) {
    return base::Status(base::StatusCode::malformed,
                        std::string("is of format ").append(std::to_string(format)).append(", which is not known"),
                        "payload");
  }
  std::vector<BlockHead> heads;
  heads.reserve(bodies.size());
  for (std::size_t body = 0; body < bodies.size(); ++body) {
    const BlockHead head = take_head(bytes, bodies[body]);
    if (bytes.failed()) return malformed_body(body, "the payload ends in this body's head");
    if (!is_mode_of(bodies[body], head.mode)) {
      return malformed_body(body,
                            std::string("no such block mode: ").append(std::to_string(static_cast<int>(head.mode))));
    }
    if (key && !head.stands_alone()) return malformed_body(body, "a key frame's block builds on a base");
    const bool lists_good =
        std::ranges::all_of(head.history, is_list_level) && is_list_level(head.velocities.value_or(level_of_rest));
    if (!is_level(head.level) || !lists_good) return malformed_body(body, "no such level");
    heads.push_back(head);
  }
  payload = bytes.rest();
  return heads;
}

}  // namespace pneuma::codec
