#include "physics/contact/surface_body.h"

namespace pneuma::physics {

double kept_distance_m(const SurfacePair& pair, std::span<const SurfaceBody> bodies) {
  return bodies[pair.first].shell_m + bodies[pair.second].shell_m;
}

}  // namespace pneuma::physics
