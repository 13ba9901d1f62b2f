// The meshes of the fuzzers: strips of triangles.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "codec/frame_codec.h"

namespace pneuma::fuzz {

inline std::vector<std::uint32_t> strip(std::uint32_t vertices) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i + 2 < vertices; ++i) indices.insert(indices.end(), {i, i + 1, i + 2});
  return indices;
}

inline codec::MeshOrderPtr strip_order(std::uint32_t vertices) {
  return std::make_shared<const codec::MeshOrder>(codec::make_mesh_order(vertices, strip(vertices)));
}

}  // namespace pneuma::fuzz
