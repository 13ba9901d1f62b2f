// What recorded frames cost in our format, and in those of others.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "codec/simulated_motion.h"
#include "support/recording.h"

namespace pneuma::bench {

/// Of a recording's delta frames; the error of its key frame, too.
struct FrameCost {
  double bits = 0.0;      // a vertex a frame, with all that a frame takes on the wire
  double write_ns = 0.0;  // a vertex, of the median frame
  double read_ns = 0.0;
  double error_max_m = 0.0;  // of any vertex of any frame
};
/// `mechanics`: of each body that is simulated; none given: no body is. Throws std::runtime_error where a frame does
/// not read back.
[[nodiscard]] FrameCost frame_cost(const support::Recording& recording, double max_error_m,
                                   const std::vector<std::optional<codec::Mechanics>>& mechanics = {});

/// Bits a vertex a frame, without any of what carries a frame: positions on the cubic grid of the same bound, less
/// where linear motion would have taken them.
struct PeerBits {
  double zstd = 0.0;
  double meshoptimizer = 0.0;
  double draco = 0.0;

  [[nodiscard]] double least() const { return std::min({zstd, meshoptimizer, draco}); }
};
[[nodiscard]] PeerBits peer_bits(const support::Recording& recording, double max_error_m);

}  // namespace pneuma::bench
