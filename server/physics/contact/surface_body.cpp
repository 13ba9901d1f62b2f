#include "physics/contact/surface_body.h"

namespace pneuma::physics {

double kept_distance_m(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  return bodies[pair.first].shell_m + bodies[pair.second].shell_m;
}

Candidate make_candidate(FeaturePair kind, bool swapped, std::uint32_t first, std::uint32_t second,
                         const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  const Mesh& of_first = *bodies[swapped ? pair.second : pair.first].topology->mesh;
  const Mesh& of_second = *bodies[swapped ? pair.first : pair.second].topology->mesh;
  if (kind == FeaturePair::vertex_face) {
    const auto& [a, b, c] = of_second.faces[second];
    return {kind, swapped, first, second, {first, a, b, c}};
  }
  const Edge& edge = of_first.edges[first];
  const Edge& other = of_second.edges[second];
  return {kind, swapped, first, second, {edge[0], edge[1], other[0], other[1]}};
}

}  // namespace pneuma::physics
