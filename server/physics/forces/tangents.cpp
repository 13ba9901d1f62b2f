#include "physics/forces/tangents.h"

namespace pneuma::physics {

void Tangents::clear(const Mesh& mesh) {
  edges.resize(mesh.edges.size());  // springs, which come first, write them anew
  four_points.clear();
  faces.clear();
}

std::size_t Tangents::bytes() const {
  return edges.capacity() * sizeof(EdgeTangent) + four_points.capacity() * sizeof(FourPointTangent) +
         faces.capacity() * sizeof(Eigen::Matrix3d);
}

}  // namespace pneuma::physics
