// No bytes from a server may crash a client's decoder, make it change what it refuses, or run past its bounds.
// Input: a byte of flags (key frame, number of bodies), a byte of size a body, then the payload.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <vector>

#include "codec/frame_codec.h"

using namespace pneuma::codec;

namespace {

/// A strip of triangles.
MeshOrderPtr strip(std::uint32_t vertices) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i + 2 < vertices; ++i) indices.insert(indices.end(), {i, i + 1, i + 2});
  return std::make_shared<const MeshOrder>(make_mesh_order(vertices, indices));
}

std::vector<Lattice> points_of(const FrameReader& reader, const std::vector<MeshOrderPtr>& orders) {
  std::vector<Lattice> all;
  for (std::size_t i = 0; i < orders.size(); ++i) reader.points(i, all.emplace_back(3 * orders[i]->size()));
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const bool key = (bytes[0] & 1U) != 0;
  const std::size_t count = (bytes[0] >> 1U) % 4U;
  if (size < 1 + count) return 0;
  std::vector<MeshOrderPtr> orders;
  for (std::size_t i = 0; i < count; ++i) orders.push_back(strip(bytes[1 + i]));
  FrameReader reader(orders);
  const auto before = points_of(reader, orders);

  const std::string_view payload(reinterpret_cast<const char*>(bytes) + 1 + count, size - 1 - count);
  const auto status = reader.read(payload, key);
  if (!status.ok() && points_of(reader, orders) != before) std::abort();
  // Twice: on top of what was read, with its moves.
  if (status.ok() && !key) (void)reader.read(payload, false);
  return 0;
}
