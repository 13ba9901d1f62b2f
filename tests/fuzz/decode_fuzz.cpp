// No bytes from a server may crash a client's decoder, make it change what it refuses, or run past its bounds.
// Input: a byte of flags (key frame, number of bodies), a byte of size a body, then the payload.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "codec/frame_codec.h"

using pneuma::codec::Lattice;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const bool key = (bytes[0] & 1U) != 0;
  const std::size_t count = (bytes[0] >> 1U) % 4U;
  if (size < 1 + count) return 0;
  std::vector<Lattice> bodies;
  bodies.reserve(count);
  for (std::size_t i = 0; i < count; ++i) bodies.emplace_back(3 * std::size_t{bytes[1 + i]}, static_cast<int>(i));
  const std::vector<Lattice> before = bodies;

  const std::string_view payload(reinterpret_cast<const char*>(bytes) + 1 + count, size - 1 - count);
  const auto status = pneuma::codec::decode(payload, key, bodies);
  if (!status.ok() && bodies != before) std::abort();
  for (std::size_t i = 0; i < count; ++i) {
    if (bodies[i].size() != before[i].size()) std::abort();
  }

  // What was understood survives the encoder.
  if (status.ok()) {
    std::string again;
    for (std::size_t i = 0; i < count; ++i) pneuma::codec::encode_delta(bodies[i], before[i], again);
    std::vector<Lattice> twice = before;
    if (!pneuma::codec::decode(again, false, twice).ok() || twice != bodies) std::abort();
  }
  return 0;
}
