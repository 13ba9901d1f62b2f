#include "codec/topology_hash.h"

#include <array>
#include <cstdio>
#include <cstdlib>

#include <openssl/evp.h>

namespace pneuma::codec {

namespace {

void append_u32(std::uint32_t value, std::string& bytes) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>((value >> shift) & 0xffU));
}

}  // namespace

std::string topology_hash(std::uint32_t vertex_count, std::span<const std::uint32_t> indices) {
  std::string bytes;
  bytes.reserve(4 * (indices.size() + 1));
  append_u32(vertex_count, bytes);
  for (const std::uint32_t index : indices) append_u32(index, bytes);

  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  const int done = EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr);
  if (done != 1 || size < topology_hash_bytes) {
    // Not of anybody's doing outside: a libcrypto without SHA-256, or no memory. Any other answer would be a wrong
    // hash.
    std::fputs("pneuma: libcrypto cannot compute SHA-256\n", stderr);
    std::abort();
  }
  return {reinterpret_cast<const char*>(digest.data()), topology_hash_bytes};
}

}  // namespace pneuma::codec
