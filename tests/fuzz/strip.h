// What fuzzers share: meshes, which are strips of triangles, and messages one behind the other.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "codec/frame_codec.h"

namespace pneuma::fuzz {

inline std::vector<std::uint32_t> strip(std::uint32_t vertices) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i + 2 < vertices; ++i) indices.insert(indices.end(), {i, i + 1, i + 2});
  return indices;
}

/// Of a strip whose mechanics are told.
inline codec::Mechanics strip_mechanics(const codec::MeshOrder& order) {
  codec::Mechanics mechanics;
  mechanics.frame_s = 0.02;
  mechanics.substeps = 4;
  mechanics.masses_kg = {0.25F};
  mechanics.rest_lengths_m.assign(codec::spring_edges(order).size(), 0.1F);
  mechanics.stiffnesses_n_m = {40.0F};
  mechanics.damping_n_s_m = 0.01;
  mechanics.gas = {10.0, 1e-3, 91750, 1.0};
  mechanics.gravity_m_s2 = {0.0, -9.81, 0.0};
  mechanics.planes = {{{0.0, 1.0, 0.0}, 0.0, 0.5, 0.5}};
  return mechanics;
}

inline codec::MeshOrderPtr strip_order(std::uint32_t vertices) {
  return std::make_shared<const codec::MeshOrder>(codec::make_mesh_order(vertices, strip(vertices)));
}

/// Takes two bytes of length, and as many more as there are of it.
inline std::string_view take_message(std::string_view& rest) {
  if (rest.size() < 2) return std::exchange(rest, {});
  const auto length = static_cast<std::uint8_t>(rest[0]) + 256U * static_cast<std::uint8_t>(rest[1]);
  rest.remove_prefix(2);
  const std::string_view message = rest.substr(0, length);
  rest.remove_prefix(message.size());
  return message;
}

}  // namespace pneuma::fuzz
