#include "physics/contact/surface_body.h"

namespace pneuma::physics {

double kept_distance_m(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  return bodies[pair.first].shell_m + bodies[pair.second].shell_m;
}

FeatureCorners corners_of(const SurfacePair& pair, const Candidate& candidate, std::span<const SurfaceBody> bodies) {
  const std::uint32_t first = candidate.swapped ? pair.second : pair.first;
  const std::uint32_t second = candidate.swapped ? pair.first : pair.second;
  if (candidate.pair == FeaturePair::vertex_face) {
    const Face& face = bodies[second].topology->mesh->faces[candidate.second];
    return {{first, second, second, second}, {candidate.first, face[0], face[1], face[2]}};
  }
  const Edge& edge = bodies[first].topology->mesh->edges[candidate.first];
  const Edge& other = bodies[second].topology->mesh->edges[candidate.second];
  return {{first, first, second, second}, {edge[0], edge[1], other[0], other[1]}};
}

FourPoints FeatureCorners::start(std::span<const SurfaceBody> all) const {
  FourPoints points;
  for (std::size_t i = 0; i < 4; ++i) points[i] = all[bodies[i]].from[vertices[i]];
  return points;
}

FourPoints FeatureCorners::moves(std::span<const SurfaceBody> all) const {
  FourPoints points;
  for (std::size_t i = 0; i < 4; ++i) {
    const SurfaceBody& body = all[bodies[i]];
    points[i] = body.cuts[vertices[i]] * body.move_m(vertices[i]);
  }
  return points;
}

}  // namespace pneuma::physics
