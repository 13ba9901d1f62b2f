#include "physics/rigid/rigid_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "physics/scene/shape_parts.h"

namespace pneuma::physics {
namespace {

Knobs knobs_of(const ConvexPose& body) {
  Knobs knobs =
      of_rigid_shape(body.shape, Knobs(), [](const auto& rigid, const auto& one) { return rigid.knobs(one); });
  for (std::size_t i = 0; i < knobs.count; ++i) knobs.centres[i] = body.frame.to_world(knobs.centres[i]);
  return knobs;
}

class MeshToucher {
 public:
  MeshToucher(const MeshTree& tree, const ConvexPose& body, double reach_m, std::vector<MeshTouch>& touches)
      : tree_(tree), body_(body), reach_m_(reach_m), knobs_(knobs_of(body)), touches_(touches) {}

  void find() {
    const Vec3d half = (body_.frame.rotation.cwiseAbs() * half_extents_m(body_.shape)).array() + reach_m_;
    const FaceTree::Box box{body_.frame.origin - half, body_.frame.origin + half};
    tree_.faces.for_near(box, [&](std::uint32_t face) {
      touch_face(tree_.mesh->faces[face]);
      for (const std::uint32_t edge : tree_.sharp_edges[face]) touch_edge(tree_.mesh->edges[edge]);
    });
  }

 private:
  void touch_face(const Face& face) {
    const std::vector<Vec3d>& positions_m = tree_.mesh->positions_m;
    const std::array<Vec3d, 3> corners{positions_m[face[0]], positions_m[face[1]], positions_m[face[2]]};
    Vec3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    normal *= sign_of(normal.dot(body_.frame.origin - corners[0]));
    for (std::size_t k = 0; k < knobs_.count; ++k) {
      const Vec3d& centre = knobs_.centres[k];
      const double height_m = normal.dot(centre - corners[0]);
      const double distance_m = height_m - knobs_.radius_m;
      if (distance_m > reach_m_) continue;
      const Vec3d foot = centre - height_m * normal;
      bool is_over = is_within(corners, normal, foot);
      const double sinks_m = -normal.dot(body_.way_m);
      if (!is_over && distance_m >= 0.0 && sinks_m > distance_m) {
        is_over = is_within(corners, normal, foot + distance_m / sinks_m * (body_.way_m + sinks_m * normal));
      }
      if (is_over) touches_.push_back({foot, normal, distance_m});
    }
  }

  static bool is_within(const std::array<Vec3d, 3>& corners, const Vec3d& normal, const Vec3d& p) {
    double least = 1.0;
    double most = -1.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3d& from = corners[i];
      const double side = normal.dot((corners[(i + 1) % 3] - from).cross(p - from));
      least = std::min(least, side);
      most = std::max(most, side);
    }
    return least >= 0.0 || most <= 0.0;  // the normal may be turned to the other side
  }

  void touch_edge(const Edge& edge) {
    const Vec3d first = body_.frame.to_local(tree_.mesh->positions_m[edge[0]]);
    const Vec3d way = body_.frame.to_local(tree_.mesh->positions_m[edge[1]]) - first;
    const Vec3d at = first + deepest_on_segment(body_.shape, first, way) * way;
    const SurfacePoint nearest = nearest_surface(body_.shape, at);
    if (nearest.distance_m > reach_m_) return;
    touches_.push_back({body_.frame.to_world(at), -(body_.frame.rotation * nearest.normal), nearest.distance_m});
  }

  const MeshTree& tree_;
  const ConvexPose& body_;
  double reach_m_;
  Knobs knobs_;
  std::vector<MeshTouch>& touches_;
};

}  // namespace

void touch_mesh(const MeshTree& tree, const ConvexPose& body, double reach_m, std::vector<MeshTouch>& touches) {
  MeshToucher(tree, body, reach_m, touches).find();
}

double deepest_on_segment(const Shape& shape, const Vec3d& first, const Vec3d& way, int halvings) {
  double low = 0.0;
  double high = 1.0;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    const double slope = nearest_surface(shape, first + middle * way).normal.dot(way);
    if (slope == 0.0) return middle;
    (slope > 0.0 ? high : low) = middle;
  }
  return low == 0.0 ? 0.0 : high == 1.0 ? 1.0 : 0.5 * (low + high);
}

}  // namespace pneuma::physics
