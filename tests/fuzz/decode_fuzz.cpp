// No bytes from a server may crash a client's decoder, make it change what it refuses, or run past its bounds.
// Input: a byte of flags (key frame, number of bodies, whether the first is simulated), a byte of size a body, then the
// payload. Where it begins: the
// golden vectors (make_seeds.py), some of which are of such strips.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <vector>

#include "codec/frame_codec.h"
#include "fuzz/strip.h"

using namespace pneuma::codec;

namespace {

std::vector<BodyMotion> motions_of(const FrameReader& reader, std::size_t bodies) {
  std::vector<BodyMotion> all;
  for (std::size_t i = 0; i < bodies; ++i) all.push_back(reader.motion(i));
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const bool key = (bytes[0] & 1U) != 0;
  const std::size_t count = (bytes[0] >> 1U) % 4U;
  if (size < 1 + count) return 0;
  std::vector<MeshOrderPtr> orders;
  for (std::size_t i = 0; i < count; ++i) orders.push_back(pneuma::fuzz::strip_order(bytes[1 + i]));
  std::vector<SimulatedMotionPtr> simulations(count);
  if ((bytes[0] & 8U) != 0 && count > 0) {
    simulations[0] = std::make_shared<SimulatedMotion>(orders[0], pneuma::fuzz::strip(bytes[1]),
                                                       pneuma::fuzz::strip_mechanics(*orders[0]), 0.001);
  }
  FrameReader reader(orders, simulations);

  const std::string_view payload(reinterpret_cast<const char*>(bytes) + 1 + count, size - 1 - count);
  // A delta twice: on top of what was read, with its moves.
  for (int round = 0; round < (key ? 1 : 2); ++round) {
    const auto before = motions_of(reader, count);
    const auto status = reader.read(payload, key);
    if (!status.ok() && motions_of(reader, count) != before) std::abort();
  }
  return 0;
}
