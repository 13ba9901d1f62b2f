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

}  // namespace pneuma::fuzz
