// How a recording's file is laid out (WIRE.md, "Recordings").
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/byte_order.h"
#include "base/crc32c.h"

namespace pneuma::client {

inline constexpr std::string_view recording_magic = "PNEUMARC";
inline constexpr std::string_view recording_index_magic = "PNEUMAIX";
inline constexpr std::uint32_t recording_version = 1;
inline constexpr std::size_t recording_preamble_bytes = recording_magic.size() + sizeof(std::uint32_t);

enum class RecordKind : unsigned char { header = 1, message = 2, index = 3 };
// Length, checksum of what follows it, kind.
inline constexpr std::size_t record_prefix_bytes = 2 * sizeof(std::uint32_t) + 1;
// As large as a message may be that a client takes (WIRE.md, "Limits").
inline constexpr std::size_t record_bytes_max = std::size_t{64} * 1024 * 1024;
// Behind the index: its offset, and the magic.
inline constexpr std::size_t recording_trailer_bytes = sizeof(std::uint64_t) + recording_index_magic.size();

inline void append_record(std::string& out, RecordKind kind, std::string_view bytes) {
  const std::string kind_byte(1, static_cast<char>(kind));
  base::append_number(out, static_cast<std::uint32_t>(bytes.size()));
  base::append_number(out, base::crc32c(bytes, base::crc32c(kind_byte)));
  out += kind_byte;
  out += bytes;
}

}  // namespace pneuma::client
