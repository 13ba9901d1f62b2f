// What else would code a frame: general and mesh compressors, on the differences from linear motion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace pneuma::bench {

/// Bytes of the smallest of zstd -19, meshoptimizer's vertex codec and zstd, and Draco, for a frame of so many
/// residuals, three a vertex. zstd alone takes the better of interleaved bytes and byte planes.
struct PeerBytes {
  std::size_t zstd = 0;
  std::size_t meshoptimizer = 0;
  std::size_t draco = 0;
};
[[nodiscard]] PeerBytes peer_bytes(const std::vector<std::int32_t>& residuals);

}  // namespace pneuma::bench
