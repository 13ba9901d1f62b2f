// CRC-32C (Castagnoli): polynomial 0x1EDC6F41 reflected, initial value and final inversion as in iSCSI (RFC 3720, B.4).
#pragma once

#include <cstdint>
#include <string_view>

namespace pneuma::base {

/// Of `bytes`, going on from the checksum of what came before (0 at the start).
[[nodiscard]] std::uint32_t crc32c(std::string_view bytes, std::uint32_t before = 0);

}  // namespace pneuma::base
