#include "physics/forces/tangents.h"

#include <Eigen/Geometry>

namespace pneuma::physics {

void Tangents::clear(const Mesh& mesh) {
  edges.resize(mesh.edges.size());  // springs, which come first, write them anew
  four_points.clear();
  faces.clear();
}

void Tangents::add_product(const Mesh& mesh, std::span<const Vec3d> u, std::span<Vec3d> product) const {
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto [a, b] = mesh.edges[i];
    const EdgeTangent& tangent = edges[i];
    const Vec3d du = u[b] - u[a];
    const double stretch = (tangent.along - tangent.across) * tangent.direction.dot(du);
    const Vec3d pull = stretch * tangent.direction + tangent.across * du;
    // -P grad^2 V: what an edge does to both its ends is one and the same, as the ring around a vertex closes.
    const Vec3d turned = du.cross(tangent.turn);
    product[a] -= pull + turned;
    product[b] += pull - turned;
  }
  for (const FourPointTangent& tangent : four_points) {
    double moved = 0.0;
    for (std::size_t i = 0; i < 4; ++i) moved += tangent.gradient[i].dot(u[tangent.vertices[i]]);
    for (std::size_t i = 0; i < 4; ++i) {
      product[tangent.vertices[i]] += tangent.stiffness * moved * tangent.gradient[i];
    }
  }
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const auto [a, b, c] = mesh.faces[i];
    const Vec3d share = faces[i] * (u[a] + u[b] + u[c]);
    product[a] += share;
    product[b] += share;
    product[c] += share;
  }
}

std::size_t Tangents::bytes() const {
  return edges.capacity() * sizeof(EdgeTangent) + four_points.capacity() * sizeof(FourPointTangent) +
         faces.capacity() * sizeof(Eigen::Matrix3d);
}

}  // namespace pneuma::physics
