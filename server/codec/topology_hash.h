// The name of a mesh's triangles: what lets a client say that it holds them already.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace pneuma::codec {

inline constexpr std::size_t topology_hash_bytes = 16;

/// The first 16 bytes of SHA-256 over the vertex count and then the indices, each a little-endian 32-bit integer
/// (proto/WIRE.md, "Topology"). Cryptographic, since clients share these names and bring their own meshes.
[[nodiscard]] std::string topology_hash(std::uint32_t vertex_count, std::span<const std::uint32_t> indices);

}  // namespace pneuma::codec
