#include <cassert>

#include "codec/frame_codec.h"

namespace pneuma::codec {

// Modulo 2^64: bytes of any content may come to be read.
void BodyMotion::move_by(const std::vector<Lanes>& move) {
  assert(points.size() == 3 * move.size());
  std::int64_t* const to = points.data();
  for (std::size_t slot = 0; slot < move.size(); ++slot) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto far = static_cast<std::int64_t>(static_cast<std::int32_t>(move[slot].v[axis]));
      std::int64_t& point = to[3 * slot + axis];
      point = static_cast<std::int64_t>(static_cast<std::uint64_t>(point) + static_cast<std::uint64_t>(far));
    }
  }
}

}  // namespace pneuma::codec
