#include "physics/contact/solid_features.h"

#include <algorithm>

namespace pneuma::physics {
namespace {

// The cosine between two faces from which on they are opposite.
constexpr double opposite_faces = -0.99;

}  // namespace

// The distance to a convex solid is convex along an edge, so one that falls from both ends is least between them.
std::optional<EdgeTouch> touch_of_edge(const Shape& shape, double offset_m, const Vec3d& first,
                                       const SurfacePoint& of_first, const Vec3d& second, const SurfacePoint& of_second,
                                       double slack_m, double near_m) {
  const Vec3d way = second - first;
  const double falls = -of_first.normal.dot(way);
  const double rises = of_second.normal.dot(way);
  if (falls <= 0.0 || rises <= 0.0) return std::nullopt;
  // It goes no deeper than the tangents at its ends.
  const double ends_m = std::min(of_first.distance_m, of_second.distance_m);
  const double least_m = (rises * of_first.distance_m + falls * of_second.distance_m - falls * rises) / (falls + rises);
  if (ends_m - least_m <= slack_m || least_m > near_m) return std::nullopt;
  if (ends_m < -slack_m || of_first.normal.dot(of_second.normal) < opposite_faces) return std::nullopt;
  const double share = deepest_on_segment(shape, first, way, deepest_halvings);
  if (share <= 0.0 || share >= 1.0) return std::nullopt;
  const SurfacePoint deepest = nearest_surface(shape, first + share * way, offset_m);
  if (ends_m - deepest.distance_m <= slack_m) return std::nullopt;
  return EdgeTouch{share, deepest};
}

std::optional<FaceTouch> touch_of_face(const Vec3d& knob, const Vec3d& a, const Vec3d& b, const Vec3d& c,
                                       bool along_normal, double deepest_m) {
  FaceTouch touch;
  touch.foot = nearest_of_face(knob, a, b, c);
  if (touch.foot.corners() != 7) return std::nullopt;
  const Vec3d normal = (along_normal ? 1.0 : -1.0) * (b - a).cross(c - a);
  touch.normal = normal.normalized();
  if (touch.normal.dot(a - knob) < -deepest_m) return std::nullopt;
  return touch;
}

}  // namespace pneuma::physics
